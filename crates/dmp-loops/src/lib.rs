//! Rank loop candidates of a pose graph by the maps they make.
//!
//! # Brief overview
//! A loop candidate is an edge that somebody thinks a [`PoseGraph`](dmp_sensor::PoseGraph) should have. [`optimise`] finds
//! the poses that fit the graph's edges and some more best; `chi2` says how well. A [`LoopMap`] holds the scans of a log as
//! rigid patches around the graph's [`Keyframes`]. A [`Ranker`] adds each candidate alone, optimises, puts the map
//! together at the new poses and scores it; [`Ranker::accept`] keeps those that do not make it worse. A [`Scorer`] may look
//! at the graph alone, too, or at whole maps fused from the log.
//!
//! Bits are the same on every platform and for any number of threads: one optimisation runs on one thread, candidates are
//! tried beside each other. `docs/loops.md` has the definitions and what they are worth.
//!
//! ```
//! use dmp_loops::{OptimiseOptions, optimise};
//! use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
//! use std::collections::{BTreeMap, BTreeSet};
//!
//! // Three steps of a metre, which went 3.3 m as the loop from the first to the last pose says.
//! let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
//! let edge = |from, to, x| {
//!     PoseEdge { from, to, from_from_to: at(x), information: PoseGraph::unit_information() }
//! };
//! let vertices = BTreeMap::from([(0, at(0.0)), (1, at(1.0)), (2, at(2.0)), (3, at(3.0))]);
//! let steps = vec![edge(0, 1, 1.0), edge(1, 2, 1.0), edge(2, 3, 1.0)];
//! let graph = PoseGraph::new(vertices, steps, BTreeSet::new())?;
//! let found = optimise(&graph, &[edge(0, 3, 3.4)], &OptimiseOptions::default())?;
//! assert!(found.converged && (found.world_from_body[3].translation.x - 3.3).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod keyframes;
mod map;
mod optimise;
mod rank;
mod repair;
#[cfg(test)]
mod tests;

pub use error::LoopError;
pub use keyframes::Keyframes;
pub use map::{LoopMap, MapOptions, MapScores};
pub use optimise::{Kernel, OptimiseError, OptimiseOptions, Optimised, optimise};
pub use rank::{
    Acceptance, Decision, Failed, Ranker, Ranking, Scorer, Tried, TryFault, Verdict, Without, in_threads,
    optimised,
};

pub use repair::{Outcome, Repair, RepairOptions, Round, StepError, mend_by, repair};

pub use dmp_reduce::{Estimate, Interval};
