//! One pyramid brought onto another.

use std::collections::BTreeMap;

use dmp_sensor::{Isometry3, Matrix6, Vector3};
use nalgebra::Vector6;

use crate::align::held::{inverse, step};
use crate::align::level::{NONE, Surfel};
use crate::align::normal_equations::{NormalEquations, Residual, motion};
use crate::align::pyramid::Pyramid;

/// How a level is gone through, in voxels of the patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage {
    pub(crate) level: usize,
    /// How far a surfel's counterpart may lie.
    pub(crate) reach: f64,
    /// The scale of Geman and McClure's function.
    pub(crate) scale: f64,
    /// Surfels of the source that are gone through, about: of more, some, spread evenly.
    pub(crate) surfels: usize,
    pub(crate) steps: usize,
    /// Steps below this are the end of the stage; of a rotation, at [`LEVER`].
    pub(crate) small: f64,
}

/// Coarse to fine: so many voxels are 5 to 0.35 m at voxels of half a metre. What a stage leaves is far within the reach of the
/// next one.
pub(crate) const STAGES: [Stage; 4] = [
    Stage { level: 0, reach: 10.0, scale: 2.0, surfels: 350, steps: 12, small: 0.1 },
    Stage { level: 1, reach: 4.0, scale: 0.8, surfels: 1500, steps: 8, small: 0.02 },
    Stage { level: 2, reach: 1.4, scale: 0.3, surfels: 2500, steps: 6, small: 0.004 },
    Stage { level: 2, reach: 0.7, scale: 0.16, surfels: usize::MAX, steps: 8, small: 4e-4 },
];
/// The stage that says how well surfaces match.
pub(crate) const FINEST: Stage = STAGES[STAGES.len() - 1];
/// Where a rotation counts as much as what it moves there, voxels.
const LEVER: f64 = 40.0;
/// Edge of the pieces of surface whose errors are taken to have nothing to do with each other, voxels.
const BLOCK: f64 = 8.0;

/// What is brought onto what.
pub(crate) struct Side<'a> {
    pub(crate) target: &'a Pyramid,
    pub(crate) source: &'a Pyramid,
}

/// Where it came to from a guess.
pub(crate) struct Found {
    pub(crate) guess: Isometry3<f64>,
    pub(crate) pose: Isometry3<f64>,
    /// Counterparts at the finest level.
    pub(crate) pairs: usize,
    pub(crate) last: NormalEquations,
    /// Of what the pieces of surface call for.
    scatter: Matrix6<f64>,
    /// Medians of the distances of counterparts and of their thickness, metres.
    pub(crate) off_m: f64,
    pub(crate) thick_m: f64,
}

/// The counterparts of a level's surfels, to begin the next search with.
pub(crate) struct Counterparts {
    level: usize,
    numbers: Vec<u32>,
}

impl Counterparts {
    pub(crate) fn none() -> Self {
        Self { level: usize::MAX, numbers: Vec::new() }
    }
}

