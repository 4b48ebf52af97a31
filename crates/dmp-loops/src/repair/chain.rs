//! A run as a chain of keyframes, and what moves of these do to all of its poses.

use std::collections::{BTreeMap, BTreeSet};

use dmp::PosedLog;
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph, Trajectory, pose_between};

use crate::LoopError;

/// From keyframe to keyframe, metres of a drive.
const STEP_M: f64 = 1.0;
/// A longer path has longer steps.
const MOST_STEPS: f64 = 5000.0;
/// A step errs at least as one of this length does, metres of a drive.
const LEAST_STEP_M: f64 = 0.1;

/// Error of an odometry: standard deviations along and about each axis after one metre, metres and radians. They grow with the
/// root of the path length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepError {
    /// Along each axis, metres.
    pub place_m: f64,
    /// About each axis, radians.
    pub turn_rad: f64,
}

impl Default for StepError {
    fn default() -> Self {
        Self { place_m: 0.01, turn_rad: 0.0005 }
    }
}

impl StepError {
    /// So many times as large.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { place_m: self.place_m * factor, turn_rad: self.turn_rad * factor }
    }
}

/// A scan of the log that the run has a pose for.
#[derive(Debug, Clone, Copy)]
struct PosedBody {
    /// Its number in the log.
    number: usize,
    /// Where it lies among the poses of the run.
    position: f64,
    world_from_body: Isometry3<f64>,
}

/// The keyframes of a run: scans about a metre apart, by their numbers in the log.
#[derive(Debug)]
pub(super) struct Chain {
    keyframes: Vec<PosedBody>,
    /// Distance travelled up to each, metres.
    along_m: Vec<f64>,
    /// For each scan in use its keyframe; and by the number of a scan its place there.
    of_scan: Vec<usize>,
    scans: Vec<PosedBody>,
    metre_m: f64,
}

impl Chain {
    /// `None` where fewer than two keyframes have a pose.
    pub(super) fn new(posed: &PosedLog<'_>) -> Option<Self> {
        let metre_m = posed.settings().scales.lengths().metre_m;
        let body = |(ordinal, scan): (usize, dmp::PosedScan)| {
            let (position, world_from_body) = posed.body_at(ordinal)?;
            Some(PosedBody { number: scan.number, position, world_from_body })
        };
        let scans: Vec<PosedBody> = posed.scans().enumerate().map(body).collect::<Option<_>>()?;
        let travelled_m = posed.along_m();
        let travel_m = travelled_m.last()? - travelled_m.first()?;
        let step_m = (STEP_M * metre_m).max(travel_m / MOST_STEPS);
        // Halves of the steps before and after a keyframe belong to it.
        let step_of = |ordinal: usize| ((travelled_m[ordinal] - travelled_m[0]) / step_m + 0.5) as usize;
        let mut chain = Self {
            keyframes: Vec::new(),
            along_m: Vec::new(),
            of_scan: Vec::with_capacity(scans.len()),
            scans,
            metre_m,
        };
        let ordinals: Vec<usize> = (0..chain.scans.len()).collect();
        for of_one in ordinals.chunk_by(|&a, &b| step_of(a) == step_of(b)) {
            let middle = of_one[of_one.len() / 2];
            chain.of_scan.extend(of_one.iter().map(|_| chain.keyframes.len()));
            chain.keyframes.push(chain.scans[middle]);
            chain.along_m.push(travelled_m[middle]);
        }
        (chain.keyframes.len() > 1).then_some(chain)
    }

    /// For each scan in use its keyframe.
    pub(super) fn of_scan(&self) -> &[usize] {
        &self.of_scan
    }

    /// Where the run has the keyframes.
    pub(super) fn poses(&self) -> Vec<Isometry3<f64>> {
        self.keyframes.iter().map(|keyframe| keyframe.world_from_body).collect()
    }

