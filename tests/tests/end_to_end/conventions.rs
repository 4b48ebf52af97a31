//! Wrong clocks, extrinsics, pose formats and frames: each is reported with the option that fixes it, right runs are left
//! alone, and one run's mistake harms no other run.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use dmp::{
    Axis, Config, MapSource, Mend, PointTimes, PoseAt, PosesAs, Run, SettingName, Vetted, vet, vet_outline,
};
use dmp_log::{LogOptions, MemoryLog, outline_log};
use dmp_sensor::{Isometry3, Point3, Quaternion, Scan, Trajectory, UnitQuaternion, Vector3};
use dmp_sim::{LidarOptions, RecordingOptions, Route};

use crate::common::{
    collapse, drift, ends, has, json, json_of, noise, once, open, plain, real_data, recorded, refused,
    runs_of, sample, save_tum, score, text, trajectory, unwrapped, write_mcap,
};

/// A loop at 10 scans a second.
fn town() -> &'static (Vec<Scan>, Trajectory) {
    static TOWN: OnceLock<(Vec<Scan>, Trajectory)> = OnceLock::new();
    TOWN.get_or_init(|| {
        let lidar = LidarOptions { azimuth_steps: 200, rate_hz: 10.0, ..LidarOptions::with_beams(16) };
        let route = Route::Loop;
        recorded(&RecordingOptions { seed: 7, scans: 420, route, speed_m_s: 8.0, traffic: 2, lidar })
    })
}

fn memory() -> MemoryLog {
    MemoryLog::new("town", town().0.clone()).unwrap()
}

fn truth() -> Run {
    Run::new("truth", town().1.clone())
}

fn turn(axis: Vector3<f64>, degrees: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::new(axis * degrees.to_radians()))
}

fn moved(trajectory: &Trajectory, pose: impl Fn(&Isometry3<f64>) -> Isometry3<f64>) -> Trajectory {
    let stamps = trajectory.stamps_ns().unwrap().iter().copied();
    Trajectory::stamped(stamps.zip(trajectory.poses().iter().map(pose)).collect()).unwrap().trajectory
}

fn vetted(runs: &[Run], mend: bool) -> Vetted {
    vet(&memory(), runs, &Config::default(), mend, &()).unwrap()
}

fn words(vetted: &Vetted) -> Vec<String> {
    vetted.messages_with(&|setting: SettingName| format!("--{setting}"))
}

#[test]
fn row_19_right_runs_and_their_maps_are_left_alone_however_bad_they_are() {
    let wrong =
        [("terrible noise", noise(0.3, 1.0)), ("much drift", drift(3.0)), ("collapsed", collapse(0.5))];
    assert_eq!(words(&vetted(&runs_of(&town().1, &wrong), false)), [""; 0]);
    // A run that loses its way, ever faster, at a third or at two thirds of the drive: as millimetres it would stand still.
    let lost = |at: usize| {
        let later = (0..).map(|k: usize| k.saturating_sub(at) as f64);
        let poses = town().1.stamps_ns().unwrap().iter().zip(town().1.poses()).zip(later);
        let poses = poses
            .map(|((&ns, pose), later)| (ns, Isometry3::translation(later * later, 5.0 * later, 0.0) * pose));
        Run::new("lost", Trajectory::stamped(poses.collect()).unwrap().trajectory)
    };
    let poses = town().1.len();
    for at in [poses / 3, 2 * poses / 3] {
        let said = words(&vetted(&[lost(at)], false)).join("; ");
        assert!(!said.contains("--poses-as"), "{said}");
    }
    // With a pose for each scan, without stamps, seen from elsewhere: nothing depends on that.
    let at_scans = town().0.iter().filter_map(|scan| town().1.world_from_body_at(scan.stamp_ns?, i64::MAX));
    let elsewhere = Isometry3::translation(500_000.0, 4_000_000.0, 100.0) * turn(Vector3::z(), 120.0);
    let by_line = Trajectory::unstamped(at_scans.map(|pose| elsewhere * pose).collect()).unwrap();
    let found = vetted(&[Run::new("by line", by_line)], false);
    assert_eq!(words(&found), [""; 0]);

    // With a given map; `command` has the runs of the sample without.
    let run =
        |name: &str| Run { map: sample_map(), ..Run::new(name, trajectory(&sample(&format!("{name}.tum")))) };
    let report =
        score(&sample("town.mcap"), &["truth", "collapsed"].map(run), &Config { every: 4, ..plain() });
    let warnings: Vec<String> =
        report.runs.iter().flat_map(|run| &run.warnings).map(ToString::to_string).collect();
    let is_hint = |warning: &String| warning.contains(SURFACE) || warning.contains(" m apart");
    assert!(!warnings.iter().any(is_hint), "{warnings:?}");
}

