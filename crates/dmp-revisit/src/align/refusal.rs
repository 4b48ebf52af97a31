//! Why there may be no answer.

use thiserror::Error;

/// Least share of the surfels of either visit that the other one sees.
pub(crate) const LEAST_OVERLAP: f64 = 0.20;

impl Refusal {
    /// How far from the first guess the surfaces match best, metres, across the direction that they hold least, where they neither
    /// fit there nor at the guess, and both visits see all round: evidence that the guess is wrong, not a want of surfaces.
    pub fn elsewhere_m(&self) -> Option<f64> {
        match self {
            Self::NotTheSameBackward { elsewhere_m, .. } | Self::NotAlike { elsewhere_m, .. } => *elsewhere_m,
            _ => None,
        }
    }
}

/// Why the surfaces give no alignment.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The visits were made with voxels of different edges.
    #[error("voxels of {0} m and {1} m")]
    Voxels(f64, f64),
    /// The visits hardly see the same.
    #[error("only {share:.3} of a visit's surfels have a counterpart, less than {LEAST_OVERLAP}")]
    LittleOverlap {
        /// The smaller of both shares.
        share: f64,
    },
    /// Surfaces match as well elsewhere.
    #[error(
        "surfaces match nearly as well {apart_m:.2} m and {turned_rad:.3} rad away: {share:.2} of the support here"
    )]
    Ambiguous {
        /// Distance of both places, at the middle of the surfaces.
        apart_m: f64,
        /// Angle between both.
        turned_rad: f64,
        /// Support of the worse match against the better one, in parts of the support of the better one.
        share: f64,
    },
    /// From the other side it is another motion.
    #[error("{apart_m:.3} m and {turned_rad:.4} rad between what both directions say")]
    NotTheSameBackward {
        /// Distance of what they say, at the middle of the surfaces.
        apart_m: f64,
        /// Angle between what they say.
        turned_rad: f64,
        /// See [`Refusal::elsewhere_m`].
        elsewhere_m: Option<f64>,
    },
    /// Surfaces do not coincide.
    #[error(
        "surfaces lie {:.1} cm apart and are {:.1} cm thick: another place that looks alike, or visits that are bent",
        100.0 * .off_m,
        100.0 * .thick_m
    )]
    NotAlike {
        /// Median distance of the counterparts.
        off_m: f64,
        /// Median thickness of the surfels.
        thick_m: f64,
        /// See [`Refusal::elsewhere_m`].
        elsewhere_m: Option<f64>,
    },
    /// Surfaces hold no translation in two directions, or no rotation about an axis.
    #[error("only {held:.4} of the surfaces hold it along or about [{:.2}, {:.2}, {:.2}]", .along[0], .along[1], .along[2])]
    NotHeld {
        /// Share of the weights; of a rotation, by what it moves at 20 voxels.
        held: f64,
        /// The direction that is held least, or the axis, in the target's frame.
        along: [f64; 3],
    },
}
