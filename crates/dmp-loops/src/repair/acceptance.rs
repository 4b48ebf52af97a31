//! Which constraints the map takes.

use dmp::Progress;
use dmp_sensor::{PoseEdge, PoseGraph};

use super::chain::Chain;
use crate::rank::{Ranker, Scorer, Verdict};
use crate::{LoopError, LoopMap, OptimiseOptions};

/// Constraints are of one row whose first ends lie no further apart than so many segments of the way, nor their second ends.
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

/// The graph with the rows that do not make the map worse, optimised. Of a row that may, its halves are tried, down to single
/// constraints: each is in the graph only if the map with it was found not to be worse.
pub(super) fn accepted(
    mut graph: PoseGraph,
    map: &LoopMap,
    mut rows: Vec<Vec<PoseEdge>>,
    options: &OptimiseOptions,
    progress: &dyn Progress,
) -> Result<PoseGraph, LoopError> {
    while !rows.is_empty() {
        let ranker = Ranker::new(graph, options.clone(), Scorer::patches(map), progress)?;
        let ranking = ranker.rank_sets(&rows, progress)?;
        let acceptance = ranker.accept_sets(&rows, &ranking, progress)?;
        if std::env::var_os("DBG").is_some() {
            for d in &acceptance.decisions {
                let m = d.tried.as_ref().and_then(|t| t.map.as_ref());
                eprintln!(
                    "row of {} {:?} {:?}: change {:?}",
                    rows[d.index].len(),
                    rows[d.index].first().map(|e| (e.from, e.to)),
                    d.verdict,
                    m.and_then(|m| m.change)
                );
            }
        }
        graph = acceptance.graph;
        let not_accepted = |one: &crate::Decision| !matches!(one.verdict, Verdict::Accepted);
        let refused = acceptance.decisions.iter().filter(|one| not_accepted(one)).map(|one| one.index);
        let mut refused: Vec<usize> = refused.chain(ranking.failed.iter().map(|one| one.index)).collect();
        refused.sort_unstable();
        let halves = |row: &Vec<PoseEdge>| {
            let (first, second) = row.split_at(row.len() / 2);
            [first.to_vec(), second.to_vec()]
        };
        rows = refused.into_iter().filter(|&k| rows[k].len() > 1).flat_map(|k| halves(&rows[k])).collect();
    }
    Ok(graph)
}
