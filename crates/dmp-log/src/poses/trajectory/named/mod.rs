//! Columns in any order: by their names, or else by their values.

mod by_values;
pub(crate) mod csv;
pub(crate) mod header;
mod names;

pub(crate) use by_values::find as find_by_values;
pub(crate) use csv::parse_csv_in;