/// The map of the sample's truth, given.
fn sample_map() -> MapSource {
    MapSource::Given(once(crate::map_command::BUILD).folder.join("truth.dmpmap"))
}

/// What a warning of a map that is near by but in another frame says.
const SURFACE: &str = "are where its map has a surface: check the map's frame";

#[test]
fn row_19_a_map_in_another_frame_is_reported_with_both_places() {
    let truth = trajectory(&sample("truth.tum"));
    for (shift, degrees, expected) in [
        (
            Vector3::new(300_000.0, 400_000.0, 0.0),
            0.0,
            ["the trajectory is around (300", " m apart: check that the map"],
        ),
        (Vector3::new(3.0, 5.0, 10.0), 40.0, [SURFACE, ""]),
    ] {
        let world = Isometry3::from_parts(shift.into(), turn(Vector3::z(), degrees).rotation);
        let runs = [Run { map: sample_map(), ..Run::new("a", moved(&truth, |pose| world * pose)) }];
        let report = score(&sample("town.mcap"), &runs, &Config { every: 4, ..plain() });
        let warnings: Vec<String> = report.runs[0].warnings.iter().map(ToString::to_string).collect();
        has(&warnings.join("\n"), &expected);
    }
}

/// Close to the sensor lies hardly anything: then no run is called misread, and as soon as there is enough, the wrong one is.
#[test]
fn a_short_range_calls_no_good_run_misread() {
    let camera = "-t camera=@/truth.tum --extrinsic camera=0,0,0,0.5,-0.5,0.5,0.5";
    for (range_m, runs, misread) in [(3.0, "", 0), (8.0, camera, 1)] {
        let arguments = format!(
            "score @/town.mcap -t @/truth.tum -t @/drift.tum {runs} --drift=none --max-range {range_m} --voxel 0.3 --json"
        );
        let report: dmp::Report =
            serde_json::from_slice(&ends(Path::new("."), &arguments, 0).stdout).unwrap();
        let conventions = report.inputs.runs.iter().filter_map(|run| run.conventions.as_ref());
        assert_eq!(conventions.filter(|found| found.doubtful).count(), misread, "{range_m} {runs}");
    }
    // A wrong extrinsic that was given to all runs is reported as that, and not as a wrong clock.
    let half_turn =
        "score @/town.mcap -t @/truth.tum --extrinsic 0,0,0,0,0,0.7071067811865476,0.7071067811865476";
    let report = json(Path::new("."), half_turn);
    has(&report["warnings"].to_string(), &["--extrinsic truth=0,0,0,0,0,0,1"]);
}

