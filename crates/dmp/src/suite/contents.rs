//! The whole of a suite's report.

use serde::{Deserialize, Serialize};

use super::log::MissingReport;
use super::pair::SuitePairReport;

/// What was found of several versions on several logs. Serialised, it is the JSON of `dmp suite --json`: schema
/// `dmp-suite/1`, described in `docs/json.md`.
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
    /// The names of the logs that were scored, worst first: those where more versions lose against one that was named before
    /// them, and then those where they lose by more.
    pub worst_first: Vec<String>,
    /// What the verdicts over all logs promise together.
    pub promise: SuitePromiseReport,
    /// What a reader must know before believing any of it.
    pub warnings: Vec<String>,
}

impl SuiteReport {
    /// What `schema` says.
    pub const SCHEMA: &str = "dmp-suite/1";

    /// The comparison of two versions, whichever stands first in it.
    pub fn pair(&self, one: &str, other: &str) -> Option<&SuitePairReport> {
        self.pairs.iter().find(|pair| pair.is_of(one, other))
    }

    /// The log that is called so.
    pub fn log(&self, name: &str) -> Option<&SuiteLogReport> {
        self.logs.iter().find(|log| log.name == name)
    }

    /// Logs that were scored.
    pub fn scored(&self) -> impl Iterator<Item = &SuiteLogReport> {
        self.logs.iter().filter(|log| log.problem.is_none())
    }
}

/// A log of the suite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuiteLogReport {
    /// What it is called.
    pub name: String,
    /// The versions that were scored on it, best first.
    pub order: Vec<String>,
    /// The versions that were not.
    pub missing: Vec<MissingReport>,
    /// Scans of the log, and the way, metres; null where it was not scored.
    pub scans: Option<usize>,
    /// See [`Self::scans`].
    pub travel_m: Option<f64>,
    /// Whether part of the log is lost or damaged.
    pub damaged: bool,
    /// Why it was not scored; null where it was.
    pub problem: Option<String>,
    /// The file of its result, as `dmp score --json` prints it; null where there is none.
    pub result: Option<String>,
}

/// What the verdicts over all logs promise together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuitePromiseReport {
    /// Where versions are equal, no two of them are ranked apart in this share of suites.
    pub confidence: f64,
    /// How sure the interval of each median is, so that those of all pairs keep that.
    pub interval_confidence: f64,
}
