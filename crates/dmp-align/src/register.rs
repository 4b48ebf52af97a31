//! From two pyramids and guesses to a motion, how well it is known, or why it is not.

use std::collections::BTreeMap;

use dmp_map::smallest_eigenvector;
use dmp_sensor::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};
use nalgebra::Vector6;
use thiserror::Error;

use crate::normal_equations::{NormalEquations, Residual, motion};
use crate::pyramid::{LEVELS, Level, Pyramid, Surfel};

/// How a level is gone through, in voxels of the patch.
struct Stage {
    level: usize,
    /// How far a surfel's counterpart may lie.
    reach: f64,
    /// The scale of Geman and McClure's function.
    scale: f64,
    steps: usize,
}

/// Coarse to fine: so many voxels are 5 to 0.35 m at voxels of half a metre.
const STAGES: [Stage; 4] = [
    Stage { level: 0, reach: 10.0, scale: 2.0, steps: 12 },
    Stage { level: 1, reach: 4.0, scale: 0.8, steps: 8 },
    Stage { level: 2, reach: 1.4, scale: 0.3, steps: 6 },
    Stage { level: 2, reach: 0.7, scale: 0.16, steps: 8 },
];
/// Steps below this are the end of a stage, voxels; of a rotation, at [`LEVER`].
const SMALL_STEP: f64 = 1e-4;
/// Where a rotation counts as much as what it moves there, voxels.
const LEVER: f64 = 40.0;

/// Least share of the surfels of either visit that the other one sees.
const LEAST_OVERLAP: f64 = 0.20;
/// How far both directions may be apart, voxels and radians.
const MOST_APART: f64 = 0.1;
const MOST_TURNED_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Least share of the weights that holds the translation in each direction: a corridor of bare walls has less along it.
const LEAST_HELD: f64 = 0.01;
/// Half of the counterparts lie no further off than this many times what surfels are thick, and these count as so thick at least,
/// voxels: on another place that looks alike they lie at 1.9 and more.
const MOST_OFF: f64 = 1.5;
const LEAST_THICK: f64 = 0.012;
/// Fewer counterparts than this are no surface.
const LEAST_PAIRS: usize = 50;

/// Edge of the pieces of surface whose errors are taken to have nothing to do with each other, voxels.
const BLOCK: f64 = 8.0;
/// No direction is known better than this, voxels, and than half of the counterparts lie off: surfels are means over voxels that two
/// visits fill unevenly.
const FLOOR: f64 = 0.02;

/// Where one visit's surfaces lie by the other's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// The motion that brings the surfaces of the source onto those of the target, in the place's frame: the identity where a
    /// run put both visits right.
    pub target_from_source: Isometry3<f64>,
    /// Of a rotation vector (radians) and a translation (metres) put before it: over pieces of the surface, with half the
    /// difference of both directions and an [allowance](Self::allowance_m).
    pub covariance: Matrix6<f64>,
    /// Shares of the surfels of the source that the target has counterparts of, and of the target that the source has.
    pub overlap: [f64; 2],
    /// What the covariance allows in each direction of the translation beside what the surfaces scatter, metres: surfels of
    /// visits that are bent lie off together.
    pub allowance_m: f64,
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
    /// Surfaces do not come to lie on each other.
    #[error(
        "surfaces come to lie {:.1} cm apart and are {:.1} cm thick: another place that looks alike, or visits that are bent",
        100.0 * .off_m,
        100.0 * .thick_m
    )]
    NotAlike {
        /// Median distance of the counterparts.
        off_m: f64,
        /// Median thickness of the surfels.
        thick_m: f64,
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
    let off_m = there.off_m.max(back.off_m);
    let thick_m = there.thick_m.max(LEAST_THICK * target.voxel_m);
    if off_m > MOST_OFF * thick_m {
        return Err(Refusal::NotAlike { off_m, thick_m: there.thick_m });
    }
    let (held, least_held) = there.held();
    let (held_back, least_held_back) = back.held();
    let (held, least_held) = if held_back < held { (held_back, least_held_back) } else { (held, least_held) };
    if held < LEAST_HELD {
        return Err(Refusal::NotHeld { held, along: least_held.into() });
    }
    let half = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
    let floor_m = FLOOR * target.voxel_m;
    let allowed_m2 = floor_m * floor_m + off_m * off_m;
    let allowed = Matrix6::from_fn(|k, l| if k == l && k >= 3 { allowed_m2 } else { 0.0 });
    let covariance = there.covariance + half * half.transpose() + allowed;
    Ok(Alignment {
        target_from_source,
        covariance,
        overlap,
        allowance_m: allowed_m2.sqrt(),
        held,
        least_held,
    })
}