/// Where the scans have no stamps, line for line those of a run are theirs, whatever its clock is.
#[test]
#[ignore = "nightly: the calibration of two runs"]
fn runs_on_clocks_of_their_own_are_right_on_a_log_without_stamps() {
    let (scans, truth) = town();
    let bare = scans.iter().map(|scan| Scan { stamp_ns: None, ..scan.clone() }).collect();
    let log = MemoryLog::new("town", bare).unwrap();
    let pose = |scan: &Scan| Some((scan.stamp_ns?, truth.world_from_body_at(scan.stamp_ns?, i64::MAX)?));
    let at_scans = Trajectory::stamped(scans.iter().filter_map(pose).collect()).unwrap().trajectory;
    assert_eq!(at_scans.len(), scans.len());
    let elsewhere = at_scans.clone().later_by(1_234_567_890_123).unwrap();
    let runs = [Run::new("here", at_scans), Run::new("elsewhere", elsewhere)];
    let found = vet(&log, &runs, &Config::default(), false, &()).unwrap();
    let copies = "runs `here`, `elsewhere` are copies of one estimate: the same motion from pose to pose";
    assert_eq!(words(&found), [copies]);
    let [here, elsewhere] = [0, 1].map(|k| found.found[k].calibration.as_ref().unwrap());
    assert_eq!(here.estimates, elsewhere.estimates);
    assert!(here.of(Axis::Time).is_seen);
}

/// Errors of clock and extrinsic are found within their intervals, and fixed; how many of them are seen.
fn found_and_fixed(errors: &[(Axis, f64)]) -> usize {
    let zero = vetted(&[truth()], false).found.remove(0).calibration.unwrap();
    let mut found = 0;
    for &(axis, error) in errors {
        let along = |one: Axis| if one == axis { error } else { 0.0 };
        let mut run = truth();
        run.time_offset_ns = Some((along(Axis::Time) * 1e9).round() as i64);
        run.body_from_sensor = Some(Isometry3::new(
            Vector3::new(along(Axis::X), along(Axis::Y), along(Axis::Z)),
            Vector3::new(along(Axis::Roll), along(Axis::Pitch), along(Axis::Yaw)),
        ));
        let of_run = vetted(&[run], true);
        let one = of_run.found[0].calibration.as_ref().unwrap().of(axis);
        assert!((one.value - zero.of(axis).value + error).abs() <= one.half, "{axis:?}");
        if one.is_off {
            found += 1;
            assert_eq!(words(&vetted(&of_run.runs, false)), [""; 0], "{axis:?}");
        } else {
            assert!(error.abs() < one.half || !one.is_seen, "{axis:?}");
        }
    }
    found
}

#[test]
fn an_error_of_the_clock_is_found_and_fixed() {
    assert_eq!(found_and_fixed(&[(Axis::Time, -0.1)]), 1);
}

#[test]
#[ignore = "nightly: the eight errors of clock and extrinsic, one by one"]
fn errors_along_every_axis_are_found_or_not_seen() {
    let half = 0.5_f64.to_radians();
    let [turns, shifts] = [
        [(Axis::Yaw, 2.0 * half), (Axis::Pitch, -half), (Axis::Roll, half)],
        [(Axis::X, 0.2), (Axis::Y, -0.2), (Axis::Z, 0.2)],
    ];
    let all = [&[(Axis::Time, 0.02), (Axis::Time, -0.1)][..], &turns, &shifts].concat();
    assert!(found_and_fixed(&all) >= 5);
}

/// As an odometry writes them: the pose of the end of each scan with the stamp of its start.
fn poses_of_ends() -> Vec<(i64, Isometry3<f64>)> {
    let of_end = |scan: &Scan| {
        let stamp_ns = scan.stamp_ns?;
        let last_ns = scan.time_offsets_ns.iter().max()?;
        Some((stamp_ns, town().1.world_from_body_at(stamp_ns + last_ns, i64::MAX)?))
    };
    town().0.iter().filter_map(of_end).collect()
}

/// The same without stamps.
fn unstamped() -> Run {
    let poses = poses_of_ends().into_iter().map(|(_, pose)| pose).collect();
    Run::new("unstamped", Trajectory::unstamped(poses).unwrap())
}

