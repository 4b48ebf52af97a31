//! Equal maps are called equal: runs that differ by nothing but where their world lies, or by luck, in one command, and
//! runs that differ beside them. `cargo xtask study null` does the same at length.

use dmp::{Config, Frame, Report, Run};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion};
use dmp_sim::SlamErrors;

use crate::common::{drift, noise, plain, real_data, save_tum, score, small_town, trajectory, write_mcap};

/// A log, and a good run on it.
struct Known {
    log: std::path::PathBuf,
    base: Trajectory,
    _folder: tempfile::TempDir,
}

fn town() -> Known {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_mcap(&log, &scans);
    Known { log, base: truth, _folder: folder }
}

fn real_drive() -> Option<Known> {
    let log = real_data("nclt_revisit")?;
    let base = trajectory(&log.join("poses_lidar_odometry.txt"));
    Some(Known { log, base, _folder: tempfile::tempdir().unwrap() })
}

fn world(place: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// Worlds as systems have them: at the first pose, level somewhere, tilted, in UTM, upside down.
fn worlds() -> [Isometry3<f64>; 6] {
    [
        Isometry3::identity(),
        world([0.31, -0.77, 0.49], [0.0; 3]),
        world([-12.3, 45.6, 7.8], [0.0, 0.0, 2.1]),
        world([4.0, 0.1, -9.0], [0.04, -0.05, -0.7]),
        world([432_100.25, 4_649_776.5, 120.125], [0.01, 0.02, 0.9]),
        world([1.0, 2.0, 3.0], [std::f64::consts::PI, 0.0, 0.3]),
    ]
}

/// The trajectory as its file has it, with nine decimals.
fn from_a_file(run: &Trajectory) -> Trajectory {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    save_tum(&path, run);
    trajectory(&path)
}

fn runs(trajectories: impl IntoIterator<Item = (String, Trajectory)>) -> Vec<Run> {
    trajectories.into_iter().map(|(name, trajectory)| Run::new(name, trajectory)).collect()
}

fn verdicts(report: &Report) -> Vec<(&str, &str, String)> {
    report.pairs.iter().map(|pair| (pair.a.as_str(), pair.b.as_str(), pair.verdict.to_string())).collect()
}

fn numbers(report: &Report, run: usize) -> Vec<f64> {
    let run = &report.runs[run];
    let scores = [&run.r_cv_m2, &run.r_near_m2]
        .into_iter()
        .flat_map(|scores| scores.iter().filter_map(|(_, score)| score));
    scores.chain([run.dmp_sum_m2, run.coverage.unwrap(), run.miss_rate.unwrap()]).collect()
}

fn copies_score_the_same(log: &Known) {
    let copies = worlds().into_iter().enumerate();
    let copies = copies.map(|(k, world)| (format!("copy {k}"), from_a_file(&log.base.moved(&world))));
    let report = score(&log.log, &runs(copies), &plain());
    let first = numbers(&report, 0);
    let others = (1..report.runs.len()).flat_map(|run| numbers(&report, run));
    let off = first.iter().cycle().zip(others).fold(0.0, |most: f64, (a, b)| most.max((a / b - 1.0).abs()));
    assert!(off < 1e-6, "{off} on {}", log.log.display());
    for (a, b, verdict) in verdicts(&report) {
        assert_eq!(verdict, "same", "{a} and {b} on {}", log.log.display());
    }
}

#[test]
fn copies_that_lie_elsewhere_have_the_same_scores() {
    copies_score_the_same(&town());
}

/// What a motion does not round leaves every bit of the scores.
#[test]
fn copies_moved_by_what_binary_numbers_hold_have_the_same_bits() {
    let Known { log, base, _folder } = town();
    // Places of 2⁻²⁰ m, to which thousands of metres can be added and nothing is lost.
    let held = |c: f64| (c * 1_048_576.0).round() / 1_048_576.0;
    let poses = base
        .poses()
        .iter()
        .map(|pose| Isometry3::from_parts(pose.translation.vector.map(held).into(), pose.rotation));
    let stamped = base.stamps_ns().unwrap().iter().copied().zip(poses).collect();
    let base = Trajectory::stamped(stamped).unwrap().trajectory;
    let half_turn = |axis: usize| {
        let mut ijk = [0.0; 3];
        ijk[axis] = 1.0;
        UnitQuaternion::new_unchecked(dmp_sensor::Quaternion::new(0.0, ijk[0], ijk[1], ijk[2]))
    };
    let by = |place: [f64; 3], turn| Isometry3::from_parts(Translation3::from(place), turn);
    let motions = [
        Isometry3::identity(),
        by([4096.0, -512.0, 64.25], UnitQuaternion::identity()),
        by([0.0; 3], half_turn(2)),
        by([1024.0, 2048.0, -8.0], half_turn(0)),
    ];
    let mut seen: Vec<serde_json::Value> = Vec::new();
    for motion in motions {
        let report = score(&log, &runs([("run".to_owned(), base.moved(&motion))]), &plain());
        seen.push(serde_json::to_value(&report.runs).unwrap());
    }
    for other in &seen[1..] {
        assert_eq!(other, &seen[0]);
    }
}

/// A report states the frame, and it can be asked for.
#[test]
fn a_run_in_the_frame_of_its_report_has_the_same_scores() {
    let Known { log, base, _folder } = town();
    let runs = runs([("run".to_owned(), base.moved(&worlds()[4]))]);
    let found = score(&log, &runs, &plain());
    let fixed = Config { frame: Frame::of_report(found.inputs.runs[0].world_from_own), ..plain() };
    let put = score(&log, &runs, &fixed);
    for (a, b) in numbers(&found, 0).into_iter().zip(numbers(&put, 0)) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a} and {b}");
    }
}

