//! The place guard: whether a run that is better as a whole is better everywhere.

use super::scale_comparison::ScaleComparison;
use crate::numbers::Total;
use crate::residual::Basis;
use crate::sums::{Frames, PairTotals, place_count};

/// A verdict becomes mixed where the opposition at a scale is above what is tolerated, and above a share
/// of the support.
struct Guard {
    /// Which of [`Basis::scales_m`].
    scale: usize,
    tolerated: f64,
    of_support: f64,
}

/// The place guard: at 30 and 2 m for a LiDAR, or 5 and 2 m for a pair judged by `R_near`.
fn guards(basis: Basis) -> [Guard; 2] {
    let (far, middle) = match basis {
        Basis::CrossValidated => (0, 2),
        Basis::Near => (0, 1),
    };
    [
        Guard { scale: far, tolerated: 0.10, of_support: 0.05 },
        Guard { scale: middle, tolerated: 0.02, of_support: 0.25 },
    ]
}

/// One scale of the place guard. The frames are cut into ten consecutive batches; in each the mean
/// difference is put in relation to the runs' level, the mean of their two means.
#[derive(Debug, Clone, PartialEq)]
pub struct GuardCheck {
    /// The truncation τ, metres.
    pub scale_m: f64,
    /// Mean over the batches of the support for the run that is better overall.
    pub support: f64,
    /// Mean over the batches of what speaks against it.
    pub opposition: f64,
    /// Whether that makes the verdict mixed.
    pub tripped: bool,
    /// The stretches where more speaks against it than the guard tolerates on average.
    pub against: Vec<Stretch>,
}

/// A stretch of the scored frames, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stretch {
    /// Its first frame, as the ordinal it was added under.
    pub first: u64,
    /// Its last.
    pub last: u64,
}

/// Looks at every place, where `a_better` is the verdict of the whole; `scales` are all of the pair's.
pub(crate) fn place_guard(
    pair: &PairTotals,
    scales: &[ScaleComparison],
    a_better: bool,
    frames: Frames,
) -> Vec<GuardCheck> {
    let check =
        |guard: &Guard| guard.check(&pair.scales[guard.scale].places, &scales[guard.scale], a_better, frames);
    guards(pair.basis).iter().map(check).collect()
}

impl Guard {
    fn check(&self, places: &[Total], scale: &ScaleComparison, a_better: bool, frames: Frames) -> GuardCheck {
        let level = 0.5 * (scale.mean_a_m2.unwrap_or(0.0) + scale.mean_b_m2.unwrap_or(0.0));
        let parts = place_count(frames);
        let (mut support, mut opposition, mut batches) = (0.0, 0.0, 0.0);
        let mut against: Vec<Stretch> = Vec::new();
        for (part, place) in (0..parts).zip(places) {
            let Some(mean_m2) = place.mean_m2() else { continue };
            batches += 1.0;
            // At a level of 0 both runs are without fault, and neither has support.
            let relative = if level > 0.0 { mean_m2 / level } else { 0.0 };
            let for_it = if a_better { -relative } else { relative };
            support += for_it.max(0.0);
            opposition += (-for_it).max(0.0);
            if -for_it > self.tolerated {
                extend(&mut against, frames.part(part, parts));
            }
        }
        let (support, opposition) = (support / batches, opposition / batches);
        // Where the mean is above the tolerated, so is at least one batch, up to rounding.
        let above = opposition > self.tolerated && opposition > self.of_support * support;
        let tripped = above && !against.is_empty();
        GuardCheck { scale_m: scale.scale_m, support, opposition, tripped, against }
    }
}

/// Appends a stretch, joined to the last one where it follows on it.
fn extend(places: &mut Vec<Stretch>, (first, last): (u64, u64)) {
    match places.last_mut() {
        Some(before) if before.last + 1 == first => before.last = last,
        _ => places.push(Stretch { first, last }),
    }
}