#[test]
#[ignore = "nightly: the calibration of three runs, twice"]
fn a_pose_at_the_end_of_its_scan_is_found_as_that() {
    let runs =
        [Run::new("stamped", Trajectory::stamped(poses_of_ends()).unwrap().trajectory), unstamped(), truth()];
    let found = vetted(&runs, true);
    assert_eq!(found.found[0].mends, [Mend::PoseAt(PoseAt::End)]);
    assert!(found.found[1].mends.is_empty() && found.found[2].mends.is_empty());
    assert!(found.alike.is_empty());
    // Without stamps nothing is overridden: the instant is used unless another is chosen, and the stamp may be.
    let as_given = vetted(&runs[..2], false);
    assert_eq!(as_given.found[1].instant, Some(PoseAt::End));
    let used = |found: &Vetted| -> Vec<PoseAt> { found.runs.iter().map(Run::instant).collect() };
    assert_eq!(used(&as_given), [PoseAt::Stamp, PoseAt::End]);
    let chosen = Run { pose_at: Some(PoseAt::Stamp), ..runs[1].clone() };
    let chosen = vetted(&[chosen], false);
    assert_eq!(used(&chosen), [PoseAt::Stamp]);
    assert_eq!(chosen.found[0].mends, [Mend::PoseAt(PoseAt::End)]);
    // Both are one estimate: that they are off alike accuses nobody.
    assert!(as_given.alike.is_empty() && as_given.copies == [[0, 1]]);
}

/// Trajectories of other drives that happen to have the log's stamps.
#[test]
fn a_trajectory_of_another_drive_does_not_belong() {
    let others = [Route::Ring, Route::OutAndBack].map(|route| {
        let lidar = LidarOptions { azimuth_steps: 4, rate_hz: 10.0, ..LidarOptions::with_beams(1) };
        let options = RecordingOptions { seed: 3, scans: 420, route, speed_m_s: 8.0, traffic: 0, lidar };
        Run::new(format!("{route:?}"), recorded(&options).1)
    });
    // A hint is no proof: they are scored, and the one of which more returns meet without its turns is reported.
    let runs: Vec<Run> = std::iter::once(truth()).chain(others).collect();
    let found = vetted(&runs, true);
    assert_eq!(found.is_kept(), [true; 3]);
    assert_eq!([0, 1, 2].map(|k| found.found[k].is_doubtful(true)), [false, false, true]);

    // Left and right exchanged: every turn contradicts the scans, beyond doubt.
    let mirrored = moved(&town().1, |pose| {
        let (place, turn) = (pose.translation.vector, pose.rotation.quaternion());
        let turn = UnitQuaternion::new_unchecked(Quaternion::new(turn.w, -turn.i, turn.j, -turn.k));
        Isometry3::from_parts(Vector3::new(place.x, -place.y, place.z).into(), turn)
    });
    let found = vetted(&[truth(), Run::new("mirrored", mirrored)], true);
    assert_eq!(found.is_kept(), [true, false]);
    has(
        &words(&found).join("\n"),
        &[
            "run `mirrored` is excluded: its poses do not match the scans of this log: in turns, ",
            "without the turn",
        ],
    );
}

#[test]
#[ignore = "nightly: the calibration of two runs"]
fn what_all_runs_are_off_by_is_not_theirs() {
    let late = |name: &str, run: Run| Run { name: name.into(), time_offset_ns: Some(50_000_000), ..run };
    let noisy = runs_of(&town().1, &[("noise", noise(0.01, 0.03))]).remove(1);
    let found = vetted(&[late("a", truth()), late("b", noisy)], false);
    has(&words(&found)[0], &["all runs show the same error: ", "the log's clock"]);
    has(&words(&found)[1], &["--time-offset a=0"]);
}

