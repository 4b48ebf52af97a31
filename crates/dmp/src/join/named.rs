//! A report that is to stand beside others.

use crate::report::Report;

/// A report, and what to call it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedReport {
    /// Stands in front of the names of runs that other reports have too.
    pub name: String,
    /// The file that it is from, or what else messages are to call it.
    pub file: String,
    /// The report.
    pub report: Report,
}
