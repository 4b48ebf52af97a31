//! A report with the name it gets in a join.

use dmp_report::Report;

/// A report and its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedReport {
    /// Prefix for the names of runs that other reports also have.
    pub name: String,
    /// Its file, or another name for messages.
    pub file: String,
    /// The report.
    pub report: Report,
}
