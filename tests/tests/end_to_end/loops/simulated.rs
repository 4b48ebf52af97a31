//! Candidates of known kind on a simulated drive.

use std::path::Path;

use dmp_log::{read_pose_graph, read_trajectory};
use dmp_sensor::Trajectory;
use serde_json::Value;
use tempfile::TempDir;

use super::{average_precision, comparable, labels_in_order, ranked};
use crate::common::{dmp, text};

/// A drive twice round the same blocks, its graph without loops, and candidates.
fn drive() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        "simulate town -o drive --scans 500 --azimuth-steps 80 --seed 3",
        "simulate loops drive.truth.tum --keyframes drive/times.txt --spacing 0.9m -o loops",
    ] {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    folder
}

const RANK: &str = "loops/graph.g2o --candidates loops/candidates.g2o --log drive --keyframes loops/keyframes.txt \
                    --truth loops/labels.csv";

#[test]
fn patches_rank_as_whole_maps_do_whatever_the_threads_and_the_memory() {
    let folder = drive();
    let fast = ranked(folder.path(), RANK, 0);
    let direct = ranked(folder.path(), &format!("{RANK} --direct"), 0);
    assert!(average_precision(&fast) >= 0.97, "{fast:#}");
    assert!((average_precision(&fast) - average_precision(&direct)).abs() <= 0.005);
    let numbers = |result: &Value, of: fn(&Value) -> Option<f64>| -> Vec<(i64, f64)> {
        let candidates = result["candidates"].as_array().unwrap();
        let mut all: Vec<_> =
            candidates.iter().map(|one| (one["from"].as_i64().unwrap(), of(one).unwrap())).collect();
        all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        all
    };
    let near = |one: &Value| one["r_near_m2"]["2"].as_f64();
    for (fast, direct) in numbers(&fast, near).iter().zip(numbers(&direct, near)) {
        assert!((fast.1 / direct.1 - 1.0).abs() < 0.15, "{fast:?} {direct:?}");
    }
    // The graph is the same for both.
    let of_graph = |one: &Value| one["chi2_change"].as_f64();
    assert_eq!(numbers(&fast, of_graph), numbers(&direct, of_graph));

    let other = ranked(folder.path(), &format!("{RANK} --threads 1 --memory 80MiB"), 0);
    assert_eq!(comparable(fast.clone()), comparable(other));
    // Casting everything anew, also where hardly anything moved, changes next to nothing.
    let all = ranked(folder.path(), &format!("{RANK} --moved 0"), 0);
    assert!(all["candidates"].as_array().unwrap().iter().all(|one| one["cast_share"] == 1.0));
    for (fast, all) in numbers(&fast, near).iter().zip(numbers(&all, near)) {
        assert!((fast.1 / all.1 - 1.0).abs() < 0.01, "{fast:?} {all:?}");
    }
}

/// Places of two trajectories of one world and one start, apart in the mean.
fn mean_apart_m(a: &Trajectory, b: &Trajectory) -> f64 {
    assert_eq!(a.stamps_ns(), b.stamps_ns());
    let apart =
        a.poses().iter().zip(b.poses()).map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
    apart.sum::<f64>() / a.len() as f64
}

fn trajectory(path: &Path) -> Trajectory {
    read_trajectory(path).unwrap().trajectory
}

#[test]
fn accepted_loops_make_the_trajectory_better() {
    let folder = drive();
    let save = "--accept --save-graph better.g2o --save-trajectory better.tum --svg curve.svg";
    let result = ranked(folder.path(), &format!("{RANK} {save}"), 0);
    let accepted = &result["accepted"];
    let count = accepted["accepted"].as_u64().unwrap();
    assert_eq!(accepted["decisions"].as_array().unwrap().len(), 26);
    assert!(
        accepted["precision"].as_f64().unwrap() >= 0.8 && accepted["recall"].as_f64().unwrap() >= 0.8,
        "{accepted:#}"
    );
    let [before, after] =
        [&result["without"]["r_near_m2"]["2"], &accepted["r_near_m2"]].map(|m2| m2.as_f64().unwrap());
    assert!(after < before, "{before} {after}");

    let at = |name: &str| folder.path().join(name);
    let [graph, better] =
        ["loops/graph.g2o", "better.g2o"].map(|name| read_pose_graph(&at(name)).unwrap().graph);
    assert_eq!(better.edges().len() as u64, graph.edges().len() as u64 + count);
    let (truth, saved) = (trajectory(&at("loops/truth.tum")), trajectory(&at("better.tum")));
    let poses = better.poses().to_vec();
    let better =
        Trajectory::stamped(saved.stamps_ns().unwrap().iter().copied().zip(poses).collect()).unwrap();
    assert!(mean_apart_m(&better.trajectory, &saved) < 1e-6);
    let odometry = Trajectory::stamped(
        truth.stamps_ns().unwrap().iter().copied().zip(graph.poses().iter().copied()).collect(),
    );
    let [before_m, after_m] = [&odometry.unwrap().trajectory, &saved].map(|run| mean_apart_m(run, &truth));
    assert!(after_m < 0.5 * before_m, "{before_m} {after_m}");

    let curve = std::fs::read_to_string(at("curve.svg")).unwrap();
    assert!(curve.starts_with("<svg") && curve.contains("average precision"));
    // The table has them from best to worst, with their labels.
    let output = dmp(folder.path(), &format!("loops {RANK} --quiet"));
    let table = text(&output.stdout);
    let rows: Vec<bool> = table
        .lines()
        .filter(|line| line.ends_with(" true") || line.ends_with(" false"))
        .map(|line| line.ends_with(" true"))
        .collect();
    assert_eq!(rows, labels_in_order(&result), "{table}");
    assert!(table.contains("average precision") && table.contains("R_near 2 m"), "{table}");
}
