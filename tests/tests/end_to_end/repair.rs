//! `dmp repair`: a run that drifts is mended where it comes back, a right one stays as it is, and nothing wrong is believed.

use dmp::{Config, Run};
use dmp_log::MemoryLog;
use dmp_loops::{Outcome, Repair, RepairOptions, repair};
use dmp_sensor::{Scan, Trajectory, Translation3};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route, Scenery, ate_rmse_m};

use crate::common::{
    done, drift, has, json, misused, noise, open, real_data, recorded, refused, save_tum, trajectory, write,
    write_mcap,
};

/// Two laps round a block.
fn laps() -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 300, rate_hz: 4.0, ..LidarOptions::with_beams(16) };
    let route = Route::TwoLaps;
    recorded(&RecordingOptions { seed: 4, scans: 400, route, speed_m_s: 8.0, traffic: 2, lidar })
}

fn repaired(log: &MemoryLog, run: &Trajectory, threads: usize) -> Repair {
    let mut options = RepairOptions { most_rounds: 2, ..RepairOptions::default() };
    options.map.rays_per_keyframe = 64;
    let config = Config { threads, ..Config::default() };
    repair(log, &Run::new("run", run.clone()), &config, &options, &()).unwrap()
}

/// By how much the trajectory error rises.
fn rise_m(repair: &Repair, run: &Trajectory, truth: &Trajectory) -> f64 {
    let after = repair.trajectory.as_ref().unwrap_or(run);
    ate_rmse_m(after, truth) - ate_rmse_m(run, truth)
}

#[test]
#[ignore = "nightly: repairs of two runs"]
fn a_run_that_drifts_comes_five_times_as_near_and_a_right_one_stays() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    let wrong = drift(1.0).apply(&truth).unwrap();
    let mended = repaired(&log, &wrong, 2);
    let after = mended.trajectory.as_ref().unwrap();
    assert_eq!(after.stamps_ns(), wrong.stamps_ns());
    let (before_m, after_m) = (ate_rmse_m(&wrong, &truth), ate_rmse_m(after, &truth));
    assert!(after_m < before_m / 5.0, "{before_m} m became {after_m} m: {:?}", mended.rounds);
    // It starts where it started.
    assert!((after.poses()[0].translation.vector - wrong.poses()[0].translation.vector).norm() < 0.5);
    let run = noise(0.02, 0.1).apply(&truth).unwrap();
    let rise_m = rise_m(&repaired(&log, &run, 2), &run, &truth);
    assert!(rise_m < 0.01, "{rise_m} m");
}

#[test]
#[ignore = "nightly: a repair with one thread, and one of the truth"]
fn threads_change_no_repair_and_the_truth_stays() {
    let (scans, truth) = laps();
    let log = MemoryLog::new("laps", scans).unwrap();
    let wrong = drift(1.0).apply(&truth).unwrap();
    assert_eq!(repaired(&log, &wrong, 2), repaired(&log, &wrong, 1));
    assert!(rise_m(&repaired(&log, &truth, 2), &truth, &truth) < 0.01);
}

/// Every house is the same again after 8 m: a wrong one must not be believed.
#[test]
#[ignore = "nightly: two repairs of a street"]
fn a_street_that_looks_the_same_everywhere_harms_no_run() {
    let lidar = LidarOptions { azimuth_steps: 300, rate_hz: 4.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 2, scans: 240, route: Route::Straight, speed_m_s: 6.0, traffic: 0, lidar };
    let town = options.town_of(Scenery::Alike { period_m: 8.0 }).unwrap();
    let recording = Recording::new(&town, &options).unwrap();
    let log = MemoryLog::new("street", recording.scans().collect()).unwrap();
    let truth = recording.drive().trajectory(20.0).unwrap();
    for run in [truth.clone(), drift(1.0).apply(&truth).unwrap(), drift(3.0).apply(&truth).unwrap()] {
        let mended = repaired(&log, &run, 2);
        let rise_m = rise_m(&mended, &run, &truth);
        assert!(rise_m < 0.01, "{rise_m} m: {:?} {:?}", mended.outcome, mended.rounds);
    }
}

#[test]
fn the_command_writes_what_is_better_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = laps();
    write_mcap(&path.join("laps.mcap"), &scans);
    save_tum(&path.join("truth.tum"), &truth);
    save_tum(&path.join("run.tum"), &drift(1.0).apply(&truth).unwrap());
    let call = "repair laps.mcap -t run.tum -o repaired.tum --rounds 1 --save-graph repaired.g2o";
    let result = json(path, call);
    assert_eq!(
        (&result["schema"], &result["is_written"]),
        (&"dmp-repair/1".into(), &true.into()),
        "{result}"
    );
    assert!(ate_rmse_m(&trajectory(&path.join("repaired.tum")), &truth) < 0.5);
    let graph = std::fs::read_to_string(path.join("repaired.g2o")).unwrap();
    has(&graph, &["VERTEX_SE3:QUAT 0 ", "EDGE_SE3:QUAT "]);
    for (arguments, words) in [
        ("-o run.tum", ["run.tum", "the input"]),
        ("-o laps.mcap", ["laps.mcap", "the input"]),
        ("-o x.tum --save-graph x.tum", ["x.tum", "two outputs"]),
    ] {
        refused(path, &format!("repair laps.mcap -t run.tum {arguments}"), 2, &words);
    }
    misused(path, "repair laps.mcap -t run.tum -o x.tum --rounds 0", &["--rounds", "1 or more"]);
    assert!(!path.join("x.tum").exists());
    // A drive that never returns is left as it is, and so is what was there before.
    let (scans, truth) = crate::drift::one_way();
    write_mcap(&path.join("straight.mcap"), &scans);
    save_tum(&path.join("run.tum"), &truth);
    write(path, "kept.tum", "what was there before");
    has(
        &done(path, "repair straight.mcap -t run.tum -o kept.tum --quiet"),
        &["no revisit", "kept.tum is not written"],
    );
    assert_eq!(std::fs::read_to_string(path.join("kept.tum")).unwrap(), "what was there before");
}

/// Out and back on one path, with the way back moved by 40 cm to the side and 10 cm upwards.
#[test]
#[ignore = "nightly: a real drive"]
fn a_real_run_comes_within_two_centimetres() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let log = open(&data);
    let odometry = trajectory(&data.join("poses_lidar_odometry.txt"));
    let half = odometry.poses().len() / 2;
    let shift = Translation3::new(0.3, -0.26, 0.1);
    let poses = odometry.poses().iter().enumerate();
    let poses: Vec<_> = poses.map(|(k, pose)| if k < half { *pose } else { shift * pose }).collect();
    let stamps_ns = odometry.stamps_ns().unwrap().iter().copied();
    let worse = Trajectory::stamped(stamps_ns.zip(poses).collect()).unwrap().trajectory;
    let run = Run::new("worse", worse);
    let mended = repair(log.as_ref(), &run, &Config::default(), &RepairOptions::default(), &()).unwrap();
    assert_eq!(mended.outcome, Outcome::Repaired, "{:?}", mended.rounds);
    let after = [Run::new("mended", mended.trajectory.unwrap())];
    let all = Config { drift: dmp::DriftPairs::All, ..Config::default() };
    let report = dmp::measure_drift(log.as_ref(), &after, &all, ()).unwrap();
    assert!(
        report.runs[0].pairs >= 5 && report.runs[0].median_m.value.unwrap() < 0.02,
        "{:?}",
        report.runs[0]
    );
}
