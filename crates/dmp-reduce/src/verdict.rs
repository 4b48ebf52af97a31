use crate::Basis;
use crate::guard::{GuardCheck, Place, place_guard};
use crate::pair::{PairTotals, ScaleTotals};
use crate::ratio::{Asked, Estimate, FRAMES_NEEDED, Interval};
use crate::scales::{Reach, Scales};

/// Two runs compared on their common returns: those that both predict.
///
/// The mean difference of their truncated squares is looked at scale by scale, the largest first; the
/// first whose interval excludes 0 decides. That is up to four looks, at 99 % each if nothing else is
/// asked for. Then the place guard asks whether the same run is better everywhere.
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
    /// Where a sample decides nothing: about how many frames would. Never more than there are; as rough as the
    /// difference that the sample shows.
    pub frames_needed: Option<u64>,
}

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

    fn decides(&self) -> bool {
        self.interval().is_some_and(|interval| interval.excludes_zero())
    }
}

/// Which of two runs is better, if it can be said.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// One run is better.
    Better {
        /// Which.
        which: usize,
        /// The scale that decided, metres.
        decided_at_m: f64,
        /// Common returns.
        returns: u64,
    },
    /// One run is better on the whole, the other in some places.
    Mixed {
        /// Which is better on the whole.
        which: usize,
        /// The scale at which it is, metres.
        decided_at_m: f64,
        /// The scale at which the places speak against it, metres.
        opposed_at_m: f64,
        /// Where the other run is better.
        places: Vec<Place>,
        /// Common returns.
        returns: u64,
    },
    /// Nothing can be said.
    Undecided {
        /// Why.
        reason: UndecidedReason,
    },
}

/// Why a pair is not decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UndecidedReason {
    /// No return is predicted by both runs.
    #[error("the two runs predict no return in common")]
    NoCommonReturns,
    /// The differences are exactly 0, at every scale in every frame.
    #[error("the two runs predict every common return alike")]
    Alike,
    /// Fewer than four frames have common returns.
    #[error("only {frames} frames have common returns, {FRAMES_NEEDED} are needed")]
    TooFewFrames {
        /// Frames with common returns.
        frames: u64,
    },
    /// All common returns lie in one batch of frames, whose scatter nobody knows.
    #[error("all common returns lie in one short stretch of the log")]
    OneStretch,
    /// The run that the common returns speak for predicts less than half of what the other does. A map in pieces that
    /// do not meet agrees with itself wherever they are, and has little in common with any other.
    #[error(
        "the run that the common returns speak for predicts {predicted} returns, the other {other}: a map in pieces agrees with itself"
    )]
    LessCovered {
        /// Returns that it predicts from other parts of the drive.
        predicted: u64,
        /// Those that the other does.
        other: u64,
    },
    /// Every interval contains 0.
    #[error("no scale shows a difference outside its interval")]
    NoDifference,
}

impl Verdict {
    /// The verdict in plain words, frames named by the ordinals they were added under.
    pub fn reason(&self, scales: Scales) -> String {
        self.reason_with(scales, |ordinal| ordinal)
    }

    /// The verdict in plain words. `frame_of` gives the frame's number for an ordinal: of a sample the
    /// two differ.
    pub fn reason_with(&self, scales: Scales, frame_of: impl Fn(u64) -> u64) -> String {
        match self {
            Self::Better { decided_at_m, returns, .. } => {
                format!("better {} ({returns} common returns)", reach(*decided_at_m, scales))
            }
            Self::Mixed { decided_at_m, opposed_at_m, places, returns, .. } => {
                let named = |p: &Place| match (frame_of(p.first), frame_of(p.last)) {
                    (first, last) if first == last => format!("{first}"),
                    (first, last) => format!("{first}–{last}"),
                };
                let places: Vec<_> = places.iter().map(named).collect();
                format!(
                    "better on the whole, {}, but worse in frames {} at {opposed_at_m} m ({returns} common returns)",
                    reach(*decided_at_m, scales),
                    places.join(", "),
                )
            }
            Self::Undecided { reason } => format!("undecided: {reason}"),
        }
    }
}

