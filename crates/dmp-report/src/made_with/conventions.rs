//! When and where a run's poses hold, in a report.

use serde::{Deserialize, Serialize};

/// What the scans say of a run's clock and mounting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConventionsReport {
    /// Share of the returns looked at that meet those of another scan near by, as the run was given; null where none has a
    /// pose.
    pub together: Option<f64>,
    /// Each estimated number; empty where the scans do not determine it.
    pub estimates: Vec<EstimateReport>,
    /// How thick surfaces are that several scans see, metres, as the run was given (read as it is meant).
    pub thickness_m: Option<f64>,
    /// The same with the fixes.
    pub thickness_mended_m: Option<f64>,
    /// Why the scans do not determine clock and extrinsic though they have surfaces in common; null where they do.
    pub silence: Option<String>,
    /// The options that fix what is off.
    pub mends: Vec<String>,
    /// Whether that was done.
    pub mended: bool,
    /// Whether the run may be misread, or that of another log: then its numbers may say nothing of its map.
    pub doubtful: bool,
}

/// A number that was looked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimateReport {
    /// `time` (seconds), `sweep` (1 where the returns' times are true), `roll`, `pitch`, `yaw` (radians), `x`, `y`, `z`
    /// (metres).
    pub axis: String,
    /// What it is: what is to be added to what was given, of the time to the log's stamps, of the mounting in the sensor's
    /// own axes; of the sweep, which part of the times is true.
    pub value: f64,
    /// Half of its interval, at 99.9 %.
    pub half: f64,
    /// Whether the scans show it.
    pub seen: bool,
    /// Whether it is off beyond its interval, and by enough to be reported.
    pub off: bool,
    /// Whether fixing it makes surfaces thinner, by enough to be worth it, and fixing the opposite does not.
    pub pays: bool,
}

/// A run that is no part of what is compared.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeftOutReport {
    /// Its name.
    pub name: String,
    /// Why, in a sentence.
    pub reason: String,
}
