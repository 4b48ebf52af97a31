//! What cannot be simulated.

use dmp_sensor::{PoseGraphError, TrajectoryError};

use crate::route::Route;
use dmp_lengths::LoopLengths;

/// Why a simulation cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A number is outside its sensible range.
    #[error("{what} must be {expected}, not {got}")]
    OutOfRange {
        /// The quantity, with its unit.
        what: &'static str,
        /// What would be accepted.
        expected: &'static str,
        /// What was given.
        got: f64,
    },
    /// No drift reaches the absolute trajectory error asked for.
    #[error("no drift of this run reaches an ATE of {asked_m} m: the largest found is {largest_m:.3} m")]
    DriftNotReached {
        /// The error asked for, metres.
        asked_m: f64,
        /// The largest error that was found, metres.
        largest_m: f64,
    },
    /// A false loop needs two places of the run that are so far apart.
    #[error("no two places of the run are {asked_m} m apart: the farthest are {largest_m:.1} m")]
    NoSuchPlaces {
        /// The distance asked for, metres.
        asked_m: f64,
        /// The largest distance between two of its places, metres.
        largest_m: f64,
    },
    /// Streets are driven through, a tunnel straight, and a campus is walked over.
    #[error(
        "no route {route:?} leads through such a place: a campus is walked over, a tunnel driven straight"
    )]
    OtherPlace {
        /// The route asked for.
        route: Route,
    },
    /// An error that grows with the distance travelled needs motion.
    #[error("the run does not move, so {what} has no meaning for it")]
    NoTravel {
        /// The error asked for.
        what: &'static str,
    },
    /// Keyframes have stamps.
    #[error("the trajectory has no stamps, which keyframes need")]
    NoStamps,
    /// There is nothing to make keyframes of.
    #[error("there are no instants to make keyframes of")]
    NoInstants,
    /// A keyframe needs a true pose.
    #[error("the trajectory has no pose at the stamp {stamp_ns} ns")]
    NoPose {
        /// The instant, nanoseconds.
        stamp_ns: i64,
    },
    /// True loops need places that the drive comes back to.
    #[error(
        "{asked} true and near loops need as many keyframes within {} m of a place that was passed more than {} m of travel \
         before, and the path has {found}", lengths.same_place_m, lengths.between_m
    )]
    TooFewRevisits {
        /// The loops asked for.
        asked: usize,
        /// The keyframes that are at a place seen before.
        found: usize,
        /// What counts as one place.
        lengths: LoopLengths,
    },
    /// False loops need places that are not one.
    #[error(
        "{asked} false loops need as many pairs of keyframes more than {} m from each other with more than {} m \
         of travel between them, and only {found} were found", lengths.other_place_m, lengths.between_m
    )]
    TooFewPlaces {
        /// The loops asked for.
        asked: usize,
        /// The pairs that were found.
        found: usize,
        /// What counts as another place.
        lengths: LoopLengths,
    },
    /// The poses make no graph.
    #[error(transparent)]
    Graph(#[from] PoseGraphError),
    /// The poses make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

/// Refuses a number that is not what it must be.
pub(crate) fn require(
    ok: bool,
    what: &'static str,
    expected: &'static str,
    got: f64,
) -> Result<(), SimError> {
    if ok { Ok(()) } else { Err(SimError::OutOfRange { what, expected, got }) }
}
