//! `dmp loops`: true candidates before false ones, whatever the threads, and what is wrong is named.

mod bad_candidates;
mod graph_alone;
mod real_graphs;
mod simulated;

use std::collections::BTreeSet;
use std::path::Path;

use dmp_log::{write_pose_edges, write_pose_graph};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use serde_json::Value;

use crate::common::{ends, json_of};

/// The JSON of a command that ends with `code`.
fn ranked(folder: &Path, arguments: &str, code: i32) -> Value {
    let result = json_of(&ends(folder, &format!("loops {arguments} --json --quiet"), code));
    assert_eq!(result["schema"], "dmp-loops/1");
    result
}

fn labels_in_order(result: &Value) -> Vec<bool> {
    result["candidates"].as_array().unwrap().iter().map(|one| one["label"].as_bool().unwrap()).collect()
}

fn average_precision(result: &Value) -> f64 {
    result["truth"]["average_precision"].as_f64().unwrap()
}

/// A graph that goes from pose to pose, with these standard deviations.
fn chain(world_from_body: &[Isometry3<f64>], errors: (f64, f64)) -> PoseGraph {
    let step = |k: usize| PoseEdge {
        from: k as i64,
        to: k as i64 + 1,
        from_from_to: world_from_body[k].inv_mul(&world_from_body[k + 1]),
        information: PoseGraph::information_of(errors.0, errors.1),
    };
    let steps = (0..world_from_body.len() - 1).map(step).collect();
    let vertices = (0..).zip(world_from_body.iter().copied()).collect();
    PoseGraph::new(vertices, steps, BTreeSet::default()).unwrap()
}

fn write_graph(path: &Path, graph: &PoseGraph) {
    let mut lines = Vec::new();
    write_pose_graph(&mut lines, graph).unwrap();
    std::fs::write(path, lines).unwrap();
}

/// Candidates and their labels, `NAME.g2o` and `NAME.csv`.
fn write_candidates(folder: &Path, name: &str, candidates: &[(PoseEdge, bool)]) {
    let edges: Vec<PoseEdge> = candidates.iter().map(|one| one.0.clone()).collect();
    let mut lines = Vec::new();
    write_pose_edges(&mut lines, &edges).unwrap();
    std::fs::write(folder.join(format!("{name}.g2o")), lines).unwrap();
    let labels = candidates.iter().map(|(edge, label)| format!("{},{},{label}\n", edge.from, edge.to));
    std::fs::write(folder.join(format!("{name}.csv")), labels.collect::<String>()).unwrap();
}
