//! Scan logs as a folder of files with one scan each.

mod bin;
mod calendar;
mod decide;
mod entry;
mod found;
mod log;
pub(crate) mod names;
mod open;
mod scan_file;
mod stamps;
mod times;

pub use bin::{BinLayout, BinLayoutError};
pub(crate) use found::{FoundScans, PLACES};
pub(crate) use log::ScanFolder;
pub(crate) use stamps::{LISTS, MAX_STAMPS_BYTES, parse_times};
