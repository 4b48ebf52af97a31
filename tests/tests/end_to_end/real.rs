//! Real recordings, with wrong trajectories whose order is known.

use dmp::{Config, Pairing, Run, Verdict};
use dmp_sim::SlamErrors;

use crate::common::{collapse, drift, noise, plain, real_data, runs_of, score, trajectory};

/// The good run beats every wrong one, and no pair is decided the wrong way.
fn ladder(seeds: std::ops::RangeInclusive<u64>, voxel_m: Option<f64>, every: usize) {
    let Some(data) = real_data("nclt_revisit") else { return };
    let truth = trajectory(&data.join("poses_lidar_odometry.txt"));
    let ladder = [
        ("noise", noise(0.03, 0.1)),
        ("drift 0.3", drift(0.3)),
        ("drift 1", drift(1.0)),
        ("drift 3", drift(3.0)),
        ("collapsed", collapse(0.5)),
    ];
    for seed in seeds {
        let of_seed = ladder.clone().map(|(name, errors)| (name, SlamErrors { seed, ..errors }));
        let runs = runs_of(&truth, &of_seed);
        let report = score(&data, &runs, &Config { voxel_m, every, ..plain() });
        assert_eq!(report.order[0], "truth");
        // Every return of the files, none lost.
        if every == 1 {
            assert_eq!(report.inputs.returns, 1_171_439);
        }
        assert_eq!(report.inputs.scans_used, 326_usize.div_ceil(every));
        assert!(report.inputs.runs.iter().all(|run| run.pairing == Pairing::ByLine));
        for pair in report.pairs {
            let names = format!("{} and {}, seed {seed}", pair.a, pair.b);
            let is_ranked = pair.a == "truth" || pair.a.starts_with("drift") && pair.b.starts_with("drift");
            match pair.verdict {
                Verdict::Better { run, .. } if is_ranked => assert_eq!(run, pair.a, "{names}"),
                Verdict::Better { .. } => {}
                verdict => assert!(pair.a != "truth", "{names}: {verdict}"),
            }
        }
    }
}

#[test]
fn a_ladder_of_errors_on_an_out_and_back_drive() {
    ladder(1..=1, Some(0.3), 3);
}

#[test]
#[ignore = "nightly: ten scores of six runs over a real drive"]
fn a_ladder_of_errors_for_five_seeds() {
    ladder(1..=5, None, 1);
    ladder(1..=5, Some(0.2), 1);
}

#[test]
fn a_robot_that_stands_still_shows_the_noise_floor() {
    let Some(data) = real_data("rs32_static") else { return };
    let runs = [Run::new("icp", trajectory(&data.join("poses_icp_odom.txt")))];
    for (voxel_m, most_m) in [(0.1, 0.10), (0.2, 0.15)] {
        let report = score(&data, &runs, &Config { voxel_m: Some(voxel_m), ..plain() });
        assert!(report.inputs.point_times.is_some(), "this log has a time for each point");
        assert_eq!(report.inputs.runs[0].segments.length_m, None, "every scan is a segment of its own");
        let floor_m = report.runs[0].r_near_m2[2].unwrap().sqrt();
        assert!(floor_m < most_m, "voxel {voxel_m} m: {floor_m} m");
        // The last sweep ends after the last pose: those returns have none, and nothing is extrapolated.
        let unposed = report.inputs.returns_used - report.runs[0].returns - report.runs[0].returns_left_out;
        assert!(unposed > 0 && unposed < report.inputs.returns / 14);
    }
}

/// A vehicle drives beside the sensor all the way: its trail would block four of ten returns.
#[test]
fn traffic_hides_no_order() {
    let Some(data) = real_data("udacity22") else { return };
    let names = ["gicp_model", "D_rigid", "kiss", "kiss_r20", "gicp_scan_v1"];
    let runs = names.map(|name| Run::new(name, trajectory(&data.join(format!("poses_{name}.tum")))));
    let report = score(&data.join("scans"), &runs, &plain());
    assert!(report.runs.iter().all(|run| run.blocked_rate.unwrap() < 0.15));
    // The second is the first, moved as one piece. The other orders were known by registration.
    for pair in &report.pairs {
        let first = names.iter().position(|name| *name == pair.a);
        match (first, pair.b.as_str()) {
            (Some(0), "D_rigid") => assert!(matches!(pair.verdict, Verdict::Same), "{pair:?}"),
            (Some(0 | 1), _) => {
                assert!(matches!(&pair.verdict, Verdict::Better { run, .. } if *run == pair.a), "{pair:?}");
            }
            (Some(2), "kiss_r20") => {
                assert!(!matches!(&pair.verdict, Verdict::Better { run, .. } if *run != pair.a), "{pair:?}");
            }
            _ => {}
        }
    }
}
