//! Which of two runs is better, and why, in words.

use super::guard::Stretch;
use crate::residual::{Reach, Scales};
use crate::sums::{FRAMES_NEEDED, GROUPS_NEEDED};
use dmp_lengths::thousands;

/// Which of two runs is better, if it can be said. Runs go by their index, lengths are metres.
///
/// ```
/// use dmp_reduce::{Scales, Verdict};
///
/// let verdict = Verdict::Better { which: 0, decided_at_m: 2.0, returns: 900 };
/// assert_eq!(
///     verdict.reason(Scales::Drive),
///     "better at the metre scale: decided at 2 m, undecided above (900 common returns)"
/// );
/// ```
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
        places: Vec<Stretch>,
        /// Common returns.
        returns: u64,
    },
    /// The two are known to be one, for practical purposes: their poses say so, see [`Comparison::of_same`](crate::Comparison::of_same).
    Same,
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
    /// Fewer than four frames have common returns.
    #[error("only {frames} frames have common returns, {FRAMES_NEEDED} are needed")]
    TooFewFrames {
        /// Frames with common returns.
        frames: u64,
    },
    /// All common returns lie in one stretch of frames, whose scatter is unknown.
    #[error("all common returns lie in one short stretch of the log")]
    OneStretch,
    /// All common returns lie on few pieces of surface, whose scatter is unknown.
    #[error("all common returns lie on {groups} pieces of surface, {GROUPS_NEEDED} are needed")]
    FewSurfaces {
        /// How many.
        groups: u64,
    },
    /// The run that is better on the common returns predicts less than half of what the other does. A map in pieces that
    /// do not meet agrees with itself wherever they are, and has little in common with any other.
    #[error(
        "the run that the common returns speak for predicts {} returns, the other {}: a map in pieces agrees with itself",
        thousands(.predicted),
        thousands(.other)
    )]
    LessCovered {
        /// Returns that it predicts from other parts of the drive.
        predicted: u64,
        /// Those that the other does.
        other: u64,
    },
    /// The run that is better on the common returns comes back to places and hardly finds there what it saw before. Visits
    /// that drift puts too far apart to meet do not contradict each other.
    #[error(
        "the run that the common returns speak for finds {} of its returns on what another visit saw, the other {}: \
         visits that are put too far apart to meet do not contradict each other",
        thousands(.revisited),
        thousands(.other)
    )]
    VisitsApart {
        /// Returns that it finds on what another visit saw.
        revisited: u64,
        /// Those that the other does.
        other: u64,
    },
    /// Every interval contains 0.
    #[error("the residuals differ by no more than may be chance")]
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
                let named = |p: &Stretch| match (frame_of(p.first), frame_of(p.last)) {
                    (first, last) if first == last => format!("{first}"),
                    (first, last) => format!("{first}–{last}"),
                };
                let places: Vec<_> = places.iter().map(named).collect();
                format!(
                    "better on the whole, {}, but worse in scans {} at {opposed_at_m} m ({returns} common returns)",
                    reach(*decided_at_m, scales),
                    places.join(", "),
                )
            }
            Self::Same => "the same".to_owned(),
            Self::Undecided { reason } => format!("undecided: {reason}"),
        }
    }
}

/// What the scale that decided says.
fn reach(scale_m: f64, scales: Scales) -> String {
    match scales.lengths().reach(scale_m) {
        Reach::Global => format!("globally: decided at the {scale_m} m scale"),
        Reach::Middle(unit) => format!("at the {unit} scale: decided at {scale_m} m, undecided above"),
        Reach::Local(_) => format!("locally: decided at {scale_m} m, undecided above"),
        Reach::Fine(unit) => format!("only at the {unit} scale: decided at {scale_m} m, undecided above"),
    }
}
