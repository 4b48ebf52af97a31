//! Converts errors to the package's exceptions.

use std::fmt;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// An exception of `dmp_slam.errors` with one line.
pub(crate) fn of_package(py: Python<'_>, class: &str, line: &dyn fmt::Display) -> PyErr {
    let found = py.import("dmp_slam.errors").and_then(|module| module.getattr(class));
    match found.and_then(|class| class.cast_into::<PyType>().map_err(Into::into)) {
        Ok(class) => PyErr::from_type(class, line.to_string()),
        Err(error) => error,
    }
}

/// A file cannot be read or written in the expected format.
pub(crate) fn input(py: Python<'_>, line: &dyn fmt::Display) -> PyErr {
    of_package(py, "InputError", line)
}

/// Any other failure.
pub(crate) fn failed(py: Python<'_>, line: &dyn fmt::Display) -> PyErr {
    of_package(py, "Error", line)
}

/// The object was used after its end.
pub(crate) fn is_over(what: &str) -> PyErr {
    PyTypeError::new_err(format!("the {what} is finished"))
}