/// The scans with their points brought to an instant, a time after the stamp, by the truth.
fn corrected_to(instant: impl Fn(&Scan) -> Option<i64>) -> Vec<Scan> {
    let (scans, truth) = town();
    let corrected = |scan: &Scan| {
        let stamp_ns = scan.stamp_ns.unwrap();
        let at = |ns: i64| truth.world_from_body_at(ns, i64::MAX);
        let Some(there) = instant(scan).and_then(|after_ns| at(stamp_ns + after_ns)) else {
            return scan.clone();
        };
        let correct = |(point, after_ns): (&[f32; 3], &i64)| {
            let Some(pose) = at(stamp_ns + after_ns) else { return *point };
            let there = there.inverse() * (pose * Point3::from(point.map(f64::from)));
            [there.x as f32, there.y as f32, there.z as f32]
        };
        let points = scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns).map(correct).collect();
        Scan { points_in_sensor_m: points, ..scan.clone() }
    };
    scans.iter().map(corrected).collect()
}

#[test]
#[ignore = "nightly: four scores of corrected scans"]
fn points_that_were_corrected_already_are_reported_and_fixed() {
    let (scans, _) = town();
    // Brought to the end of the scan, with their times still there: the run's clock is not to blame for all of it, but its
    // poses are looked up at the start.
    let at_ends =
        MemoryLog::new("town", corrected_to(|scan| scan.time_offsets_ns.iter().copied().max())).unwrap();
    let found = vet(&at_ends, &[truth()], &Config::default(), false, &()).unwrap();
    assert!(matches!(found.point_times, PointTimes::Corrected(_)));
    let last_ns = scans[0].time_offsets_ns.iter().max().unwrap();
    let [Mend::TimeOffset(offset_ns)] = found.found[0].mends[..] else {
        panic!("{:?}", found.found[0].mends)
    };
    assert!((offset_ns - last_ns).abs() < 3_000_000, "{offset_ns} {last_ns}");
    // To the start: fixed it is the same as with the option.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_mcap(&path.join("corrected.mcap"), &corrected_to(|_| Some(0)));
    save_tum(&path.join("truth.tum"), &town().1);
    let score = "score corrected.mcap -t truth.tum --every 20 --drift=none";
    let [as_is, fixed, ignored] =
        ["", "--mend", "--point-time ignore"].map(|option| json(path, &format!("{score} {option}")));
    assert_eq!(fixed["runs"], ignored["runs"]);
    assert_ne!(as_is["runs"], fixed["runs"]);
    has(&unwrapped(&text(&ends(path, score, 0).stdout)), &["fix it with --point-time ignore"]);
}

/// The truth in every way that users get wrong, and the option that fixes each.
fn wrong_readings() -> Vec<(&'static str, Trajectory, &'static str)> {
    let truth = &town().1;
    let camera_from_sensor = turn(Vector3::x(), 90.0) * turn(Vector3::z(), 90.0);
    let scaled = |pose: &Isometry3<f64>| {
        Isometry3::from_parts((pose.translation.vector * 1000.0).into(), pose.rotation)
    };
    let wxyz = |pose: &Isometry3<f64>| {
        let [x, y, z, w] = [pose.rotation.i, pose.rotation.j, pose.rotation.k, pose.rotation.w];
        let written = UnitQuaternion::new_unchecked(Quaternion::new(z, w, x, y));
        Isometry3::from_parts(pose.translation, written)
    };
    let later = |s: i64| truth.clone().later_by(s * 1_000_000_000).unwrap();
    let sparse = truth.stamps_ns().unwrap().iter().copied().zip(truth.poses().iter().copied()).step_by(60);
    vec![
        ("mm", moved(truth, scaled), "--poses-as mm=mm"),
        ("wxyz", moved(truth, wxyz), "--poses-as wxyz=wxyz"),
        ("inverse", moved(truth, Isometry3::inverse), "--poses-as inverse=inverted"),
        (
            "camera",
            moved(truth, |pose| camera_from_sensor * pose * camera_from_sensor.inverse()),
            "--extrinsic camera=0,0,0,0.5,-0.5,0.5,0.5",
        ),
        ("late", later(2), "--time-offset late=2"),
        ("gps", later(18), "--time-offset gps=18"),
        ("hour", later(3600), "--time-offset hour=3600.000"),
        ("keyframes", Trajectory::stamped(sparse.collect()).unwrap().trajectory, "--between keyframes=FILE"),
    ]
}

