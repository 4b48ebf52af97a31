//! A scored log of a suite.

use serde::{Deserialize, Serialize};

use dmp_report::Report;

/// A log of a suite, and the result of scoring all versions on it together.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteLog {
    /// Its name.
    pub name: String,
    /// The report, whose runs have the names of the versions; else why there is none.
    pub report: Result<Report, String>,
    /// Versions without a run on it, or whose run is not in the report, with the reason.
    pub missing: Vec<MissingReport>,
}

impl SuiteLog {
    /// Every version that is not compared on this log, including those that the report excludes.
    pub(super) fn all_missing(&self) -> Vec<MissingReport> {
        let left_out = self.report.iter().flat_map(|report| &report.left_out);
        let left_out =
            left_out.map(|run| MissingReport { version: run.name.clone(), reason: run.reason.clone() });
        self.missing.iter().cloned().chain(left_out).collect()
    }
}

/// A version that is not compared on a log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissingReport {
    /// Its name.
    pub version: String,
    /// Why.
    pub reason: String,
}
