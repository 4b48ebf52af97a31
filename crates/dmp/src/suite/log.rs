//! A log of a suite, as it was scored.

use serde::{Deserialize, Serialize};

use crate::report::Report;

/// A log of a suite, and what came of scoring all versions on it together.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteLog {
    /// What it is called.
    pub name: String,
    /// The report, whose runs are called like the versions; else why there is none.
    pub report: Result<Report, String>,
    /// Versions that have no run on it, or whose run is no part of the report, with why.
    pub missing: Vec<MissingReport>,
}

impl SuiteLog {
    /// Every version that is not compared on this log, those left out by the report among them.
    pub(super) fn all_missing(&self) -> Vec<MissingReport> {
        let left_out = self.report.iter().flat_map(|report| &report.left_out);
        let left_out = left_out.map(|run| MissingReport {
            version: run.name.clone(),
            reason: format!("excluded: {}", run.reason),
        });
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