/// One line names each wrong run with the option that fixes it, and the right run beside it has the numbers it has alone.
#[test]
fn row_19_each_wrong_reading_is_one_line_and_harms_no_other_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_mcap(&path.join("town.mcap"), &town().0);
    save_tum(&path.join("truth.tum"), &town().1);
    let score = "score town.mcap -t truth.tum --every 12 --drift=none";
    let alone = json(path, score);
    let wrong = wrong_readings();
    let mut all = String::new();
    for (name, run, _) in &wrong {
        save_tum(&path.join(format!("{name}.tum")), run);
        all += &format!(" -t {name}.tum");
    }
    let output = ends(path, &format!("{score} {all} --json"), 3);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let stderr = text(&output.stderr);
    for (name, _, option) in &wrong {
        let lines: Vec<&str> =
            stderr.lines().filter(|line| line.contains(&format!("run `{name}`"))).collect();
        assert!(lines.len() == 1 && lines[0].contains(option), "{name}: {option}\n{stderr}");
    }
    // Only what has no poses for the scans is excluded; the others are scored, with a mark.
    let names = |list: &serde_json::Value, of: &dyn Fn(&serde_json::Value) -> bool| -> Vec<String> {
        let named = list.as_array().unwrap().iter().filter(|run| of(run));
        named.map(|run| run["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(names(&report["left_out"], &|_| true), ["hour", "keyframes"]);
    let doubtful = names(&report["inputs"]["runs"], &|run| run["conventions"]["doubtful"] == true);
    assert_eq!(doubtful, ["mm", "wxyz", "inverse", "camera", "late", "gps"]);
    assert_eq!((&report["runs"][0], &report["config"]), (&alone["runs"][0], &alone["config"]));
    // Fixed, each is the run that it was meant to be.
    let fixed: dmp::Report = serde_json::from_slice(
        &ends(path, &format!("{score} -t mm.tum -t camera.tum --mend --json"), 0).stdout,
    )
    .unwrap();
    assert!(fixed.left_out.is_empty() && fixed.runs.len() == 3);
    for run in &fixed.runs {
        let [truth, run_m] = [&fixed.runs[0], run].map(|run| run.r_near_m2[1].unwrap().sqrt());
        assert!((truth / run_m - 1.0).abs() < 1e-3, "{}: {truth} {run_m}", run.name);
    }
    // Carried by an odometry between them, keyframes are as good as that.
    let options = "-t keyframes.tum --between keyframes=truth.tum --trust";
    let runs = json(path, &format!("{score} {options}"))["runs"].clone();
    let [truth, keyframes] = [0, 1].map(|run| runs[run]["r_near_m2"]["2"].as_f64().unwrap().sqrt());
    assert!((truth / keyframes - 1.0).abs() < 0.01, "{truth} {keyframes}");
    // A gate on a run that is excluded fails with the reason.
    let gated = ends(path, &format!("{score} -t hour.tum --expect hour:R_cv_0.5<30cm"), 4);
    has(&unwrapped(&text(&gated.stdout)), &["--time-offset hour=3600.000"]);
    refused(path, "score truth.tum -t town.mcap", 1, &["truth.tum", "trajectory (TUM"]);
}

/// `dmp calibrate`: what is off with its option; plots of all axes where they are asked for.
fn calibrates(options: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = town();
    write_mcap(&path.join("town.mcap"), scans);
    save_tum(&path.join("late.tum"), &truth.clone().later_by(50_000_000).unwrap());
    save_tum(&path.join("mm.tum"), &wrong_readings()[0].1);
    let arguments = format!("calibrate town.mcap -t late.tum -t mm.tum {options} --json -q");
    let report = json_of(&ends(path, &arguments, 0));
    assert_eq!(report["schema"], "dmp-calibrate/1");
    let [late, mm] = [0, 1].map(|run| &report["runs"][run]);
    let [off_by_s, half_s] = ["value", "half"].map(|field| late["estimates"][0][field].as_f64().unwrap());
    assert!((off_by_s - 0.05).abs() < half_s, "{off_by_s} ± {half_s}");
    let option = late["mends"][0].as_str().unwrap();
    let offset_s: f64 = option.strip_prefix("--time-offset late=").unwrap().parse().unwrap();
    assert!((offset_s - 0.05).abs() < 0.001 && late["mends"].as_array().unwrap().len() == 1, "{late}");
    let [belongs, doubtful] = ["belongs", "doubtful"].map(|field| mm[field] == true);
    assert_eq!((&mm["mends"][0], belongs, doubtful), (&"--poses-as mm=mm".into(), true, true));
    folder
}

#[test]
fn calibrate_prints_each_number_with_its_interval() {
    calibrates("");
}

#[test]
#[ignore = "nightly: the thickness of surfaces along eight axes"]
fn calibrate_plots_every_axis() {
    let folder = calibrates("--plots figures");
    let figures = folder.path().join("figures");
    assert_eq!(fs::read_dir(&figures).unwrap().count(), 8);
    has(&fs::read_to_string(figures.join("time.svg")).unwrap(), &["thickness [cm]", "time [ms]"]);
}

#[test]
fn a_log_of_which_only_the_index_is_read_is_vetted_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    write_mcap(&path, &town().0);
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    let wrong = Run { name: "inverse".into(), trajectory: moved(&town().1, Isometry3::inverse), ..truth() };
    let found = vet_outline(&outline, &[truth(), wrong.clone()], &Config::default(), false, &()).unwrap();
    assert_eq!([0, 1].map(|run| found.found[run].is_doubtful(false)), [false, true]);
    assert_eq!(found.is_kept(), [true, true]);
    assert_eq!(found.found[1].mends[0], Mend::PosesAs(PosesAs::Inverted));
    // More scans are read for an instant, and what is said of the others stays.
    let with_open = [truth(), wrong, unstamped()];
    let with_open = vet_outline(&outline, &with_open, &Config::default(), false, &()).unwrap();
    assert_eq!(with_open.found[2].instant, Some(PoseAt::End));
    assert_eq!(format!("{:?}", &with_open.found[..2]), format!("{:?}", found.found));
}

#[test]
#[ignore = "nightly: real drives"]
fn row_19_real_recordings_have_nothing_wrong() {
    let look = |folder: &Path, file: &str, body_from_sensor: Isometry3<f64>| {
        let run = Run::new("odometry", trajectory(&folder.join(file)));
        let run = Run { body_from_sensor: Some(body_from_sensor), ..run };
        let found = vet(open(folder).as_ref(), &[run], &Config::default(), false, &()).unwrap();
        (words(&found), found.found.into_iter().next().unwrap().calibration)
    };
    let Some(nclt) = real_data("nclt_revisit") else { return };
    let (messages, calibration) = look(&nclt, "poses_lidar_odometry.txt", Isometry3::identity());
    assert_eq!(messages, [""; 0]);
    // Over flat ground height is not seen, nor the time of scans that are instants a metre apart; turns are seen.
    let seen = |axis: Axis| calibration.as_ref().unwrap().of(axis).is_seen;
    assert_eq!([Axis::Time, Axis::Yaw, Axis::Z].map(seen), [false, true, false]);
    // The sensor hung upside down; the poses are its own. With that undone:
    assert_eq!(look(&nclt, "poses_lidar_odometry.txt", turn(Vector3::x(), 180.0)).0.len(), 1);
    let Some(still) = real_data("rs32_static") else { return };
    assert_eq!(look(&still, "poses_icp_odom.txt", Isometry3::identity()).0, [""; 0]);
}