    /// Distance travelled up to a keyframe, metres, given the number of its scan.
    pub(super) fn along_m(&self, number: i64) -> f64 {
        let found = self.keyframes.binary_search_by_key(&number, |keyframe| keyframe.number as i64);
        found.map_or(f64::NAN, |index| self.along_m[index])
    }

    /// The graph of the run alone: a vertex a keyframe, called by the number of its scan, and an edge from each to the next, as the
    /// run has it, with an error that grows with its length.
    pub(super) fn graph(&self, error: StepError) -> Result<PoseGraph, LoopError> {
        let least_m = LEAST_STEP_M * self.metre_m;
        let edge = |k: usize| {
            let [from, to] = [k, k + 1].map(|k| &self.keyframes[k]);
            let step = from.world_from_body.inv_mul(&to.world_from_body);
            // A tenth of the lengths is a tenth of the errors.
            let length_m = (self.along_m[k + 1] - self.along_m[k]).max(least_m) / self.metre_m;
            let of_step = error.times(length_m.sqrt());
            PoseEdge {
                from: from.number as i64,
                to: to.number as i64,
                from_from_to: step,
                information: PoseGraph::information_of(of_step.place_m * self.metre_m, of_step.turn_rad),
            }
        };
        let edges = (0..self.keyframes.len() - 1).map(edge).collect();
        let vertices: BTreeMap<i64, Isometry3<f64>> = self
            .keyframes
            .iter()
            .map(|keyframe| (keyframe.number as i64, keyframe.world_from_body))
            .collect();
        Ok(PoseGraph::new(vertices, edges, BTreeSet::new())?)
    }

    /// An edge between scans as one between their keyframes, which the run has close to them; `None` where that is none.
    pub(super) fn between_keyframes(&self, edge: &PoseEdge) -> Option<PoseEdge> {
        let end = |number: i64| {
            let ordinal = self.scans.binary_search_by_key(&number, |scan| scan.number as i64).ok()?;
            let keyframe = &self.keyframes[self.of_scan[ordinal]];
            let keyframe_from_scan = keyframe.world_from_body.inv_mul(&self.scans[ordinal].world_from_body);
            Some((self.of_scan[ordinal], keyframe.number as i64, keyframe_from_scan))
        };
        let ((first, from, from_from_scan), (second, to, to_from_scan)) = (end(edge.from)?, end(edge.to)?);
        let from_from_to = from_from_scan * edge.from_from_to * to_from_scan.inverse();
        // Less than half a step off: the information is as good as the same.
        (first.abs_diff(second) > 1).then(|| PoseEdge { from, to, from_from_to, ..edge.clone() })
    }

    /// The run with its keyframes moved to `world_from_body` and what lies between them taken along: each pose by what its two
    /// keyframes say, more by the nearer one.
    pub(super) fn taken_along(
        &self,
        run: &Trajectory,
        world_from_body: &[Isometry3<f64>],
    ) -> Result<Trajectory, LoopError> {
        let moves: Vec<Isometry3<f64>> = self
            .keyframes
            .iter()
            .zip(world_from_body)
            .map(|(keyframe, moved)| moved * keyframe.world_from_body.inverse())
            .collect();
        let moved = |(number, pose): (usize, &Isometry3<f64>)| {
            let position = number as f64;
            let after = self.keyframes.partition_point(|keyframe| keyframe.position <= position);
            let (Some(before), true) = (after.checked_sub(1), after < moves.len()) else {
                return moves[after.min(moves.len() - 1)] * pose;
            };
            let [from, to] = [before, after].map(|k| self.keyframes[k].position);
            pose_between(&(moves[before] * pose), &(moves[after] * pose), (position - from) / (to - from))
        };
        let poses: Vec<Isometry3<f64>> = run.poses().iter().enumerate().map(moved).collect();
        Ok(match run.stamps_ns() {
            Some(stamps_ns) => {
                Trajectory::stamped(stamps_ns.iter().copied().zip(poses).collect())?.trajectory
            }
            None => Trajectory::unstamped(poses)?,
        })
    }
}
