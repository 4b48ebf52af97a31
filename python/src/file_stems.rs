//! File names of runs.

use dmp::file_stem_of;
use pyo3::prelude::*;

/// The names of all runs as file names, as `score` uses them for files per run.
#[pyfunction]
pub(crate) fn file_stems(names: Vec<String>) -> Vec<String> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    names.iter().map(|name| file_stem_of(&names, name)).collect()
}
