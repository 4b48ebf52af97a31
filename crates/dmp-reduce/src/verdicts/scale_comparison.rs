//! Two runs compared at one scale.

use super::same::Margin;
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
    /// How far apart the two may be at most, as their root mean squares, metres: what the interval still allows. `None`
    /// where there is no interval.
    pub apart_at_most_m: Option<f64>,
    /// How far apart they may be and still count as the same, metres.
    pub margin_m: Option<f64>,
}

impl ScaleComparison {
    /// The interval, where there is one.
    pub fn interval(&self) -> Option<Interval> {
        self.difference.and_then(|difference| difference.interval)
    }

    pub(crate) fn decides(&self) -> bool {
        self.interval().is_some_and(|interval| interval.excludes_zero())
    }

    /// Whether no difference that matters is left possible.
    pub fn is_same(&self) -> bool {
        self.apart_at_most_m.zip(self.margin_m).is_some_and(|(apart_m, margin_m)| apart_m <= margin_m)
    }
}

/// What a pair is compared with beside its own sums.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) scales: Scales,
    /// How many frames were scored, of how many.
    pub(crate) scored: u64,
    pub(crate) frames: Frames,
    /// How sure each interval is to be.
    pub(crate) confidence: Confidence,
    pub(crate) margin: Margin,
}

impl ScaleTotals {
    pub(crate) fn compare(&self, scale_m: f64, asked: Asked) -> ScaleComparison {
        let difference = self.difference.mean().map(|mean| mean.within(asked.confidence));
        let returns = self.difference.total().returns;
        let [mean_a_m2, mean_b_m2] = [self.a, self.b].map(|sum| sum.mean_m2(returns));
        let better_m2 = mean_a_m2.zip(mean_b_m2).map(|(a, b)| a.min(b));
        let interval = difference.and_then(|difference| difference.interval);
        ScaleComparison {
            scale_m,
            mean_a_m2,
            mean_b_m2,
            difference,
            apart_at_most_m: better_m2.zip(interval).map(|(better_m2, interval)| {
                let most_m2 = interval.high_m2.abs().max(interval.low_m2.abs());
                (better_m2 + most_m2).sqrt() - better_m2.sqrt()
            }),
            margin_m: better_m2.map(|better_m2| asked.margin.metres(better_m2.sqrt())),
        }
    }
}
