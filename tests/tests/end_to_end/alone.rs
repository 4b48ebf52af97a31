//! What is said of a run does not depend on the runs beside it.

use dmp::{Config, DriftPairs, Report, Run, evaluate, measure_drift};
use dmp_log::{MemoryLog, ScanLog};
use dmp_sensor::{Isometry3, Trajectory};
use dmp_sim::{LidarOptions, RecordingOptions, Route};
use serde_json::{Value, json};

use crate::common::{drift, noise, recorded, runs_of};

/// A lap and a half round a block.
fn laps() -> (MemoryLog, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 120, rate_hz: 4.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 4, scans: 240, route: Route::Loop, speed_m_s: 6.0, traffic: 2, lidar };
    let (scans, truth) = recorded(&options);
    (MemoryLog::new("laps", scans).unwrap(), truth)
}

fn changed(
    run: &Trajectory,
    change: impl Fn(usize, &Isometry3<f64>) -> Option<Isometry3<f64>>,
) -> Trajectory {
    let stamps_ns = run.stamps_ns().unwrap().iter().copied();
    let poses = stamps_ns.zip(run.poses()).enumerate();
    let poses = poses.filter_map(|(k, (ns, pose))| Some((ns, change(k, pose)?)));
    Trajectory::stamped(poses.collect()).unwrap().trajectory
}

/// Runs that may stand beside the truth: good and noisy, drifting, lost, in millimetres, short, and a copy.
fn company(truth: &Trajectory) -> Vec<Run> {
    let half = truth.len() / 2;
    let lost = changed(truth, |k, pose| {
        let away_m = 1.5 * k.saturating_sub(half) as f64;
        Some(Isometry3::translation(away_m, -away_m, 0.1 * away_m) * pose)
    });
    let millimetres = changed(truth, |_, pose| {
        Some(Isometry3::from_parts((pose.translation.vector * 1e3).into(), pose.rotation))
    });
    let short = changed(truth, |k, pose| (k < half).then_some(*pose));
    let mut company = runs_of(truth, &[("noise", noise(0.05, 0.1)), ("drift", drift(1.0))]).split_off(1);
    company.push(Run::new("lost", lost));
    company.push(Run::new("millimetres", millimetres));
    company.push(Run::new("short", short));
    company.push(Run::new("copy", truth.clone()));
    company
}

/// All that the report says of a run.
fn of_run(report: &Report, name: &str) -> Value {
    let json = serde_json::to_value(report).unwrap();
    let named = |list: &Value| -> Value {
        list.as_array().unwrap().iter().find(|run| run["name"] == name).unwrap().clone()
    };
    json!([named(&json["runs"]), named(&json["inputs"]["runs"]), named(&json["drift"]["runs"])])
}

fn score(log: &dyn ScanLog, runs: &[Run]) -> Report {
    evaluate(log, runs, &Config { drift: DriftPairs::All, ..Config::default() }, ()).unwrap()
}

#[test]
fn a_run_has_the_same_numbers_alone_and_in_any_company() {
    let (log, truth) = laps();
    let company = company(&truth);
    let run = Run::new("truth", truth.clone());
    let alone = score(&log, std::slice::from_ref(&run));
    let expected = of_run(&alone, "truth");
    // Beside each of the others, before it and behind it.
    for (k, other) in company.iter().enumerate() {
        let mut both = vec![run.clone(), other.clone()];
        if k % 2 == 1 {
            both.reverse();
        }
        let report = score(&log, &both);
        assert_eq!(of_run(&report, "truth"), expected, "beside {}", other.name);
        assert_eq!(report.config, alone.config, "beside {}", other.name);
    }
    // Beside all of them; and what is said of these is what is said of each alone.
    let all: Vec<Run> = company.iter().cloned().chain([run]).collect();
    let report = score(&log, &all);
    assert_eq!(of_run(&report, "truth"), expected);
    for other in &company {
        let alone = score(&log, std::slice::from_ref(other));
        assert_eq!(of_run(&report, &other.name), of_run(&alone, &other.name), "{}", other.name);
    }
}

#[test]
fn a_lost_run_hides_no_revisit() {
    let (log, truth) = laps();
    let lost = company(&truth).into_iter().find(|run| run.name == "lost").unwrap();
    let runs = [Run::new("truth", truth), lost];
    let drift = |runs: &[Run]| measure_drift(&log, runs, &Config::default(), ()).unwrap().runs.swap_remove(0);
    let alone = drift(&runs[..1]);
    assert!(alone.pairs_found > 3, "{alone:?}");
    assert_eq!(drift(&runs), alone);
}
