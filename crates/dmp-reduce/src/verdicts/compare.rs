//! Two runs compared: at every scale, by the place guard, and what comes of it.

use super::guard::{GuardCheck, place_guard};
use super::scale_comparison::{Asked, ScaleComparison};
use super::verdict::{UndecidedReason, Verdict};
use crate::residual::{Basis, Scales};
use crate::sums::{FRAMES_NEEDED, GROUPS_NEEDED, Mean, PairTotals, REVISIT_NEEDED, RunSums, ScaleTotals};

/// Two runs compared on their common returns: those that both predict.
///
/// The mean difference of their truncated squares is looked at scale by scale, the largest first; the
/// first whose interval excludes 0 decides. Then the place guard asks whether the same run is better everywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The first run.
    pub a: usize,
    /// The second run.
    pub b: usize,
    /// By what the two are judged.
    pub basis: Basis,
    /// Returns that both runs predict.
    pub common_returns: u64,
    /// The scales in the order in which they are asked; all of them, also those after the one that
    /// decided.
    pub scales: Vec<ScaleComparison>,
    /// What the place guard found; empty where no scale decided.
    pub guard: Vec<GuardCheck>,
    /// What comes of it.
    pub verdict: Verdict,
}

impl Comparison {
    /// The same of two runs that are known to be one for practical purposes: nothing is decided between them.
    #[must_use]
    pub fn of_same(self) -> Self {
        Self { guard: Vec::new(), verdict: Verdict::Same, ..self }
    }

    /// The same with the revisit guard: undecided where the run that it speaks for comes back to places, by its own path, and
    /// hardly finds there what it saw before, while the other run does. `back` is the share of the scans with which a run comes
    /// back; `sums` are its own. Both are asked by its number.
    #[must_use]
    pub fn with_revisits<'a>(self, sums: impl Fn(usize) -> &'a RunSums, back: impl Fn(usize) -> f64) -> Self {
        let (Verdict::Better { which, .. } | Verdict::Mixed { which, .. }) = self.verdict else {
            return self;
        };
        let [own, other] = [which, self.a + self.b - which].map(sums);
        let share = |sums: &RunSums| sums.coverage_revisit().unwrap_or(0.0);
        let is_less = MOST_LOST * (own.revisited() as f64) < other.revisited() as f64;
        if !is_less || share(other) < REVISIT_NEEDED || MOST_LOST * share(own) >= back(which) {
            return self;
        }
        let reason = UndecidedReason::VisitsApart { revisited: own.revisited(), other: other.revisited() };
        Self { verdict: Verdict::Undecided { reason }, ..self }
    }
}

/// A better run must find one in this many of the returns with which it comes back on what it saw before.
const MOST_LOST: f64 = 2.0;

/// A better run must predict more than one in this many of the returns that the other predicts.
const LEAST_COVERED: f64 = 2.0;

/// Compares runs `a` and `b` by the sums of their pair.
///
/// `predicted` are the returns that each has in its sums.
pub(crate) fn compare(
    [a, b]: [usize; 2],
    predicted: [u64; 2],
    pair: &PairTotals,
    asked: Asked,
) -> Comparison {
    let (basis, lengths) = (pair.basis, asked.scales);
    let all: Vec<_> = pair
        .scales
        .iter()
        .zip(basis.scales_m(lengths))
        .map(|(s, &scale_m)| s.compare(scale_m, asked))
        .collect();
    let scales = all[all.len() - basis.cascade_m(lengths).len()..].to_vec();
    let common_returns = pair.scales[0].difference.total().returns;
    let mut comparison = Comparison {
        a,
        b,
        basis,
        common_returns,
        scales,
        guard: Vec::new(),
        verdict: Verdict::Undecided { reason: UndecidedReason::NoDifference },
    };
    let decided =
        comparison.scales.iter().find(|scale| scale.decides()).and_then(|s| Some((s.scale_m, s.difference?)));
    if let Some((decided_at_m, difference)) = decided {
        let a_better = difference.value_m2 < 0.0;
        comparison.guard = place_guard(pair, &all, a_better, asked.frames);
        let which = if a_better { a } else { b };
        let [own, other] = if a_better { predicted } else { [predicted[1], predicted[0]] };
        comparison.verdict = match comparison.guard.iter().find(|check| check.tripped) {
            _ if LEAST_COVERED * (own as f64) < other as f64 => {
                Verdict::Undecided { reason: UndecidedReason::LessCovered { predicted: own, other } }
            }
            None => Verdict::Better { which, decided_at_m, returns: common_returns },
            Some(check) => Verdict::Mixed {
                which,
                decided_at_m,
                opposed_at_m: check.scale_m,
                places: check.against.clone(),
                returns: common_returns,
            },
        };
    } else {
        let reason = why_undecided(pair, &comparison.scales);
        comparison.verdict = Verdict::Undecided { reason };
    }
    comparison
}

/// How likely the scale that speaks most for a difference would do so were there none, and all scales that are looked at
/// taken together: no more than their number times that (Bonferroni's inequality).
pub(crate) fn chance(pair: &PairTotals, scales: Scales) -> f64 {
    let asked = pair.basis.cascade_m(scales).len();
    let looked_at = &pair.scales[pair.scales.len() - asked..];
    let of_scale = |scale: &ScaleTotals| scale.difference.mean().map_or(1.0, Mean::chance);
    asked as f64 * looked_at.iter().map(of_scale).fold(1.0, f64::min)
}

fn why_undecided(pair: &PairTotals, scales: &[ScaleComparison]) -> UndecidedReason {
    let difference = &pair.scales[0].difference;
    let (frames, groups) = (difference.frames(), difference.groups());
    if frames == 0 {
        UndecidedReason::NoCommonReturns
    } else if frames < FRAMES_NEEDED {
        UndecidedReason::TooFewFrames { frames }
    } else if groups < GROUPS_NEEDED {
        UndecidedReason::FewSurfaces { groups }
    } else if scales.iter().all(|scale| scale.interval().is_none()) {
        UndecidedReason::OneStretch
    } else {
        UndecidedReason::NoDifference
    }
}
