//! From two pyramids and guesses to a motion, how well it is known, or why it is not.

use dmp_sensor::{Isometry3, Matrix6, Vector3};
use nalgebra::Vector6;

use crate::difference::Difference;
use crate::pyramid::Pyramid;
use crate::refusal::{LEAST_OVERLAP, Refusal};
use crate::side::Side;
use crate::starts::LEAST_HELD;

/// How far both directions may be apart, voxels and radians.
const MOST_APART: f64 = 0.1;
const MOST_TURNED_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
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

/// Brings the surfaces of `source` onto those of `target`, both in the frame of the place, from the best of some guesses of
/// that motion, the identity where there are none.
///
/// From up to about ten voxels off (5 m at half a metre). Of several guesses, the one is gone on with from which the surfaces
/// match best; that they match as well elsewhere is found out only where a guess leads there. `O(surfels)` time for each guess.
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
    let there = forward.best_of(guesses)?;
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