/// What is brought onto what.
struct Side<'a> {
    target: &'a Pyramid,
    source: &'a Pyramid,
}

/// Where it came to.
struct Found {
    pose: Isometry3<f64>,
    /// Counterparts at the finest level.
    pairs: usize,
    last: NormalEquations,
    covariance: Matrix6<f64>,
    /// Medians of the distances of counterparts and of their thickness, metres.
    off_m: f64,
    thick_m: f64,
    /// Of the surfels with counterparts, brought onto the target.
    middle_m: Vector3<f64>,
}

/// A surfel where it comes to lie, and its counterpart's plane.
struct Pair {
    place_m: Vector3<f64>,
    residual: Residual,
    /// Mean of the variances across both, square metres.
    across_m2: f64,
}

impl Side<'_> {
    /// The pairs of a level, in the order of the source's surfels.
    fn pairs<'s>(
        &'s self,
        level: usize,
        reach_m: f64,
        pose: &'s Isometry3<f64>,
    ) -> impl Iterator<Item = Pair> + 's {
        let (target, source): (&Level, &Level) = (&self.target.levels[level], &self.source.levels[level]);
        source.surfels.iter().filter_map(move |Surfel { mean_m, normal, across_m2 }| {
            let (place_m, normal) =
                (pose.rotation * mean_m + pose.translation.vector, pose.rotation * normal);
            let there = target.nearest(&place_m, &normal, reach_m)?;
            let residual = Residual::new(&place_m, &there.mean_m, &there.normal);
            Some(Pair { place_m, residual, across_m2: (across_m2 + there.across_m2) / 2.0 })
        })
    }

    fn equations(&self, stage: &Stage, pose: &Isometry3<f64>) -> NormalEquations {
        let [reach_m, scale_m] = [stage.reach, stage.scale].map(|voxels| voxels * self.target.voxel_m);
        let mut equations = NormalEquations::zero();
        for Pair { residual, .. } in self.pairs(stage.level, reach_m, pose) {
            equations.add(&residual, residual.weight(scale_m));
        }
        equations
    }

    /// Goes through a stage, until steps are small.
    fn through(&self, stage: &Stage, mut pose: Isometry3<f64>) -> Isometry3<f64> {
        let small_m = SMALL_STEP * self.target.voxel_m;
        let small_rad = SMALL_STEP / LEVER;
        for _ in 0..stage.steps {
            let Some(step) = self.equations(stage, &pose).step() else { return pose };
            pose = motion(&step) * pose;
            if step.fixed_rows::<3>(3).norm() < small_m && step.fixed_rows::<3>(0).norm() < small_rad {
                break;
            }
        }
        pose
    }

    /// Where the coarsest stage comes to from each guess; the one with the greatest weight of pairs.
    fn best_start(&self, guesses: &[Isometry3<f64>]) -> Isometry3<f64> {
        let coarse = &STAGES[0];
        let mut best = (f64::NEG_INFINITY, Isometry3::identity());
        for guess in guesses {
            let pose = self.through(coarse, *guess);
            // By finer scales than it was found with: what is nearly right weighs more.
            let fine = Stage { scale: STAGES[1].scale, ..*coarse };
            let weight = self.equations(&fine, &pose).weight;
            if weight > best.0 {
                best = (weight, pose);
            }
        }
        best.1
    }

    /// Goes through all stages behind the coarsest.
    fn refined(&self, start: Isometry3<f64>) -> Found {
        let pose = STAGES[1..].iter().fold(start, |pose, stage| self.through(stage, pose));
        let stage = &STAGES[STAGES.len() - 1];
        let [reach_m, scale_m, block_m] =
            [stage.reach, stage.scale, BLOCK].map(|voxels| voxels * self.target.voxel_m);
        let (mut pairs, mut last, mut middle_m) = (0, NormalEquations::zero(), Vector3::zeros());
        let (mut distances_m, mut across) = (Vec::new(), Vec::new());
        let mut blocks: BTreeMap<[i32; 3], Vector6<f64>> = BTreeMap::new();
        for Pair { place_m, residual, across_m2 } in self.pairs(stage.level, reach_m, &pose) {
            let weight = residual.weight(scale_m);
            last.add(&residual, weight);
            let block = [0, 1, 2].map(|k| (place_m[k] / block_m).floor() as i32);
            *blocks.entry(block).or_insert_with(Vector6::zeros) +=
                residual.jacobian * (weight * residual.distance_m);
            middle_m += place_m;
            distances_m.push(residual.distance_m.abs());
            across.push(across_m2);
            pairs += 1;
        }
        middle_m /= pairs.max(1) as f64;
        // The sandwich: errors of a block are as one.
        let scatter = blocks.values().fold(Matrix6::zeros(), |sum, score| sum + score * score.transpose());
        let covariance = last.damped().cholesky().map_or_else(Matrix6::zeros, |information| {
            let inverse = information.inverse();
            inverse * scatter * inverse
        });
        let (off_m, thick_m) = (median(distances_m), median(across).sqrt());
        Found { pose, pairs, last, covariance, off_m, thick_m, middle_m }
    }
}

