//! What can go wrong with loop candidates.

use dmp::EvaluateError;
use dmp_lengths::thousands;
use dmp_map::MapError;
use dmp_reduce::ReduceError;
use dmp_sensor::{PoseGraphError, TrajectoryError};

use crate::OptimiseError;

/// Why loop candidates cannot be ranked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// The graph as it is cannot be optimised.
    #[error("the graph without candidates: {0}")]
    Graph(#[source] OptimiseError),
    /// The graph as it is has no minimum that was found.
    #[error("the graph without candidates does not converge: after {iterations} steps its chi² is {chi2}")]
    NotConverged {
        /// Steps that were tried.
        iterations: usize,
        /// The sum of squares after them.
        chi2: f64,
    },
    /// Times of the vertices make no trajectory.
    #[error("the vertices' times: {0}")]
    Times(#[from] TrajectoryError),
    /// There are more or fewer times than vertices.
    #[error("{} times of keyframes for {} vertices: there must be one for each", thousands(.times), thousands(.vertices))]
    OtherCount {
        /// Times given.
        times: usize,
        /// Vertices of the graph.
        vertices: usize,
    },
    /// Scans cannot be assigned to vertices.
    #[error(
        "the log has {} scans and the graph {} vertices: times of the keyframes say which belong together",
        thousands(.scans),
        thousands(.vertices)
    )]
    WhichScans {
        /// Scans of the log.
        scans: usize,
        /// Vertices of the graph.
        vertices: usize,
    },
    /// The scans have no stamps that times could belong to.
    #[error(
        "the log's scans have no stamps, so times of keyframes do not say which scans they are: leave them out, and have a scan for each vertex"
    )]
    NoStamps,
    /// Times go backwards.
    #[error("the keyframe at {stamp_ns} ns comes after one at {before_ns} ns")]
    Backwards {
        /// The stamp before it, nanoseconds.
        before_ns: i64,
        /// The stamp, nanoseconds.
        stamp_ns: i64,
    },
    /// Keyframes of another graph.
    #[error("{} keyframes for {} poses", thousands(.keyframes), thousands(.poses))]
    OtherKeyframes {
        /// How many there are.
        keyframes: usize,
        /// How many poses.
        poses: usize,
    },
    /// A candidate whose change has no interval cannot be judged.
    #[error("changes have no intervals here, so no candidate can be accepted")]
    NoIntervals,
    /// The ranking names a candidate that there is not.
    #[error("the ranking has a candidate {index} (from 0), there are {candidates}")]
    OtherCandidates {
        /// Which.
        index: usize,
        /// How many there are.
        candidates: usize,
    },
    /// Optimised poses are none.
    #[error(transparent)]
    Poses(#[from] PoseGraphError),
    /// The log cannot be read or does not belong to the graph, or residuals cannot be added up.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The map cannot be put together.
    #[error("the map of the graph: {0}")]
    Map(#[from] MapError),
    /// A setting outside its range.
    #[error("{setting} {value}: {why}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What it was set to.
        value: f64,
        /// What it must be.
        why: &'static str,
    },
}

impl From<ReduceError> for LoopError {
    fn from(error: ReduceError) -> Self {
        Self::Evaluate(error.into())
    }
}
