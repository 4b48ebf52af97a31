//! Ranks loop candidates of a pose graph by the maps that they lead to, and adds those that do no harm:
//! `cargo run --release -p dmp-loops --example rank`.
//!
//! Graph and candidates are made from the sample drive: odometry that drifts, and loops with known labels. For files see
//! `read_pose_graph`, `read_loop_candidates` and `read_keyframe_times` of `dmp-log`.

use std::error::Error;
use std::path::Path;

use dmp::prelude::*;
use dmp_loops::{
    Keyframes, LoopError, LoopMap, MapOptions, OptimiseOptions, Ranker, Scorer, in_threads, optimised,
};
use dmp_sim::{LoopGraph, LoopGraphOptions, SimulatedLoop};

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

fn main() -> Result<(), Box<dyn Error>> {
    let log = open_log(&Path::new(SAMPLES).join("town.mcap"), &LogOptions::default())?;
    let truth = read_trajectory(&Path::new(SAMPLES).join("truth.tum"))?.trajectory;
    let mut made = LoopGraphOptions {
        spacing_m: 2.0,
        // Every keyframe is a scan of the log.
        instants_ns: log.frames().iter().map(|frame| frame.stamp_ns).collect(),
        true_loops: 3,
        false_loops: 3,
        near_loops: 1,
        ..LoopGraphOptions::default()
    };
    // The drive is short: a revisit after 60 m is a loop.
    made.lengths.between_m = 60.0;
    let LoopGraph { graph, truth, candidates } = LoopGraph::new(&truth, &made)?;
    let edges: Vec<_> = candidates.iter().map(|candidate| candidate.edge.clone()).collect();
    let (options, config) = (OptimiseOptions::default(), Config::default());

    // The graph as it is without candidates, and its map: the scans around each keyframe as a patch that stays rigid.
    let (graph, _) = optimised(&graph, &options)?;
    let keyframes = Keyframes::of(&graph, truth.stamps_ns(), log.as_ref(), config.time_offset_ns)?;
    let map = LoopMap::new(log.as_ref(), &keyframes, graph.poses(), &config, MapOptions::default(), &())?;

    // Each candidate alone; then one after the other, those that do not make the map worse.
    let (ranking, acceptance) = in_threads(config.threads, || {
        let ranker = Ranker::new(graph, options, Scorer::patches(&map), &())?;
        let ranking = ranker.rank(&edges, &())?;
        let acceptance = ranker.accept(&edges, &ranking, &())?;
        Ok::<_, LoopError>((ranking, acceptance))
    })??;

    let label = |index: usize| {
        let SimulatedLoop { edge, kind } = &candidates[index];
        format!("{:>3} to {:>3} {kind:6}", edge.from, edge.to)
    };
    println!("from best to worst, by R_near(2 m) of the map:");
    for tried in &ranking.ranked {
        println!("  {} {:.3} m", label(tried.index), tried.score().sqrt());
    }
    println!("one after the other:");
    for decision in &acceptance.decisions {
        println!("  {} {:?}", label(decision.index), decision.verdict);
    }
    println!("{} edges in the graph", acceptance.graph.edges().len());
    Ok(())
}
