//! What loop candidates make of a pose graph.
//!
//! # Brief overview
//! A loop candidate is an edge that somebody thinks a [`PoseGraph`](dmp_sensor::PoseGraph) should have. [`optimise`] finds
//! the poses that fit the graph's edges and some more best; `chi2` says how well. Bits are the same on every platform and
//! for any number of threads: one optimisation runs on one thread, candidates are tried beside each other.
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

pub use error::LoopError;
pub use keyframes::Keyframes;
pub use map::{LoopMap, MapOptions};
pub use optimise::{Kernel, OptimiseError, OptimiseOptions, Optimised, optimise};
pub use rank::{
    Acceptance, Decision, Failed, MapScores, Ranker, Ranking, Scorer, Tried, TryFault, Verdict, Without,
    in_threads, optimised,
};

pub use dmp_reduce::{Estimate, Interval};
