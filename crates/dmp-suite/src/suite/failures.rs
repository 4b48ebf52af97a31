//! What becomes of a version that has no score on a log.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::log::SuiteLog;

/// What becomes of a version that has no run on a log, or whose run is excluded, where another stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Failures {
    /// It is worse there: who fails, loses.
    #[default]
    Worse,
    /// The log is not counted for it.
    Skip,
}

impl FromStr for Failures {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "worse" => Ok(Self::Worse),
            "skip" => Ok(Self::Skip),
            _ => Err(format!("`{text}` is neither `worse` nor `skip`")),
        }
    }
}

/// A version that fails on a log on which the other one stands.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FailureReport {
    /// The log.
    pub log: String,
    /// The version that fails; the reason is in `missing` of the log.
    pub version: String,
}

impl Failures {
    /// The logs that count against one of two versions.
    pub(super) fn of(self, logs: &[SuiteLog], a: &str, b: &str) -> Vec<FailureReport> {
        let failure = |log: &SuiteLog| {
            let report = log.report.as_ref().ok().filter(|_| self == Self::Worse)?;
            let stands = |version: &str| report.runs.iter().any(|run| run.name == version);
            let version = match (stands(a), stands(b)) {
                (true, false) => b,
                (false, true) => a,
                _ => return None,
            };
            Some(FailureReport { log: log.name.clone(), version: version.to_owned() })
        };
        logs.iter().filter_map(failure).collect()
    }
}
