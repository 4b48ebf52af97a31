//! Candidates are tried one by one on the same graph.

use dmp::{EvaluateError, Progress, Stage};
use dmp_map::MapError;
use dmp_sensor::{PoseEdge, PoseGraph};
use rayon::prelude::*;

use super::scorer::{Before, Scorer};
use crate::map::MapScores;
use crate::{LoopError, OptimiseError, OptimiseOptions, Optimised, optimise};

/// A graph as it is without candidates, optimised, and what scores its poses.
#[derive(Debug)]
pub struct Ranker<'a> {
    pub(super) graph: PoseGraph,
    pub(super) options: OptimiseOptions,
    pub(super) scorer: Scorer<'a>,
    /// What the scorer compares others with.
    pub(super) before: Before<'a>,
    pub(super) without: Without,
    /// Candidates that were accepted: edges without a robust kernel.
    pub(super) accepted: Vec<PoseEdge>,
}

/// The graph without candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Without {
    /// The sum of squares of its edges.
    pub chi2: f64,
    /// The scores of its map; `None` where no map is looked at.
    pub map: Option<MapScores>,
}

impl Without {
    /// What candidates are compared with: see [`Tried::score`]; without a map the sum of squares has not grown.
    pub(super) fn score(&self) -> f64 {
        self.map.as_ref().and_then(MapScores::ranked_m2).unwrap_or(0.0)
    }
}

/// What a candidate makes of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Its place among the candidates.
    pub index: usize,
    /// How much the sum of squares grew: what it costs the other edges to have this one, and itself.
    pub chi2_change: f64,
    /// Of that, its own squares: what it is still off by.
    pub own_chi2: f64,
    /// How far the pose that moved most did so, metres; and which.
    pub largest_move_m: f64,
    /// The vertex that moved most.
    pub moved_most: i64,
    /// The largest turn of a pose, radians.
    pub largest_turn_rad: f64,
    /// Steps of the optimisation.
    pub iterations: usize,
    /// The scores of the map; `None` where no map is looked at.
    pub map: Option<MapScores>,
}

impl Tried {
    /// What it is ranked by, lower is better: `R_near(2 m)` of the map in square metres, or without a map the growth of the
    /// sum of squares.
    pub fn score(&self) -> f64 {
        self.map.as_ref().and_then(MapScores::ranked_m2).unwrap_or(self.chi2_change)
    }
}

/// Why a candidate has no score.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TryFault {
    /// The graph with it cannot be optimised.
    #[error(transparent)]
    Optimise(#[from] OptimiseError),
    /// The graph with it has no minimum that was found.
    #[error("it does not converge: after {iterations} steps the sum of squares is {chi2}")]
    NotConverged {
        /// Steps that were tried.
        iterations: usize,
        /// The sum of squares after them.
        chi2: f64,
    },
    /// It takes poses out of the world.
    #[error("with it {0}")]
    OutOfWorld(MapError),
    /// The map with it predicts no return.
    #[error("the map with it predicts no return")]
    NoScore,
}

/// A candidate without a score.
#[derive(Debug)]
pub struct Failed {
    /// Its place among the candidates.
    pub index: usize,
    /// Why it has none.
    pub fault: TryFault,
}

/// All candidates, tried one by one on the same graph.
#[derive(Debug)]
pub struct Ranking {
    /// From best to worst; those with one score in the order of the candidates.
    pub ranked: Vec<Tried>,
    /// Those that have no score, in the order of the candidates.
    pub failed: Vec<Failed>,
}

impl<'a> Ranker<'a> {
    /// A graph whose poses fit its edges best already, as [`optimised`] makes it, and who scores poses. Runs in the rayon
    /// pool it is called in, as everything here.
    ///
    /// # Errors
    /// When the poses cannot be scored.
    pub fn new(
        graph: PoseGraph,
        options: OptimiseOptions,
        scorer: Scorer<'a>,
        progress: &dyn Progress,
    ) -> Result<Self, LoopError> {
        let chi2 = optimise(&graph, &[], &options).map_err(LoopError::Graph)?.chi2_after;
        let (before, map) = scorer.begin_at(graph.poses(), progress)?;
        let without = Without { chi2, map };
        Ok(Self { graph, options, scorer, before, without, accepted: Vec::new() })
    }

    /// The graph without candidates.
    pub fn without(&self) -> &Without {
        &self.without
    }

