//! Two runs compared at one scale.

use crate::numbers::Confidence;
use crate::residual::Scales;
use crate::sums::{Estimate, Frames, Interval, ScaleTotals};

/// Two runs at one scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleComparison {
    /// The truncation τ, metres.
    pub scale_m: f64,
    /// The first run's mean over the common returns, square metres; `None` where there are none.
    pub mean_a_m2: Option<f64>,
    /// The second run's.
    pub mean_b_m2: Option<f64>,
    /// Mean of a minus b with its interval: negative where a is better.
    pub difference: Option<Estimate>,
}

impl ScaleComparison {
    /// The interval, where there is one.
    pub fn interval(&self) -> Option<Interval> {
        self.difference.and_then(|difference| difference.interval)
    }

    pub(crate) fn decides(&self) -> bool {
        self.interval().is_some_and(|interval| interval.excludes_zero())
    }
}

/// What a pair is compared with beside its own sums.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) scales: Scales,
    /// How many frames there are.
    pub(crate) frames: Frames,
    /// How sure each interval is to be.
    pub(crate) confidence: Confidence,
}

impl ScaleTotals {
    pub(crate) fn compare(&self, scale_m: f64, asked: Asked) -> ScaleComparison {
        let difference = self.difference.mean().map(|mean| mean.within(asked.confidence));
        let returns = self.difference.total().returns;
        let [mean_a_m2, mean_b_m2] = [self.a, self.b].map(|sum| sum.mean_m2(returns));
        ScaleComparison { scale_m, mean_a_m2, mean_b_m2, difference }
    }
}
