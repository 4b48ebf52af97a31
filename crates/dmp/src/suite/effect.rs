//! By how many metres two versions differ over several logs.

use dmp_reduce::{Confidence, Median};
use serde::{Deserialize, Serialize};

/// The median over the logs of a difference of two versions, a − b: negative where a is better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectReport {
    /// The median, metres; null where no log gives a difference.
    pub median_m: Option<f64>,
    /// Its interval, two of the logs' differences, metres; null where there are too few.
    pub interval_m: Option<[f64; 2]>,
    /// Logs that give a difference.
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
