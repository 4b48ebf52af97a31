//! Columns that have names.

pub(crate) mod csv;
pub(crate) mod header;
mod names;

pub(crate) use csv::parse_csv_in;
