//! Why two trajectories cannot be compared.

use super::{DeltaUnit, ErrorUnit};
use dmp_lengths::thousands;

/// Why two trajectories cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// There is no pose at all.
    #[error("a trajectory has no poses")]
    Empty,
    /// Stamps and poses do not belong together.
    #[error("{} stamps for {} poses", thousands(.stamps), thousands(.poses))]
    Stamps {
        /// Number of stamps.
        stamps: usize,
        /// Number of poses.
        poses: usize,
    },
    /// Poses can be associated by stamps or by lines, not by both.
    #[error("one trajectory has stamps and the other has none: they cannot be associated")]
    OneWithoutStamps,
    /// Without stamps the n-th pose belongs to the n-th.
    #[error(
        "{} poses in the reference, {} in the estimate: without stamps they must be as many",
        thousands(.reference),
        thousands(.estimate)
    )]
    Lengths {
        /// Poses of the reference.
        reference: usize,
        /// Poses of the estimate.
        estimate: usize,
    },
    /// No two stamps are near enough.
    #[error(
        "no stamps of reference and estimate within {max_diff_s} s of each other (time offset {offset_s} s)"
    )]
    NoMatches {
        /// The largest difference allowed, seconds.
        max_diff_s: f64,
        /// What was added to the estimate's stamps, seconds.
        offset_s: f64,
    },
    /// The time asked for is empty.
    #[error("the start {start_s} s is after the end {end_s} s")]
    StartAfterEnd {
        /// Start, seconds.
        start_s: f64,
        /// End, seconds.
        end_s: f64,
    },
    /// An alignment needs poses.
    #[error("no poses to align")]
    NothingToAlign,
    /// The rotation is not determined.
    #[error("the places lie on a line or in a point: no alignment is determined")]
    DegenerateAlignment,
    /// The distance of pairs makes no sense.
    #[error(
        "delta {delta} {}: a whole number of frames from 1, metres from 0, or an angle from 0 to half a turn",
        unit.name()
    )]
    Delta {
        /// What was given.
        delta: f64,
        /// Its unit.
        unit: DeltaUnit,
    },
    /// No pair has the distance asked for.
    #[error("no pairs of poses at delta {delta} {}: try a lower delta", unit.name())]
    NoPairs {
        /// The distance asked for.
        delta: f64,
        /// Its unit.
        unit: DeltaUnit,
    },
    /// A matrix that is no rotation has no angle.
    #[error("the rotation of pose {index} (from 0) is no rotation, so it has no angle")]
    NotARotation {
        /// The pose, from 0, among those compared.
        index: usize,
    },
    /// A ratio to a distance of zero.
    #[error("all pairs are at the same place in the reference: there is no ratio to their distance")]
    NoRatios,
    /// Units of different kinds.
    #[error("errors in {} cannot be converted to {}", from.name(), to.name())]
    Unit {
        /// What they are in.
        from: ErrorUnit,
        /// What was asked for.
        to: ErrorUnit,
    },
    /// Relations that only pairs have.
    #[error("an absolute error has no point distance error ratio")]
    RelationOfPairs,
}
