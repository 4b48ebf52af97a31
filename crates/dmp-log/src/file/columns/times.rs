//! A list of stamps, a line for each.

use crate::file::decimal::ns_to_seconds;
use std::io::{self, Write};

/// Writes stamps as a `times.txt` has them: seconds, one line a pose.
///
/// # Errors
/// As `out` does.
pub fn write_times(out: &mut impl Write, stamps_ns: &[i64]) -> io::Result<()> {
    stamps_ns.iter().try_for_each(|&ns| writeln!(out, "{}", ns_to_seconds(ns)))
}
