//! Real graphs and a real drive, with loops of their own and made-up ones.

use std::collections::{BTreeMap, BTreeSet};

use dmp_log::read_pose_graph;
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};

use super::{average_precision, chain, labels_in_order, ranked, write_candidates, write_graph};
use crate::common::{drift, real_data, trajectory};

/// Numbers that look like chance.
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }

    fn unit(&mut self) -> f64 {
        self.below(1 << 20) as f64 / f64::from(1 << 20)
    }
}

/// The graph's steps, and one edge of each pair of its loops.
fn steps_and_loops(graph: &PoseGraph) -> (Vec<PoseEdge>, Vec<PoseEdge>) {
    let index = |id: i64| graph.index_of(id).unwrap();
    let is_step = |edge: &&PoseEdge| index(edge.from).abs_diff(index(edge.to)) == 1;
    let steps = graph.edges().iter().filter(is_step).cloned().collect();
    let mut loops = BTreeMap::new();
    for edge in graph.edges().iter().filter(|edge| !is_step(edge)) {
        loops.entry((edge.from.min(edge.to), edge.from.max(edge.to))).or_insert_with(|| edge.clone());
    }
    (steps, loops.into_values().collect())
}

/// Loops between vertices that are `far_m` apart at least, measured as if they were at one place.
fn made_up(graph: &PoseGraph, count: usize, far_m: f64, information: &PoseEdge, seed: u64) -> Vec<PoseEdge> {
    let (mut chance, mut found) = (Chance(seed), Vec::new());
    while found.len() < count {
        let [a, b] = [0, 0].map(|_| chance.below(graph.ids().len()));
        let apart_m = (graph.poses()[a].translation.vector - graph.poses()[b].translation.vector).norm();
        if a.abs_diff(b) < 30 || apart_m < far_m {
            continue;
        }
        let [x, y, yaw] = [0, 0, 0].map(|_| 2.0 * chance.unit() - 1.0);
        let from_from_to = Isometry3::new([x, y, 0.0].into(), [0.0, 0.0, 0.1 * yaw].into());
        let (from, to) = (graph.ids()[a.min(b)], graph.ids()[a.max(b)]);
        found.push(PoseEdge { from, to, from_from_to, ..information.clone() });
    }
    found
}

#[test]
fn a_real_graph_without_a_log_ranks_its_loops_before_made_up_ones() {
    let Some(data) = real_data("pose_graphs") else { return };
    let graph = read_pose_graph(&data.join("scdlo_singlesession_posegraph.g2o")).unwrap().graph;
    let (steps, loops) = steps_and_loops(&graph);
    let folder = tempfile::tempdir().unwrap();
    // Of its hundred loops most are of the same pair; and as in the file, without information.
    assert_eq!(loops.len(), 2);
    let pose_of = |pose: &Isometry3<f64>| {
        let [x, y, z] = pose.translation.vector.into();
        let [i, j, k, w]: [f64; 4] = pose.rotation.coords.into();
        format!("{x} {y} {z} {i} {j} {k} {w}\n")
    };
    let line =
        |edge: &PoseEdge| format!("EDGE_SE3:QUAT {} {} {}", edge.from, edge.to, pose_of(&edge.from_from_to));
    let vertices = graph.ids().iter().zip(graph.poses());
    let vertices = vertices.map(|(id, pose)| format!("VERTEX_SE3:QUAT {id} {}", pose_of(pose)));
    let base: String = vertices.chain(steps.iter().map(line)).collect();
    std::fs::write(folder.path().join("graph.g2o"), base).unwrap();
    let wrong = made_up(&graph, 40, 20.0, &loops[0], 1).into_iter().map(|edge| (edge, false));
    let all: Vec<_> = wrong.chain(loops.iter().map(|edge| (edge.clone(), true))).collect();
    write_candidates(folder.path(), "c", &all);
    std::fs::write(folder.path().join("c.g2o"), all.iter().map(|(edge, _)| line(edge)).collect::<String>())
        .unwrap();
    // A made-up one may be between the vertices of another, or bend the graph so that no minimum is found.
    let arguments = "loops graph.g2o --candidates c.g2o --truth c.csv --accept --json --quiet";
    let output = crate::common::dmp(folder.path(), arguments);
    let result = crate::common::json_of(&output);
    let skipped = result["skipped"].as_array().unwrap().len() as u64;
    let without_score = skipped + result["accepted"]["failed"].as_u64().unwrap();
    assert!(without_score <= 3, "{:#}", result["skipped"]);
    assert_eq!(output.status.code(), Some(if without_score > 0 { 3 } else { 0 }));
    assert_eq!(average_precision(&result), 1.0, "{result:#}");
    let accepted = &result["accepted"];
    assert_eq!((&accepted["precision"], &accepted["recall"]), (&1.0.into(), &1.0.into()));
    assert_eq!(result["config"]["loop_kernel"], "Cauchy(1.0)");
}

