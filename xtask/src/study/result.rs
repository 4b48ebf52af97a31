//! What comes of one drive under one setting, as it is kept between runs of the study.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::consistency::Inconsistency;

/// One drive, all estimates of it, one setting.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct DriveResult {
    pub(super) drive: String,
    pub(super) held_out: bool,
    pub(super) setting: String,
    pub(super) voxel_m: f64,
    pub(super) segment_m: Option<f64>,
    pub(super) segments: usize,
    pub(super) travel_m: f64,
    pub(super) frames: usize,
    pub(super) returns: u64,
    /// How sure each interval of a difference was, so that all verdicts are as sure as 99 % together.
    pub(super) interval_confidence: f64,
    /// Pairs of sightings behind each definition of the inconsistency.
    pub(super) sightings: BTreeMap<String, u64>,
    pub(super) seconds: f64,
    pub(super) runs: Vec<RunResult>,
    pub(super) pairs: Vec<PairResult>,
}

/// One estimate. The first of a drive is the truth.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct RunResult {
    pub(super) name: String,
    pub(super) kind: String,
    /// Larger is worse, all of them: `ATE`, `RPE`, `SMD` in metres.
    pub(super) truth: BTreeMap<String, f64>,
    /// How far apart sightings of one place lie, by definition.
    pub(super) inconsistency: BTreeMap<String, Inconsistency>,
    /// Every score, lower is better; `None` where it is not defined.
    pub(super) scores: BTreeMap<String, Option<f64>>,
    /// Shares that are not scores: coverage, revisit coverage, misses.
    pub(super) shares: BTreeMap<String, Option<f64>>,
}

/// Two estimates, by index.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct PairResult {
    pub(super) a: usize,
    pub(super) b: usize,
    /// What `dmp score` says.
    pub(super) verdict: Said,
    /// The scale that decided, metres.
    pub(super) decided_at_m: Option<f64>,
    /// Whether the command calls the two the same.
    pub(super) is_same: bool,
    /// Which comes back better by drift, as the command says; nothing where it was not measured.
    pub(super) drift: Said,
    /// Returns that each of the two predicts from other parts of the drive.
    pub(super) predicted: [f64; 2],
    /// Mean differences a − b of single scores, and their errors.
    pub(super) singles: BTreeMap<String, Difference>,
    /// The same scores over [`super::interval::BATCHES`] consecutive parts of the frames.
    pub(super) batches: BTreeMap<String, Vec<Batch>>,
}

/// Two runs in a part of the frames.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Batch {
    /// Sum of the differences a − b.
    pub(super) difference_m2: f64,
    /// Sum over both runs.
    pub(super) level_m2: f64,
    pub(super) returns: f64,
}

/// A mean difference.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Difference {
    pub(super) value_m2: f64,
    /// Its standard error, and how many degrees of freedom it is known with.
    pub(super) error_m2: Option<f64>,
    pub(super) degrees: u64,
}

/// A verdict over two estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Said {
    A,
    B,
    /// Better on the whole, worse at places; true where the first is better on the whole.
    Mixed(bool),
    Nothing,
}

/// Name of `R_cv(t)` over the returns with zc in both runs.
pub(super) fn common_cv(t: f64) -> String {
    format!("R_cv({t}) common")
}
