//! Pose graphs as a SLAM front end leaves them, without loops, and loop candidates of which is known which are
//! true.

mod keyframes;
mod measure;
mod odometry;
mod places;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use dmp_lengths::{LoopLengths, Scales, SimulatedLoopLengths};
use dmp_sensor::{PoseEdge, PoseGraph, Trajectory};

use crate::error::{SimError, require};
use crate::random::Random;
use keyframes::{Keyframes, Spacing};
pub use measure::LoopKind;
use measure::Measurer;
use places::Places;

/// How the pose graph of a drive, or of a walk through a room, is made, and which loop candidates are.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopGraphOptions {
    /// Seed of the odometry's noise and of all that is drawn for the candidates.
    pub seed: u64,
    /// Travel from one keyframe to the next, metres; with 0 every instant is a keyframe.
    pub spacing_m: f64,
    /// A turn after which there is a keyframe, too, however short the way, radians; `None` for none.
    pub spacing_rad: Option<f64>,
    /// Instants that may be keyframes, nanoseconds, in any order: the scans of a log. `None`: those of the
    /// trajectory's poses.
    pub instants_ns: Option<Vec<i64>>,
    /// Standard deviation of a step of one metre of the odometry along each axis, metres; that of other steps
    /// grows with the square root of their length.
    pub step_sigma_m: f64,
    /// The same of the rotation about each axis, radians.
    pub step_sigma_rad: f64,
    /// What the odometry turns too far to the left in each metre of travel, radians.
    pub yaw_bias_rad_per_m: f64,
    /// What counts as one place and as another, and what loops are off by.
    pub lengths: LoopLengths,
    /// Candidates that are [`LoopKind::True`].
    pub true_loops: usize,
    /// Candidates that are [`LoopKind::False`].
    pub false_loops: usize,
    /// Candidates that are [`LoopKind::Near`].
    pub near_loops: usize,
}

impl Default for LoopGraphOptions {
    fn default() -> Self {
        Self::on_scales(Scales::default())
    }
}

impl LoopGraphOptions {
    /// What is usual for a drive with a sensor that sees all around, or for a walk through a room with a camera in the hand.
    pub fn on_scales(scales: Scales) -> Self {
        let SimulatedLoopLengths {
            spacing_m,
            spacing_rad,
            step_sigma_m,
            step_sigma_rad,
            yaw_bias_rad_per_m,
            loops: lengths,
        } = scales.lengths().simulated_loops;
        Self {
            seed: 1,
            spacing_m,
            spacing_rad,
            instants_ns: None,
            step_sigma_m,
            step_sigma_rad,
            yaw_bias_rad_per_m,
            lengths,
            true_loops: 10,
            false_loops: 10,
            near_loops: 6,
        }
    }
}

const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// A loop candidate, and what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedLoop {
    /// The measurement, from the earlier vertex to the later one.
    pub edge: PoseEdge,
    /// What it is.
    pub kind: LoopKind,
}

/// A pose graph without loops, candidates for them, and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopGraph {
    /// Keyframes 0, 1, 2, … where the odometry puts them, the first at its true pose, and an edge from each to the
    /// next. Nothing is fixed.
    pub graph: PoseGraph,
    /// The keyframes' true poses, with stamps.
    pub truth: Trajectory,
    /// The candidates, in an order that says nothing of what they are. No two are between the same vertices, and
    /// all have the same information.
    pub candidates: Vec<SimulatedLoop>,
}

impl LoopGraph {
    /// The graph of a drive or a walk, and candidates.
    ///
    /// Every noise has the covariance whose inverse is the edge's information, but for the odometry's bias, of
    /// which it knows nothing, and for loops, which are better measured than they claim (0.1 m and 0.5° for a
    /// drive), if they are true.
    ///
    /// # Errors
    /// When a number is out of range, the trajectory has no stamps or no pose at an instant, or the drive
    /// has too few places that it comes back to, or that are far apart, for the candidates.
    pub fn new(truth: &Trajectory, options: &LoopGraphOptions) -> Result<Self, SimError> {
        options.check()?;
        let keyframes = Keyframes::choose(truth, options.spacing(), options.instants_ns.as_deref())?;
        let (vertices, edges) = odometry::drifted(&keyframes, options);
        let graph = PoseGraph::new(vertices, edges, BTreeSet::new())?;
        let candidates = candidates(&keyframes, options)?;
        let poses = keyframes.stamps_ns.into_iter().zip(keyframes.poses).collect();
        let truth = Trajectory::stamped(poses)?.trajectory;
        Ok(Self { graph, truth, candidates })
    }
}

impl LoopGraphOptions {
    fn spacing(&self) -> Spacing {
        Spacing { way_m: self.spacing_m, turn_rad: self.spacing_rad.unwrap_or(f64::INFINITY) }
    }

    fn check(&self) -> Result<(), SimError> {
        let within = |value: f64, most: f64| (0.0..=most).contains(&value);
        let turn = self.spacing_rad.unwrap_or(0.0);
        require(within(turn, 4.0), "the turn between keyframes in rad", "from 0 to 4", turn)?;
        require(within(self.spacing_m, 1000.0), "the spacing in m", "from 0 to 1000", self.spacing_m)?;
        require(within(self.step_sigma_m, 10.0), "the noise in m", "from 0 to 10", self.step_sigma_m)?;
        require(within(self.step_sigma_rad, 1.0), "the noise in rad", "from 0 to 1", self.step_sigma_rad)?;
        let bias = self.yaw_bias_rad_per_m;
        require(within(bias.abs(), 1.0), "the yaw bias in rad/m", "from -1 to 1", bias)
    }
}

/// Candidates of all kinds, shuffled.
fn candidates(keyframes: &Keyframes, options: &LoopGraphOptions) -> Result<Vec<SimulatedLoop>, SimError> {
    let mut random = Random::new(options.seed, &[b'l'.into(), b'c'.into()]);
    let places = Places::new(keyframes, options.lengths);
    // Which of the places that are seen again have a measurement that is off, is chance.
    let mut kinds = vec![LoopKind::True; options.true_loops];
    kinds.resize(options.true_loops + options.near_loops, LoopKind::Near);
    shuffle(&mut kinds, &mut random);
    let seen_again = places.seen_again(kinds.len(), &mut random)?;
    let far_apart = places.far_apart(options.false_loops, &mut random)?;
    let falsely = far_apart.into_iter().map(|pair| (pair, LoopKind::False));
    let mut all: Vec<_> = seen_again.into_iter().zip(kinds).chain(falsely).collect();
    shuffle(&mut all, &mut random);
    let mut measurer = Measurer { keyframes, lengths: options.lengths, random };
    Ok(all.into_iter().map(|((from, to), kind)| measurer.measure(from, to, kind)).collect())
}

/// Any order, all equally likely (Fisher & Yates).
fn shuffle<T>(items: &mut [T], random: &mut Random) {
    for last in (1..items.len()).rev() {
        items.swap(last, random.index(last + 1));
    }
}
