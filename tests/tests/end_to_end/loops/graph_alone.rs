//! Without a log.

use dmp_log::{TrajectoryFormat, read_pose_graph, read_trajectory};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};

use super::{chain, ranked, write_candidates, write_graph};
use crate::common::write;

/// Where keyframes have times, the trajectory has them too, though no log was read.
#[test]
fn times_of_keyframes_are_those_of_the_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let poses: Vec<_> = (0..5).map(|k| Isometry3::translation(f64::from(k), 0.0, 0.0)).collect();
    write_graph(&at("graph.g2o"), &chain(&poses, (0.1, 0.01)));
    let information = PoseGraph::information_of(0.1, 0.01);
    // 20 cm less than the steps say.
    let shorter =
        PoseEdge { from: 0, to: 4, from_from_to: Isometry3::translation(3.8, 0.0, 0.0), information };
    write_candidates(folder.path(), "c", &[(shorter, true)]);
    // In any order, and at no steady pace.
    write(folder.path(), "keyframes.txt", "4 107.75\n0 100.5\n1 101\n3 104.125\n2 103\n");
    let save = "graph.g2o --candidates c.g2o --accept --save-graph better.g2o --save-trajectory";

    let result = ranked(folder.path(), &format!("{save} better.tum --keyframes keyframes.txt"), 0);
    assert_eq!(
        (&result["config"]["ranked_by"], &result["accepted"]["accepted"]),
        (&"graph".into(), &1.into())
    );
    let saved = read_trajectory(&at("better.tum")).unwrap();
    assert_eq!(saved.format, TrajectoryFormat::Tum);
    let stamps_ns = [100_500_000_000, 101_000_000_000, 103_000_000_000, 104_125_000_000, 107_750_000_000];
    assert_eq!(saved.trajectory.stamps_ns(), Some(&stamps_ns[..]));
    let better = read_pose_graph(&at("better.g2o")).unwrap().graph;
    let apart = |pose: &Isometry3<f64>, saved: &Isometry3<f64>| {
        (pose.translation.vector - saved.translation.vector).norm()
    };
    let pairs = || better.poses().iter().zip(saved.trajectory.poses());
    assert!(pairs().all(|(pose, saved)| apart(pose, saved) < 1e-6));
    assert!((apart(&better.poses()[0], &better.poses()[4]) - 3.84).abs() < 1e-6);

    // Without times it has none.
    ranked(folder.path(), &format!("{save} better.txt"), 0);
    let saved = read_trajectory(&at("better.txt")).unwrap();
    assert_eq!((saved.format, saved.trajectory.stamps_ns()), (TrajectoryFormat::Kitti, None));
}