    /// The graph.
    pub fn graph(&self) -> &PoseGraph {
        &self.graph
    }

    /// Tries each candidate alone, several at a time. A candidate is an edge, or several that are accepted together or not at
    /// all.
    ///
    /// # Errors
    /// When no candidate can be scored any more: files that cannot be read, or the caller has cancelled. What is wrong with one
    /// candidate is no error.
    pub fn rank<E: AsRef<[PoseEdge]> + Sync>(
        &self,
        candidates: &[E],
        progress: &dyn Progress,
    ) -> Result<Ranking, LoopError> {
        progress.begin(Stage::Candidates, candidates.len() as u64);
        let one = |(index, candidate): (usize, &E)| {
            let tried = self.try_one(index, candidate.as_ref(), false, progress);
            progress.advance(1);
            tried
        };
        let tried: Vec<_> = if self.scorer.is_parallel() {
            candidates
                .iter()
                .enumerate()
                .collect::<Vec<_>>()
                .into_par_iter()
                .with_max_len(1)
                .map(one)
                .collect()
        } else {
            candidates.iter().enumerate().map(one).collect()
        };
        let mut ranking = Ranking { ranked: Vec::new(), failed: Vec::new() };
        for (index, tried) in tried.into_iter().enumerate() {
            match tried? {
                Ok(tried) => ranking.ranked.push(tried),
                Err(fault) => ranking.failed.push(Failed { index, fault }),
            }
        }
        // Stable: ties stay in the order of the candidates.
        ranking.ranked.sort_by(|a, b| a.score().total_cmp(&b.score()));
        Ok(ranking)
    }

    /// Tries one candidate, `alone` where no other is tried at the time; the inner error is what is wrong with it.
    pub(super) fn try_one(
        &self,
        index: usize,
        candidate: &[PoseEdge],
        alone: bool,
        progress: &dyn Progress,
    ) -> Result<Result<Tried, TryFault>, LoopError> {
        if progress.cancelled() {
            return Err(EvaluateError::Cancelled.into());
        }
        let extra = [self.accepted.as_slice(), candidate].concat();
        let found = match optimise(&self.graph, &extra, &self.options) {
            Ok(found) if found.converged => found,
            Ok(Optimised { iterations, chi2_after: chi2, .. }) => {
                return Ok(Err(TryFault::NotConverged { iterations, chi2 }));
            }
            Err(error) => return Ok(Err(error.into())),
        };
        let map = match self.before.score(&found.world_from_body, alone, progress) {
            Ok(Some(map)) if map.ranked_m2().is_none() => return Ok(Err(TryFault::NoScore)),
            Ok(map) => map,
            Err(
                LoopError::Map(error @ MapError::OutOfWorld { .. })
                | LoopError::Evaluate(EvaluateError::Map {
                    source: error @ MapError::OutOfWorld { .. }, ..
                }),
            ) => return Ok(Err(TryFault::OutOfWorld(error))),
            Err(error) => return Err(error),
        };
        let pairs = || self.graph.poses().iter().zip(&found.world_from_body);
        let moves = pairs().map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        let (most, largest_move_m) =
            moves.enumerate().fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most });
        let turns = pairs().map(|(a, b)| a.rotation.angle_to(&b.rotation));
        Ok(Ok(Tried {
            index,
            chi2_change: found.chi2_after - self.without.chi2,
            own_chi2: found.extra_chi2.iter().skip(self.accepted.len()).sum(),
            largest_move_m,
            moved_most: self.graph.ids()[most],
            largest_turn_rad: turns.fold(0.0, f64::max),
            iterations: found.iterations,
            map,
        }))
    }
}

/// The graph with the poses that fit its edges best, and how they were found.
///
/// # Errors
/// When it cannot be optimised, or does not converge.
pub fn optimised(graph: &PoseGraph, options: &OptimiseOptions) -> Result<(PoseGraph, Optimised), LoopError> {
    let found = optimise(graph, &[], options).map_err(LoopError::Graph)?;
    if !found.converged {
        return Err(LoopError::NotConverged { iterations: found.iterations, chi2: found.chi2_after });
    }
    Ok((graph.with_poses(found.world_from_body.clone())?, found))
}

/// Runs `work` in a pool of threads, which rankers use.
///
/// # Errors
/// When they cannot be started.
pub fn in_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, LoopError> {
    Ok(dmp::in_threads(threads, work)?)
}