/// Four draws of each noise, and two runs that are bent by as much to either side.
fn equal_runs_get_no_verdict(log: &Known, noises: &[(f64, f64)]) {
    let draw = |sigma_m: f64, sigma_deg: f64, seed: u64| {
        let noisy = SlamErrors { seed, ..noise(sigma_m, sigma_deg) }.apply(&log.base).unwrap();
        (format!("draw {seed}"), noisy.moved(&worlds()[seed as usize]))
    };
    let bent = |bend_m: f64| SlamErrors { bend_m: Some(bend_m), ..SlamErrors::default() };
    let bent = [0.01, -0.01].map(|m| (format!("bent by {m} m"), bent(m).apply(&log.base).unwrap())).to_vec();
    let draws = noises.iter().map(|&(m, deg)| (0..4).map(|seed| draw(m, deg, seed)).collect());
    for equal in draws.chain([bent]) {
        let report = score(&log.log, &runs(equal), &plain());
        for (a, b, verdict) in verdicts(&report) {
            let of = format!("{a} and {b} on {}: {verdict}", log.log.display());
            assert!(["same", "undecided"].contains(&verdict.as_str()), "{of}");
        }
    }
}

#[test]
fn runs_that_are_equally_good_get_no_verdict() {
    equal_runs_get_no_verdict(&town(), &[(0.01, 0.05)]);
}

/// A rule that never decides would pass the others.
fn wrong_runs_lose(log: &Known) {
    let worse = [noise(0.03, 0.1), noise(0.1, 0.3), drift(1.0), drift(3.0)];
    let worse = worse.iter().map(|errors| errors.apply(&log.base).unwrap());
    let all = std::iter::once(log.base.clone()).chain(worse).zip(worlds());
    let names = ["base", "noise 3 cm", "noise 10 cm", "drift 1 m", "drift 3 m"];
    let all = names.map(str::to_owned).into_iter().zip(all.map(|(run, world)| run.moved(&world)));
    let report = score(&log.log, &runs(all), &plain());
    for (a, b, verdict) in verdicts(&report) {
        let good = match (a, b) {
            ("base", _) => a,
            _ if a.split(' ').next() == b.split(' ').next() => a,
            _ => continue,
        };
        assert_eq!(verdict, good, "{a} and {b} on {}", log.log.display());
    }
}

#[test]
fn a_wrong_run_loses_wherever_its_world_lies() {
    wrong_runs_lose(&town());
}

#[test]
#[ignore = "nightly: 27 runs over a real drive"]
fn the_same_holds_on_a_real_drive() {
    let Some(log) = real_drive() else { return };
    copies_score_the_same(&log);
    equal_runs_get_no_verdict(&log, &[(0.005, 0.02), (0.01, 0.05), (0.03, 0.1)]);
    wrong_runs_lose(&log);
    equal_runs_get_no_verdict(&town(), &[(0.005, 0.02), (0.03, 0.1)]);
}
