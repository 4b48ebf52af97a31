//! The columns of the table of the runs.

use dmp::{ColumnUnit, columns_by_rank};
use pyo3::prelude::*;

/// The columns in the order of tables: the name in lower case, the field of a run in the JSON, and `root`, `square` or `share`.
#[pyfunction]
pub(crate) fn columns() -> Vec<(String, &'static str, &'static str)> {
    let column = |column: &dmp::Column| {
        let unit = match column.unit {
            ColumnUnit::Root => "root",
            ColumnUnit::Square => "square",
            ColumnUnit::Share => "share",
        };
        (column.name.to_lowercase(), column.field, unit)
    };
    columns_by_rank().into_iter().map(column).collect()
}
