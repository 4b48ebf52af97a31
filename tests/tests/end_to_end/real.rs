//! Real recordings, with wrong trajectories whose order is known.

use std::collections::BTreeMap;

use dmp::{Config, Pairing, Run, Verdict};
use dmp_log::read_trajectory;
use dmp_sim::SlamErrors;

use crate::common::{collapse, drift, noise, real_data, runs_of, score};

/// Seeds of the wrong trajectories: several, so that no single lucky one makes the case.
const SEEDS: u64 = 5;

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
    for voxel_m in [None, Some(0.2)] {
        let mut verdicts: BTreeMap<(usize, usize), [Vec<String>; 4]> = BTreeMap::new();
        for seed in 1..=SEEDS {
            let of_seed = ladder.clone().map(|(name, errors)| (name, SlamErrors { seed, ..errors }));
            let runs = runs_of(&truth, &of_seed);
            let report = score(&data, &runs, &Config { voxel_m, ..Config::default() });
            assert_eq!(report.order[0], "truth");
            // Every return of the files, none lost.
            assert_eq!(report.inputs.returns_used, report.inputs.returns);
            assert_eq!(report.inputs.scans_used, 326);
            assert!(report.inputs.runs.iter().all(|run| run.pairing == Pairing::ByLine));
            let rank = |name: &str| runs.iter().position(|run| run.name == name).unwrap();
            for pair in &report.pairs {
                let kind = match &pair.verdict {
                    Verdict::Undecided | Verdict::Same => 3,
                    Verdict::Mixed { .. } => 2,
                    Verdict::Better { run, .. } => usize::from(*run != pair.a),
                };
                let scale = pair.verdict.decided_at_m().map_or(String::new(), |m| format!("{m} m"));
                verdicts.entry((rank(&pair.a), rank(&pair.b))).or_default()[kind].push(scale);
            }
        }
        let names: Vec<&str> = std::iter::once("truth").chain(ladder.iter().map(|run| run.0)).collect();
        println!(
            "voxel {}: verdicts over {SEEDS} seeds (deciding scales)",
            voxel_m.map_or("auto".into(), |m| format!("{m} m"))
        );
        for ((a, b), [right, wrong, mixed, undecided]) in &verdicts {
            let told = |word: &str, scales: &[String]| match scales {
                [] => String::new(),
                _ => format!("  {} {word} {}", scales.len(), scales.join(" ").trim()),
            };
            let counts = [
                told("right", right),
                told("WRONG", wrong),
                told("mixed", mixed),
                told("undecided", undecided),
            ];
            println!("  {:9} / {:9} {}", names[*a], names[*b], counts.concat());
            assert!(wrong.is_empty(), "{} against {} was decided the wrong way", names[*a], names[*b]);
            assert!(*a > 0 || right.len() as u64 == SEEDS, "the good one beats {} for every seed", names[*b]);
        }
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
        let floor_m = report.runs[0].r_near_m2[2].unwrap().sqrt();
        println!("voxel {voxel_m} m: square root of R_near(0.5) is {floor_m:.3} m");
        floors_m.push(floor_m);
        // The last sweep ends after the last pose: those returns have none, and nothing is extrapolated.
        let no_pose = report.inputs.dropped.0["no_pose"];
        assert!(no_pose > 0 && no_pose < report.inputs.returns / 14);
    }
    assert!(floors_m[0] < 0.10 && floors_m[1] < 0.15, "{floors_m:?}");
}