/// What the scale that decided says.
fn reach(scale_m: f64, scales: Scales) -> String {
    let middle = if scales == Scales::Drive { "metre" } else { "decimetre" };
    match scales.reach(scale_m) {
        Reach::Global => format!("globally: decided at the {scale_m} m scale"),
        Reach::Middle => format!("at the {middle} scale: decided at {scale_m} m, undecided above"),
        Reach::Local => format!("locally: decided at {scale_m} m, undecided above"),
        Reach::Fine => format!("only at the centimetre scale: decided at {scale_m} m, undecided above"),
    }
}

/// A run that is to be better must predict more than one in so many of the returns that the other does.
const LEAST_COVERED: f64 = 2.0;

/// Compares runs `a` and `b` by the sums of their pair.
///
/// `predicted` are the returns that each has in its sums.
pub(crate) fn compare(
    [a, b]: [usize; 2],
    predicted: [u64; 2],
    pair: &PairTotals,
    scales: Scales,
    asked: Asked,
) -> Comparison {
    let (basis, lengths) = (pair.basis, scales);
    let all: Vec<_> = pair
        .scales
        .iter()
        .zip(basis.scales_m(lengths))
        .map(|(s, &scale_m)| s.compare(scale_m, asked))
        .collect();
    let scales = all[all.len() - basis.cascade_m(lengths).len()..].to_vec();
    let common_returns = pair.scales[0].difference.total().returns;
    let decided = scales.iter().find(|scale| scale.decides()).and_then(|s| Some((s.scale_m, s.difference?)));
    let (guard, verdict) = match decided {
        None => (Vec::new(), Verdict::Undecided { reason: why_undecided(pair, &scales) }),
        Some((decided_at_m, difference)) => {
            let a_better = difference.value_m2 < 0.0;
            let guard = place_guard(pair, &all, a_better, asked.frames);
            let which = if a_better { a } else { b };
            let [own, other] = if a_better { predicted } else { [predicted[1], predicted[0]] };
            let verdict = match guard.iter().find(|check| check.tripped) {
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
            (guard, verdict)
        }
    };
    let frames_needed = match verdict {
        Verdict::Undecided { reason: UndecidedReason::NoDifference } => frames_needed(&scales, asked),
        _ => None,
    };
    Comparison { a, b, basis, common_returns, scales, guard, verdict, frames_needed }
}

fn why_undecided(pair: &PairTotals, scales: &[ScaleComparison]) -> UndecidedReason {
    let frames = pair.scales[0].difference.frames();
    if frames == 0 {
        UndecidedReason::NoCommonReturns
    } else if pair.scales.iter().all(|scale| scale.difference.is_zero_everywhere()) {
        UndecidedReason::Alike
    } else if frames < FRAMES_NEEDED {
        UndecidedReason::TooFewFrames { frames }
    } else if scales.iter().all(|scale| scale.interval().is_none()) {
        UndecidedReason::OneStretch
    } else {
        UndecidedReason::NoDifference
    }
}

/// About how many of `n` frames would decide, were the difference and the scatter what the `k` of the sample
/// show: the half width h of the interval goes with √(1/k − 1/n), and is to become the difference d.
fn frames_needed(scales: &[ScaleComparison], asked: Asked) -> Option<u64> {
    if !asked.is_sample() {
        return None;
    }
    let (scored, all) = (asked.scored as f64, asked.frames.0 as f64);
    let needed = |scale: &ScaleComparison| {
        let (difference_m2, interval) = (scale.difference?.value_m2, scale.interval()?);
        let shrunk = difference_m2 / (0.5 * (interval.high_m2 - interval.low_m2));
        let one_by = shrunk * shrunk * (1.0 / scored - 1.0 / all) + 1.0 / all;
        // A sample that shows no difference at all says nothing of how many would.
        (difference_m2 != 0.0 && one_by.is_finite())
            .then(|| (1.0 / one_by).ceil().clamp(scored + 1.0, all) as u64)
    };
    scales.iter().filter_map(needed).min()
}

impl ScaleTotals {
    fn compare(&self, scale_m: f64, asked: Asked) -> ScaleComparison {
        let difference = self.difference.estimate(asked);
        let returns = self.difference.total().returns;
        ScaleComparison {
            scale_m,
            mean_a_m2: self.a.mean_m2(returns),
            mean_b_m2: self.b.mean_m2(returns),
            difference,
        }
    }
}
