//! Which constraints the map takes.

use dmp::Progress;
use dmp_sensor::{PoseEdge, PoseGraph};

use super::chain::Chain;
use crate::rank::{Decision, Ranker, Scorer, Verdict};
use crate::{LoopError, LoopMap, OptimiseOptions, optimise};

/// Constraints form one row where their first ends, and their second ends, are at most this many segments of the path apart.
const SAME_ROW_SEGMENTS: f64 = 3.0;

/// Cuts constraints into rows: those of one passage of one place and another one. What one of a row does, all do.
pub(super) fn rows(chain: &Chain, edges: Vec<PoseEdge>, segment_m: f64) -> Vec<Vec<PoseEdge>> {
    let most_m = SAME_ROW_SEGMENTS * segment_m;
    let mut rows: Vec<Vec<PoseEdge>> = Vec::new();
    for edge in edges {
        let is_near = |a: i64, b: i64| (chain.along_m(a) - chain.along_m(b)).abs() <= most_m;
        let goes_on = |row: &&mut Vec<PoseEdge>| {
            row.last().is_some_and(|last| is_near(last.from, edge.from) && is_near(last.to, edge.to))
        };
        match rows.iter_mut().find(goes_on) {
            Some(row) => row.push(edge),
            None => rows.push(vec![edge]),
        }
    }
    rows
}

/// The graph with the rows that do not make the map worse, optimised.
///
/// A row is taken as `dmp loops --accept` takes a candidate: where by the interval of its change the map gets no worse. A drive that
/// comes back at few places has wide intervals, and it is the gain itself that makes them so; so several constraints that agree with
/// each other are taken as well where the map with them is better by its value. Of other rows the halves are tried, down to single
/// constraints.
pub(super) fn accepted(
    mut graph: PoseGraph,
    map: &LoopMap,
    mut rows: Vec<Vec<PoseEdge>>,
    options: &OptimiseOptions,
    progress: &dyn Progress,
) -> Result<PoseGraph, LoopError> {
    while !rows.is_empty() {
        let ranker = Ranker::new(graph, options.clone(), Scorer::patches(map), progress)?;
        let ranking = ranker.rank(&rows, progress)?;
        let acceptance = ranker.accept(&rows, &ranking, progress)?;
        graph = acceptance.graph;
        let mut refused: Vec<(usize, bool)> = ranking.failed.iter().map(|one| (one.index, false)).collect();
        refused.extend(acceptance.decisions.iter().filter(|one| !is_accepted(one)).map(|one| {
            let map = one.tried.as_ref().and_then(|tried| tried.map.as_ref());
            (one.index, map.and_then(|map| map.change).is_some_and(|change| change.value_m2 < 0.0))
        }));
        refused.sort_unstable();
        let mut halves = Vec::new();
        for (index, has_gained) in refused {
            let row = &rows[index];
            if row.len() < 2 {
                continue;
            }
            let better = if has_gained { better_with(&graph, map, row, options, progress)? } else { None };
            if let Some(better) = better {
                graph = better;
            } else {
                let (first, second) = row.split_at(row.len() / 2);
                halves.extend([first.to_vec(), second.to_vec()]);
            }
        }
        rows = halves;
    }
    Ok(graph)
}

fn is_accepted(decision: &Decision) -> bool {
    matches!(decision.verdict, Verdict::Accepted)
}

/// The graph with a row, optimised, where its map is better by its value.
fn better_with(
    graph: &PoseGraph,
    map: &LoopMap,
    row: &[PoseEdge],
    options: &OptimiseOptions,
    progress: &dyn Progress,
) -> Result<Option<PoseGraph>, LoopError> {
    let with = row.iter().try_fold(graph.clone(), |graph, edge| graph.with_edge(edge.clone()))?;
    let found = optimise(&with, &[], options).map_err(LoopError::Graph)?;
    let ranker = Ranker::new(graph.clone(), options.clone(), Scorer::patches(map), progress)?;
    let is_better = ranker.compared(&found.world_from_body, progress)?.is_better();
    Ok(if found.converged && is_better { Some(with.with_poses(found.world_from_body)?) } else { None })
}
