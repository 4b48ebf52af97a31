//! From two pyramids and guesses to a motion, how well it is known, or why it is not.

use dmp_sensor::{Isometry3, Matrix6, Vector3};
use nalgebra::Vector6;
use thiserror::Error;

use crate::difference::Difference;
use crate::pyramid::Pyramid;
use crate::side::Side;

/// Least share of the surfels of either visit that the other one sees.
const LEAST_OVERLAP: f64 = 0.10;
/// How far both directions may be apart, voxels and radians.
const MOST_APART: f64 = 0.1;
const MOST_TURNED_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Least share of the weights that holds the translation in each direction: a corridor of bare walls has less along it.
const LEAST_HELD: f64 = 0.01;
/// Fewer counterparts than this are no surface.
const LEAST_PAIRS: usize = 50;

/// No direction is known better than this, voxels: surfels are means over voxels that two visits fill unevenly.
const FLOOR: f64 = 0.02;

/// Where one visit's surfaces lie by the other's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// The motion that brings the surfaces of the source onto those of the target, in the place's frame: the identity where a
    /// run put both visits right.
    pub target_from_source: Isometry3<f64>,
    /// Of a rotation vector (radians) and a translation (metres) put before it: over pieces of the surface, with half the
    /// difference of both directions and a floor of 0.02 voxels.
    pub covariance: Matrix6<f64>,
    /// Shares of the surfels of the source that the target has counterparts of, and of the target that the source has.
    pub overlap: [f64; 2],
    /// Least share of the weights that holds the translation in a direction: 1/3 where all do evenly.
    pub held: f64,
    /// That direction.
    pub least_held: Vector3<f64>,
}

/// Why the surfaces do not tell.
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
    /// From the other side it is another motion.
    #[error("{apart_m:.3} m and {turned_rad:.4} rad between what both directions say")]
    NotTheSameBackward {
        /// Distance of what they say, at the middle of the surfaces.
        apart_m: f64,
        /// Angle between what they say.
        turned_rad: f64,
    },
    /// Surfaces hold no translation in one direction.
    #[error("only {held:.4} of the surfaces hold it along [{:.2}, {:.2}, {:.2}]", .along[0], .along[1], .along[2])]
    NotHeld {
        /// Share of the weights.
        held: f64,
        /// In the place's frame.
        along: [f64; 3],
    },
}

/// Brings the surfaces of `source` onto those of `target`, both in the frame of the place, from the best of some guesses of
/// that motion, the identity where there are none.
///
/// From up to about ten voxels off (5 m at half a metre); of several guesses, the one from which the coarsest surfels
/// match best is gone on with. `O(surfels)` time.
///
/// # Errors
/// Where the surfaces do not tell: see [`Refusal`].
pub fn align(target: &Pyramid, source: &Pyramid, guesses: &[Isometry3<f64>]) -> Result<Alignment, Refusal> {
    if target.voxel_m != source.voxel_m {
        return Err(Refusal::Voxels(target.voxel_m, source.voxel_m));
    }
    let identity = [Isometry3::identity()];
    let guesses = if guesses.is_empty() { &identity } else { guesses };
    let forward = Side { target, source };
    let there = forward.refined(forward.best_start(guesses));
    let backward = Side { target: source, source: target };
    let back = backward.refined(there.pose.inverse());
    let overlap = [there.overlap(source), back.overlap(target)];
    let share = overlap[0].min(overlap[1]);
    if share < LEAST_OVERLAP || there.pairs.min(back.pairs) < LEAST_PAIRS {
        return Err(Refusal::LittleOverlap { share });
    }
    let Difference { target_from_source, shift, turn } =
        Difference::of(&there.pose, &back.pose.inverse(), &there.middle_m);
    let (apart_m, turned_rad) = (2.0 * shift.norm(), 2.0 * turn.norm());
    if apart_m > MOST_APART * target.voxel_m || turned_rad > MOST_TURNED_RAD {
        return Err(Refusal::NotTheSameBackward { apart_m, turned_rad });
    }
    let (held, least_held) = there.held();
    let (held_back, least_held_back) = back.held();
    let (held, least_held) = if held_back < held { (held_back, least_held_back) } else { (held, least_held) };
    if held < LEAST_HELD {
        return Err(Refusal::NotHeld { held, along: least_held.into() });
    }
    let half = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
    let floor_m = FLOOR * target.voxel_m;
    let floor = Matrix6::from_fn(|k, l| if k == l && k >= 3 { floor_m * floor_m } else { 0.0 });
    let covariance = there.covariance + half * half.transpose() + floor;
    Ok(Alignment { target_from_source, covariance, overlap, held, least_held })
}
