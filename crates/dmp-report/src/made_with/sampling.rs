//! How much of the log was scored, in a report.

use serde::{Deserialize, Serialize};

/// How much of the log was scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingReport {
    /// Scans scored.
    pub frames_scored: u64,
    /// Seed of the draws; null where all scans were scored and all returns cast.
    pub seed: Option<u64>,
    /// Of so many consecutive returns of a scored scan one was cast; 1: every one.
    #[serde(default = "every_one")]
    pub returns_one_in: usize,
    /// Of a quick score, what it took; null of others.
    #[serde(default)]
    pub quick: Option<QuickReport>,
}

/// What a quick score took: it scores more scans from look to look, until all pairs are decided.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuickReport {
    /// The look that the report is of, from 1.
    pub look: u32,
    /// How many there are, which share the error rate.
    pub looks: u32,
    /// Bytes of the log in which the scans of this look lie.
    pub bytes: u64,
}

/// Of reports without the field.
fn every_one() -> usize {
    1
}
