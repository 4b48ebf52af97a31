//! The results of one drive, as they are saved between runs of the study.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One drive with all its estimates.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct DriveResult {
    pub(super) drive: String,
    pub(super) held_out: bool,
    pub(super) seconds: f64,
    pub(super) runs: Vec<RunResult>,
    pub(super) pairs: Vec<PairResult>,
}

/// One estimate. The first of a drive is the truth.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct RunResult {
    pub(super) name: String,
    pub(super) kind: String,
    /// Lower is better: `ATE`, `RPE`, `SMD` in metres.
    pub(super) truth: BTreeMap<String, f64>,
    /// The mean distance between two sightings of one true place, metres: from any two frames, and from independent
    /// segments only.
    pub(super) inconsistency_m: [Option<f64>; 2],
    /// Every score, lower is better; `None` where it is not defined.
    pub(super) scores: BTreeMap<String, Option<f64>>,
    pub(super) coverage: Option<f64>,
    pub(super) coverage_revisit: Option<f64>,
}

/// Two estimates, by index.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct PairResult {
    pub(super) a: usize,
    pub(super) b: usize,
    /// The verdict of `dmp score`.
    pub(super) verdict: Said,
    /// The scale that decided, metres.
    pub(super) decided_at_m: Option<f64>,
    /// The comparison of drift that `dmp score` prints.
    pub(super) drift: Said,
    /// Returns that each of the two predicts from other parts of the drive.
    pub(super) predicted: [f64; 2],
    /// The share of its returns that each finds on what another visit saw, and of the scans with which it comes back.
    pub(super) revisited: [f64; 2],
    pub(super) back: [f64; 2],
    /// Mean differences a − b of single scores, and their errors.
    pub(super) singles: BTreeMap<String, Difference>,
    /// The same scores over [`super::interval::batch_count`] consecutive parts of the frames.
    pub(super) batches: BTreeMap<String, Vec<Both>>,
}

/// Two runs over the returns that both predict.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Both {
    /// Sum of the differences a − b.
    pub(super) difference_m2: f64,
    /// Sum over both runs.
    pub(super) level_m2: f64,
    pub(super) returns: f64,
}

impl Both {
    pub(super) fn add(&mut self, a_m2: f64, b_m2: f64) {
        self.merge(&Self { difference_m2: a_m2 - b_m2, level_m2: a_m2 + b_m2, returns: 1.0 });
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.difference_m2 += other.difference_m2;
        self.level_m2 += other.level_m2;
        self.returns += other.returns;
    }
}

/// A mean difference.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Difference {
    pub(super) value_m2: f64,
    /// Its standard error.
    pub(super) error_m2: Option<f64>,
    /// The degrees of freedom of that error.
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
