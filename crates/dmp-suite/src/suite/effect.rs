//! The difference in metres of two versions over several logs.

use dmp_reduce::{Confidence, Median};
use serde::{Deserialize, Serialize};

/// The median over the logs of a difference between two versions, a − b: negative if a is better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectReport {
    /// The median, metres; null if no log has a difference.
    pub median_m: Option<f64>,
    /// Its interval, bounded by two of the logs' differences, metres; null with too few logs.
    pub interval_m: Option<[f64; 2]>,
    /// Number of logs with a difference.
    pub logs: usize,
}

impl EffectReport {
    pub(super) fn of(differences_m: impl Iterator<Item = Option<f64>>, confidence: Confidence) -> Self {
        let known: Vec<f64> = differences_m.flatten().filter(|m| m.is_finite()).collect();
        let median = Median::of(&known, confidence);
        Self {
            median_m: median.map(|median| median.value),
            interval_m: median.and_then(|median| median.interval),
            logs: known.len(),
        }
    }
}