#[test]
#[ignore = "nightly: a graph with thousands of loops"]
fn a_graph_with_thousands_of_loops_ranks_its_own_before_made_up_ones() {
    let Some(data) = real_data("pose_graphs") else { return };
    let folder = tempfile::tempdir().unwrap();
    let packed = data.join("parking-garage.g2o.gz");
    let unpacked = std::process::Command::new("gzip").arg("-dc").arg(&packed).output().unwrap();
    assert!(unpacked.status.success());
    std::fs::write(folder.path().join("all.g2o"), unpacked.stdout).unwrap();
    let graph = read_pose_graph(&folder.path().join("all.g2o")).unwrap().graph;
    let (steps, loops) = steps_and_loops(&graph);
    assert!(loops.len() > 3000, "{}", loops.len());
    // Every tenth loop stays; of the others 15 are candidates.
    let (kept, mut others): (Vec<_>, Vec<_>) = loops.into_iter().enumerate().partition(|(k, _)| k % 10 == 0);
    let edges = steps.into_iter().chain(kept.into_iter().map(|(_, edge)| edge)).collect();
    let vertices = graph.ids().iter().copied().zip(graph.poses().iter().copied()).collect();
    let base = PoseGraph::new(vertices, edges, BTreeSet::default()).unwrap();
    write_graph(&folder.path().join("graph.g2o"), &base);
    let mut chance = Chance(5);
    let mut all: Vec<_> = (0..15).map(|_| (others.swap_remove(chance.below(others.len())).1, true)).collect();
    all.extend(made_up(&graph, 15, 10.0, &all[0].0.clone(), 6).into_iter().map(|edge| (edge, false)));
    write_candidates(folder.path(), "c", &all);
    let result = ranked(folder.path(), "graph.g2o --candidates c.g2o --truth c.csv", 0);
    assert_eq!(average_precision(&result), 1.0, "{result:#}");
}

/// Loops between passes of the way out and back, true and shuffled: each shuffled one has the measurement of another.
fn of_revisits(poses: &[Isometry3<f64>], count: usize) -> Vec<(PoseEdge, bool)> {
    let place = |k: usize| poses[k].translation.vector;
    let again = |&k: &usize| {
        let far = (k + 60..poses.len())
            .min_by(|a, b| (place(*a) - place(k)).norm().total_cmp(&(place(*b) - place(k)).norm()));
        far.filter(|other| (place(*other) - place(k)).norm() < 3.0).map(|other| (k, other))
    };
    let pairs: Vec<(usize, usize)> = (0..poses.len()).filter_map(|k| again(&k)).collect();
    assert!(pairs.len() >= 2 * count, "{}", pairs.len());
    let pick = |k: usize| pairs[k * (pairs.len() - 1) / (2 * count - 1)];
    let edge = |(from, to): (usize, usize), (a, b): (usize, usize)| PoseEdge {
        from: from as i64,
        to: to as i64,
        from_from_to: poses[a].inv_mul(&poses[b]),
        information: PoseGraph::information_of(0.1, 0.01),
    };
    let right = (0..count).map(|k| (edge(pick(2 * k), pick(2 * k)), true));
    // From one pass to the place that another one saw again.
    let wrong = (0..count).map(|k| {
        let (this, other) = (pick(2 * k + 1), pick((2 * k + 1 + count) % (2 * count)));
        (edge((this.0, other.1), this), false)
    });
    right.chain(wrong).collect()
}

#[test]
#[ignore = "nightly: a real drive twice"]
fn a_real_drive_ranks_its_revisits_before_shuffled_loops() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let run = trajectory(&data.join("poses_lidar_odometry.txt"));
    let folder = tempfile::tempdir().unwrap();
    let candidates = of_revisits(run.poses(), 10);
    write_candidates(folder.path(), "c", &candidates);
    // As it was estimated, and as it would be without its revisits.
    for (name, poses) in [("good", run.clone()), ("drifting", drift(2.0).apply(&run).unwrap())] {
        write_graph(&folder.path().join(format!("{name}.g2o")), &chain(poses.poses(), (0.03, 0.003)));
        let arguments =
            format!("{name}.g2o --candidates c.g2o --truth c.csv --log {}", data.join("scans").display());
        let result = ranked(folder.path(), &arguments, 0);
        let labels = labels_in_order(&result);
        assert_eq!(labels.len(), 20);
        assert!(labels[..10].iter().all(|label| *label), "{name}: {labels:?}");
    }
}
