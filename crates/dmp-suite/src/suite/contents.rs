//! The contents of a suite's report.

use serde::{Deserialize, Serialize};

use super::log::MissingReport;
use super::pair::SuitePairReport;

/// The comparison of several versions on several logs. Serialised, it is the JSON of `dmp suite --json`:
/// schema `dmp-suite/1`, described in `docs/json.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuiteReport {
    /// Always `dmp-suite/1`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// The versions, in the order given.
    pub versions: Vec<String>,
    /// Every pair of versions over all logs, in the order of the versions.
    pub pairs: Vec<SuitePairReport>,
    /// The logs, in the order given.
    pub logs: Vec<SuiteLogReport>,
    /// The names of the scored logs, worst first: by the number of versions that lose against one named
    /// before them, then by how much they lose.
    pub worst_first: Vec<String>,
    /// The promise of the verdicts over all logs together.
    pub promise: SuitePromiseReport,
    /// Warnings that limit the results.
    pub warnings: Vec<String>,
}

impl SuiteReport {
    /// The value of `schema`.
    pub const SCHEMA: &str = "dmp-suite/1";

    /// The comparison of two versions, in either order.
    pub fn pair(&self, one: &str, other: &str) -> Option<&SuitePairReport> {
        self.pairs.iter().find(|pair| pair.is_of(one, other))
    }

    /// The log of this name.
    pub fn log(&self, name: &str) -> Option<&SuiteLogReport> {
        self.logs.iter().find(|log| log.name == name)
    }

    /// The scored logs.
    pub fn scored(&self) -> impl Iterator<Item = &SuiteLogReport> {
        self.logs.iter().filter(|log| log.problem.is_none())
    }
}

/// A log of the suite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuiteLogReport {
    /// Its name.
    pub name: String,
    /// The versions scored on it, best first.
    pub order: Vec<String>,
    /// The versions that were not scored.
    pub missing: Vec<MissingReport>,
    /// Number of scans of the log, and path length, metres; null if it was not scored.
    pub scans: Option<usize>,
    /// See [`Self::scans`].
    pub travel_m: Option<f64>,
    /// Whether part of the log is lost or damaged.
    pub damaged: bool,
    /// Why it was not scored; null if it was.
    pub problem: Option<String>,
    /// The file of its result, as `dmp score --json` prints it; null if there is none.
    pub result: Option<String>,
}

/// The promise of the verdicts over all logs together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuitePromiseReport {
    /// Among equal versions, no two are ranked apart in this share of suites.
    pub confidence: f64,
    /// Confidence of each median's interval, so that all intervals together keep `confidence`.
    pub interval_confidence: f64,
}
