//! The core of the Python package `dmp_slam`: the command, logs, maps and tables. It releases the interpreter lock
//! while it works.
//!
//! # Brief overview
//! [`run`](run::run) runs any command: arguments in, output out, with a listener for its messages. The rest is what
//! Python cannot do fast enough: writing scans from arrays into a log ([`ScanWriter`](scan_writer::ScanWriter)),
//! casting rays into a map and differentiating residuals ([`Map`](map::Map)), and passing on tables ([`Table`](table::Table)). The package's
//! interface is written in Python on top of these, in `dmp_slam`.

#![expect(clippy::needless_pass_by_value, reason = "functions are handed what Python calls them with")]

mod cast;
mod chunks;
mod columns;
mod errors;
mod file_stems;
mod listened;
mod map;
mod options;
mod residuals;
mod run;
mod scan_writer;
mod table;

use pyo3::prelude::*;

/// The native module of `dmp_slam`.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(columns::columns, module)?)?;
    module.add_function(wrap_pyfunction!(file_stems::file_stems, module)?)?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(run::check_arguments, module)?)?;
    module.add_function(wrap_pyfunction!(run::main, module)?)?;
    module.add_function(wrap_pyfunction!(options::options, module)?)?;
    module.add_class::<map::Map>()?;
    module.add_class::<scan_writer::ScanWriter>()?;
    module.add_class::<table::Table>()
}
