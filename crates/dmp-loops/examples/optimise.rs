//! Optimises a pose graph, then with each of a hundred made-up loops in turn, and says how long that took:
//! `cargo run --release -p dmp-loops --example optimise -- GRAPH.g2o [START]`, where START is a trajectory with the poses to
//! start from.

use dmp_log::{read_pose_graph, read_trajectory};
use dmp_loops::{OptimiseOptions, optimise};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [graph, start @ ..] = arguments.as_slice() else {
        return Err("usage: optimise GRAPH.g2o [START]".into());
    };
    let mut graph = read_pose_graph(Path::new(graph))?.graph;
    if let [start, ..] = start {
        graph = graph.with_poses(read_trajectory(Path::new(start))?.trajectory.poses().to_vec())?;
    }
    let options = OptimiseOptions::default();
    let time = Instant::now();
    let found = optimise(&graph, &[], &options)?;
    println!(
        "{} vertices, {} edges: chi2 {} to {} in {} iterations and {:.1} ms{}",
        graph.ids().len(),
        graph.edges().len(),
        found.chi2_before,
        found.chi2_after,
        found.iterations,
        time.elapsed().as_secs_f64() * 1e3,
        if found.converged { "" } else { ", not converged" }
    );
    let graph = graph.with_poses(found.world_from_body)?;
    let (mut slowest_ms, mut most_iterations, mut failed) = (0.0_f64, 0, 0);
    let time = Instant::now();
    for k in 0..100 {
        let one = Instant::now();
        let found = optimise(&graph, &[made_up_loop(&graph, k)], &options)?;
        slowest_ms = slowest_ms.max(one.elapsed().as_secs_f64() * 1e3);
        most_iterations = most_iterations.max(found.iterations);
        failed += usize::from(!found.converged);
    }
    let mean_ms = time.elapsed().as_secs_f64() * 10.0;
    println!(
        "100 loops: {mean_ms:.1} ms each, at most {slowest_ms:.1} ms and {most_iterations} iterations, {failed} not converged"
    );
    Ok(())
}

/// A loop between two vertices far apart in the order, every second one wrong by metres.
fn made_up_loop(graph: &PoseGraph, k: usize) -> PoseEdge {
    let count = graph.ids().len();
    let (from, to) = (k * count / 400, count - 1 - (k * 7919) % (count / 3));
    let off_m = if k.is_multiple_of(2) { 0.1 } else { 5.0 };
    let from_from_to =
        graph.poses()[from].inv_mul(&graph.poses()[to]) * Isometry3::translation(off_m, 0.0, 0.0);
    let information = graph.edges().first().map_or_else(PoseGraph::unit_information, |edge| edge.information);
    PoseEdge { from: graph.ids()[from], to: graph.ids()[to], from_from_to, information }
}
