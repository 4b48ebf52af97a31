//! Ranking candidates and accepting some, with the time that took.

use std::time::Instant;

use dmp::Progress;
use dmp_loops::{Acceptance, LoopError, OptimiseOptions, Ranker, Ranking, Scorer, Without};
use dmp_sensor::{PoseEdge, PoseGraph};

/// What was found.
pub(super) struct Ranked {
    pub(super) without: Without,
    pub(super) ranking: Ranking,
    pub(super) accepted: Option<Acceptance>,
    pub(super) rank_s: f64,
    pub(super) accept_s: f64,
}

pub(super) fn rank(
    graph: PoseGraph,
    options: &OptimiseOptions,
    scorer: Scorer<'_>,
    candidates: &[PoseEdge],
    accept: bool,
    progress: &dyn Progress,
) -> Result<Ranked, LoopError> {
    let start = Instant::now();
    let ranker = Ranker::new(graph, options.clone(), scorer, progress)?;
    let without = ranker.without().clone();
    let ranking = ranker.rank(candidates, progress)?;
    let rank_s = start.elapsed().as_secs_f64();
    let accepted = if accept { Some(ranker.accept(candidates, &ranking, progress)?) } else { None };
    let accept_s = start.elapsed().as_secs_f64() - rank_s;
    Ok(Ranked { without, ranking, accepted, rank_s, accept_s })
}