impl Side<'_> {
    /// Goes through the pairs of a stage, in the order of the source's surfels, with the mean of the variances across both, square
    /// metres.
    pub(crate) fn each_pair(
        &self,
        &Stage { level, reach, surfels: most, .. }: &Stage,
        pose: &Isometry3<f64>,
        counterparts: &mut Counterparts,
        mut visit: impl FnMut(&Residual, f64),
    ) {
        let reach_m = reach * self.target.voxel_m;
        let (target, source) = (&self.target.levels[level], &self.source.levels[level]);
        if counterparts.level != level {
            *counterparts = Counterparts { level, numbers: vec![NONE; source.surfels.len()] };
        }
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        let one_of = source.surfels.len().div_ceil(most).max(1);
        for (surfel, number) in source.surfels.iter().zip(&mut counterparts.numbers).step_by(one_of) {
            let place_m = rotation * surfel.mean_m() + pose.translation.vector;
            let moved = Surfel::new(place_m.into(), (rotation * surfel.normal()).into());
            *number = target.nearest(&moved, reach_m, *number);
            if let Some(there) = target.surfels.get(*number as usize) {
                let across_m2 = f64::from(surfel.across_m2 + there.across_m2) / 2.0;
                visit(&Residual::new(place_m, &there.mean_m(), there.normal()), across_m2);
            }
        }
    }

    pub(crate) fn equations(
        &self,
        stage: &Stage,
        pose: &Isometry3<f64>,
        counterparts: &mut Counterparts,
    ) -> NormalEquations {
        let scale_m = stage.scale * self.target.voxel_m;
        let mut equations = NormalEquations::zero();
        self.each_pair(stage, pose, counterparts, |residual, _| {
            equations.add(residual, residual.weight(scale_m));
        });
        equations
    }

    /// Goes through a stage, until steps are small; `None` where it `is_known` where an intermediate pose leads to.
    pub(crate) fn through(
        &self,
        stage: &Stage,
        mut pose: Isometry3<f64>,
        counterparts: &mut Counterparts,
        mut is_known: impl FnMut(&Isometry3<f64>, &NormalEquations) -> bool,
    ) -> Option<Isometry3<f64>> {
        let (small_m, small_rad) = (stage.small * self.target.voxel_m, stage.small / LEVER);
        for _ in 0..stage.steps {
            let equations = self.equations(stage, &pose, counterparts);
            if is_known(&pose, &equations) {
                return None;
            }
            let Some(step) = step(&equations) else { break };
            pose = motion(&step) * pose;
            if step.fixed_rows::<3>(3).norm() < small_m && step.fixed_rows::<3>(0).norm() < small_rad {
                break;
            }
        }
        Some(pose)
    }

    /// Goes through all stages behind the coarsest, which came from a guess to `start`.
    pub(crate) fn refined(&self, guess: &Isometry3<f64>, start: &Isometry3<f64>) -> Found {
        let mut counterparts = Counterparts::none();
        let pose = STAGES[1..].iter().fold(*start, |pose, stage| {
            self.through(stage, pose, &mut counterparts, |_, _| false).unwrap_or(pose)
        });
        let [scale_m, block_m] = [FINEST.scale, BLOCK].map(|voxels| voxels * self.target.voxel_m);
        let (mut pairs, mut last) = (0, NormalEquations::zero());
        let (mut distances_m, mut across) = (Vec::new(), Vec::new());
        let mut blocks: BTreeMap<[i32; 3], Vector6<f64>> = BTreeMap::new();
        self.each_pair(&FINEST, &pose, &mut counterparts, |residual, across_m2| {
            let weight = residual.weight(scale_m);
            last.add(residual, weight);
            let block = [0, 1, 2].map(|k| (residual.place_m[k] / block_m).floor() as i32);
            *blocks.entry(block).or_insert_with(Vector6::zeros) +=
                residual.jacobian * (weight * residual.distance_m);
            distances_m.push(residual.distance_m.abs());
            across.push(across_m2);
            pairs += 1;
        });
        // Errors of a block are as one.
        let scatter = blocks.values().fold(Matrix6::zeros(), |sum, score| sum + score * score.transpose());
        let (off_m, thick_m) = (median(distances_m), median(across).sqrt());
        Found { guess: *guess, pose, pairs, last, scatter, off_m, thick_m }
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

impl Found {
    pub(crate) fn overlap(&self, source: &Pyramid) -> f64 {
        self.pairs as f64 / source.surfels().max(1) as f64
    }

    /// The middle of the surfaces, brought onto the target.
    pub(crate) fn middle_m(&self) -> Vector3<f64> {
        self.last.middle_m()
    }

    /// The sandwich, of what is held.
    pub(crate) fn covariance(&self, unheld: &[Vector3<f64>]) -> Matrix6<f64> {
        inverse(&self.last, unheld).map_or_else(Matrix6::zeros, |inverse| inverse * self.scatter * inverse)
    }
}