impl Found {
    fn overlap(&self, source: &Pyramid) -> f64 {
        self.pairs as f64 / source.levels[LEVELS.len() - 1].surfels.len().max(1) as f64
    }

    /// Least share of the weights that holds a translation, and its direction.
    fn held(&self) -> (f64, Vector3<f64>) {
        let m = &self.last.information;
        let (direction, [least, ..]) =
            smallest_eigenvector([m[(3, 3)], m[(3, 4)], m[(3, 5)], m[(4, 4)], m[(4, 5)], m[(5, 5)]]);
        (least.max(0.0) / self.last.weight.max(f64::MIN_POSITIVE), direction.into())
    }
}

/// The middle value, the upper one of two; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The middle of two motions that are nearly the same, and half of what lies between them.
struct Difference {
    target_from_source: Isometry3<f64>,
    /// At the middle of the surfaces, metres.
    shift: Vector3<f64>,
    /// Rotation vector, radians.
    turn: Vector3<f64>,
}

impl Difference {
    fn of(a: &Isometry3<f64>, b: &Isometry3<f64>, middle_m: &Vector3<f64>) -> Self {
        let between = b * a.inverse();
        let quaternion = between.rotation.quaternion();
        let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
        // Of half a small angle, the sine is the angle.
        let turn = quaternion.imag() * sign;
        let half_turned = motion(&Vector6::new(turn.x, turn.y, turn.z, 0.0, 0.0, 0.0)).rotation;
        let shift = (between.rotation * middle_m + between.translation.vector - middle_m) / 2.0;
        // About the middle of the surfaces.
        let half = Isometry3::from_parts(
            Translation3::from(middle_m + shift - half_turned * middle_m),
            UnitQuaternion::new_normalize(half_turned.into_inner()),
        );
        Self { target_from_source: half * a, shift, turn }
    }
}
