//! Real recordings, with wrong trajectories whose order is known.

use dmp::{Config, Run};
use dmp_log::read_trajectory;

use crate::common::{collapse, decided, drift, noise, real_data, runs_of, score};

#[test]
fn a_ladder_of_errors_on_an_out_and_back_drive() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let truth = read_trajectory(&data.join("poses_lidar_odometry.txt")).unwrap().trajectory;
    let ladder = [
        ("noise", noise(0.03, 0.1)),
        ("drift 0.3", drift(0.3)),
        ("drift 1", drift(1.0)),
        ("drift 3", drift(3.0)),
        ("collapsed", collapse(0.5)),
    ];
    let runs = runs_of(&truth, &ladder);
    for voxel_m in [None, Some(0.2)] {
        let report = score(&data, &runs, &Config { voxel_m, ..Config::default() });
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        if voxel_m.is_none() {
            assert_eq!(report.order, names, "from good to bad");
        }
        assert_eq!(report.order[0], "truth");

        let rank = |name: &str| names.iter().position(|n| *n == name).unwrap();
        let decided = decided(&report);
        assert!(decided.iter().all(|(better, worse)| rank(better) < rank(worse)), "{decided:?}");
        let against_truth = decided.iter().filter(|(better, _)| *better == "truth").count();
        assert_eq!(against_truth, ladder.len(), "the good one beats every other: {decided:?}");
        for pair in report.pairs.iter().filter(|pair| pair.decided_at_m.is_some()) {
            assert!([10.0, 2.0, 0.5, 0.2].contains(&pair.decided_at_m.unwrap()), "{pair:?}");
            println!("voxel {:.1} m: {} / {}: {}", report.config.voxel_m, pair.a, pair.b, pair.reason);
        }
        // Every return of the files, none lost.
        assert_eq!(report.inputs.returns_used, report.inputs.returns);
        assert_eq!(report.inputs.scans_used, 326);
        assert!(report.inputs.runs.iter().all(|run| run.pairing == "line by line"));
    }
}

#[test]
fn a_robot_that_stands_still_shows_the_noise_floor() {
    let Some(data) = real_data("rs32_static") else { return };
    let trajectory = read_trajectory(&data.join("poses_icp_odom.txt")).unwrap().trajectory;
    let runs = [Run::new("icp", trajectory)];
    let mut floors_m = Vec::new();
    for voxel_m in [0.1, 0.2] {
        let report = score(&data, &runs, &Config { voxel_m: Some(voxel_m), ..Config::default() });
        assert!(report.inputs.point_times.is_some(), "this log has a time for each point");
        assert_eq!(report.config.segments.length_m, None, "every scan is a segment of its own");
        let floor_m = report.runs[0].r_near_m2.at_0_5.unwrap().sqrt();
        println!("voxel {voxel_m} m: square root of R_near(0.5) is {floor_m:.3} m");
        floors_m.push(floor_m);
        // The last sweep ends after the last pose: those returns have none, and nothing is extrapolated.
        let no_pose = report.inputs.dropped.0["no_pose"];
        assert!(no_pose > 0 && no_pose < report.inputs.returns / 14);
    }
    assert!(floors_m[0] < 0.10 && floors_m[1] < 0.15, "{floors_m:?}");
}
