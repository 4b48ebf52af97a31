//! Pose graphs as a SLAM front end leaves them, without loops, and loop candidates of which is known which are
//! true.

mod keyframes;
mod measure;
mod odometry;
mod options;
mod places;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use dmp_sensor::{PoseGraph, Trajectory};

use crate::error::SimError;
use crate::random::Random;
use keyframes::Keyframes;
use measure::Measurer;
pub use measure::{LoopKind, SimulatedLoop};
pub use options::LoopGraphOptions;
use places::Places;

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
    /// Every noise has the covariance whose inverse is the edge's information, except the odometry's bias, of
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
