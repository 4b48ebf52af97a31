//! Ranks loop candidates of a pose graph by the maps that they lead to, and adds those that do no harm:
//! `cargo run --release -p dmp-loops --example rank -- [GRAPH.g2o CANDIDATES.g2o LOG [TIMES]]`.
//!
//! Without files, graph and candidates are made up of the sample drive: odometry that drifts, and loops of which is known
//! which are true.

use std::error::Error;
use std::path::Path;

use dmp::prelude::*;
use dmp_log::{read_keyframe_times, read_loop_candidates, read_pose_graph};
use dmp_loops::{
    Keyframes, LoopError, LoopMap, MapOptions, OptimiseOptions, Ranker, Scorer, Verdict, in_threads,
    optimised,
};
use dmp_sensor::{PoseEdge, PoseGraph};
use dmp_sim::{LoopGraph, LoopGraphOptions};

const SAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data-samples");

/// What is to be ranked.
struct Task {
    log: Box<dyn ScanLog>,
    graph: PoseGraph,
    /// When each vertex was; `None` where every scan of the log is one.
    stamps_ns: Option<Vec<i64>>,
    /// The candidates, and what is known of them.
    candidates: Vec<PoseEdge>,
    known: Vec<String>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let Task { log, graph, stamps_ns, candidates, known } = match files.as_slice() {
        [] => made_up()?,
        [graph, candidates, log, times @ ..] => read(graph, candidates, log, times.first())?,
        _ => return Err("usage: rank [GRAPH.g2o CANDIDATES.g2o LOG [TIMES]]".into()),
    };
    let (options, config) = (OptimiseOptions::default(), Config::default());

    // The graph as it is without candidates, and its map: the scans around each keyframe as a patch that stays rigid.
    let (graph, _) = optimised(&graph, &options)?;
    let keyframes = Keyframes::of(&graph, stamps_ns.as_deref(), log.as_ref(), config.time_offset_ns)?;
    let map = LoopMap::new(log.as_ref(), &keyframes, graph.poses(), &config, MapOptions::default(), &())?;

    // Each candidate by itself; then one after the other, those that do not make the map worse.
    let (without, ranking, acceptance) = in_threads(config.threads, || {
        let ranker = Ranker::new(graph, options, Scorer::patches(&map), &())?;
        let without = ranker.without().clone();
        let ranking = ranker.rank(&candidates, &())?;
        let acceptance = ranker.accept(&candidates, &ranking, &())?;
        Ok::<_, LoopError>((without, ranking, acceptance))
    })??;

    let told = |index: usize| {
        let PoseEdge { from, to, .. } = &candidates[index];
        format!("{from:>3} to {to:>3} {:6}", known.get(index).map_or("", String::as_str))
    };
    println!("from best to worst, by R_near(2 m) of the map:");
    if let Some(m2) = without.map.and_then(|map| map.ranked_m2()) {
        println!("  without any candidate {:.3} m", m2.sqrt());
    }
    for tried in &ranking.ranked {
        println!("  {} {:.3} m", told(tried.index), tried.score().sqrt());
    }
    for failed in &ranking.failed {
        println!("  {} no score: {}", told(failed.index), failed.fault);
    }
    println!("one after the other:");
    for decision in &acceptance.decisions {
        let verdict = match &decision.verdict {
            Verdict::Accepted => "accepted".to_owned(),
            Verdict::Worse => "the map becomes worse".to_owned(),
            Verdict::Failed(fault) => fault.to_string(),
        };
        println!("  {} {verdict}", told(decision.index));
    }
    println!("{} edges in the graph", acceptance.graph.edges().len());
    Ok(())
}

/// From files.
fn read(graph: &str, candidates: &str, log: &str, times: Option<&String>) -> Result<Task, Box<dyn Error>> {
    let file = read_pose_graph(Path::new(graph))?;
    let found = read_loop_candidates(Path::new(candidates), &file)?;
    let times = times.map(|times| read_keyframe_times(Path::new(times))).transpose()?;
    Ok(Task {
        log: open_log(Path::new(log), &LogOptions::default())?,
        stamps_ns: times.map(|times| times.of_vertices(file.graph.ids())).transpose()?,
        graph: file.graph,
        candidates: found.candidates.into_iter().map(|candidate| candidate.edge).collect(),
        known: Vec::new(),
    })
}

/// Of the sample drive, with a keyframe every 2 m or so.
fn made_up() -> Result<Task, Box<dyn Error>> {
    let samples = Path::new(SAMPLES);
    let log = open_log(&samples.join("town.mcap"), &LogOptions::default())?;
    let truth = read_trajectory(&samples.join("truth.tum"))?.trajectory;
    let mut options = LoopGraphOptions {
        spacing_m: 2.0,
        // Every keyframe is a scan of the log.
        instants_ns: log.frames().iter().map(|frame| frame.stamp_ns).collect(),
        true_loops: 3,
        false_loops: 3,
        near_loops: 1,
        ..LoopGraphOptions::default()
    };
    // It is a short drive: to come back after 60 m is a loop.
    options.lengths.between_m = 60.0;
    let LoopGraph { graph, truth, candidates } = LoopGraph::new(&truth, &options)?;
    Ok(Task {
        log,
        graph,
        stamps_ns: truth.stamps_ns().map(<[i64]>::to_vec),
        known: candidates.iter().map(|candidate| candidate.kind.to_string()).collect(),
        candidates: candidates.into_iter().map(|candidate| candidate.edge).collect(),
    })
}
