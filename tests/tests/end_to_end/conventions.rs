//! Wrong clocks, mountings and readings: each is told with the option that puts it right, right runs are left alone, and one
//! run's mistake is no other's.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use dmp::{
    Axis, Config, LeftOut, Mend, PointTimes, PoseAt, PosesAs, Run, SettingName, Vetted, profiles, vet,
    vet_outline,
};
use dmp_log::{LogOptions, MemoryLog, outline_log, read_trajectory, write_kitti, write_tum};
use dmp_sensor::{Isometry3, Point3, Quaternion, Scan, Trajectory, UnitQuaternion, Vector3};
use dmp_sim::{LidarOptions, RecordingOptions, Route};

use crate::common::{collapse, drift, noise};
use crate::common::{
    dmp, open, real_data, recorded, refused, runs_of, text, unwrapped, workspace, write_mcap,
};

/// A loop at 10 scans a second.
fn town() -> &'static (Vec<Scan>, Trajectory) {
    static TOWN: OnceLock<(Vec<Scan>, Trajectory)> = OnceLock::new();
    TOWN.get_or_init(|| {
        let lidar = LidarOptions { azimuth_steps: 200, rate_hz: 10.0, ..LidarOptions::with_beams(16) };
        recorded(&RecordingOptions {
            seed: 7,
            scans: 420,
            route: Route::Loop,
            speed_m_s: 8.0,
            traffic: 2,
            lidar,
        })
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
    let messages = vetted.messages_with(&|setting: SettingName| format!("--{setting}"));
    messages.iter().for_each(|message| println!("{message}"));
    messages
}

#[test]
fn row_19_right_runs_are_left_alone_however_bad_they_are() {
    let wrong = [
        ("noise", noise(0.03, 0.1)),
        ("much noise", noise(0.1, 0.3)),
        ("terrible noise", noise(0.3, 1.0)),
        ("drift", drift(0.3)),
        ("much drift", drift(3.0)),
        ("collapsed", collapse(0.5)),
    ];
    let runs = runs_of(&town().1, &wrong);
    assert_eq!(words(&vetted(&runs, false)), [""; 0]);
    // With a pose for each scan, without stamps, seen from elsewhere: nothing depends on that.
    let at_scans = town().0.iter().filter_map(|scan| town().1.world_from_body_at(scan.stamp_ns?, i64::MAX));
    let elsewhere = Isometry3::translation(500_000.0, 4_000_000.0, 100.0) * turn(Vector3::z(), 120.0);
    let by_line = Trajectory::unstamped(at_scans.map(|pose| elsewhere * pose).collect()).unwrap();
    let found = vetted(&[Run::new("by line", by_line)], false);
    assert_eq!(words(&found), [""; 0]);
    let calibration = found.found[0].calibration.as_ref().unwrap();
    assert!(calibration.of(Axis::Time).is_seen && calibration.of(Axis::Yaw).is_seen);
}

#[test]
fn row_19_the_sample_has_nothing_wrong_and_no_run_is_left_out() {
    let sample = workspace().join("data-samples");
    let runs = ["truth", "noise", "drift", "collapsed"]
        .map(|name| Run::new(name, read_trajectory(&sample.join(format!("{name}.tum"))).unwrap().trajectory));
    let found = vet(open(&sample.join("town.mcap")).as_ref(), &runs, &Config::default(), false, &()).unwrap();
    assert_eq!(words(&found), [""; 0]);
}

/// Where the scans have no stamps, line for line those of a run are theirs, whatever its clock is.
#[test]
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
    assert_eq!(words(&found), [""; 0]);
    let [here, elsewhere] = [0, 1].map(|k| found.found[k].calibration.as_ref().unwrap());
    assert_eq!(here.estimates, elsewhere.estimates);
    assert!(here.of(Axis::Time).is_seen);
}

/// Errors of clock and mounting are found within their intervals, to both sides, and mended.
#[test]
fn small_errors_of_clock_and_mounting_are_found_where_they_are_seen() {
    let zero = vetted(&[truth()], false).found.remove(0).calibration.unwrap();
    let (mut found, mut tried) = (0, 0);
    for (axis, error) in [
        (Axis::Time, 0.02),
        (Axis::Time, -0.1),
        (Axis::Yaw, 1.0_f64.to_radians()),
        (Axis::Pitch, -0.5_f64.to_radians()),
        (Axis::Roll, 0.5_f64.to_radians()),
        (Axis::X, 0.2),
        (Axis::Y, -0.2),
        (Axis::Z, 0.2),
    ] {
        let along = |one: Axis| if one == axis { error } else { 0.0 };
        let mut run = truth();
        run.time_offset_ns = Some((along(Axis::Time) * 1e9).round() as i64);
        run.body_from_sensor = Some(Isometry3::new(
            Vector3::new(along(Axis::X), along(Axis::Y), along(Axis::Z)),
            Vector3::new(along(Axis::Roll), along(Axis::Pitch), along(Axis::Yaw)),
        ));
        let of_run = vetted(&[run], true);
        let one = of_run.found[0].calibration.as_ref().unwrap().of(axis);
        println!("{}: {error} made, {} ± {} found, seen: {}", axis.name(), -one.value, one.half, one.is_seen);
        assert!((one.value - zero.of(axis).value + error).abs() <= one.half, "{axis:?}");
        tried += 1;
        if !one.is_off {
            assert!(error.abs() < one.half || !one.is_seen, "{axis:?}");
            continue;
        }
        found += 1;
        // What mends it leaves nothing to be said.
        let mended = vetted(&of_run.runs, false);
        assert_eq!(words(&mended), [""; 0], "{axis:?}");
    }
    assert!(found >= 5, "{found} of {tried}");
}

#[test]
fn a_pose_at_the_end_of_its_scan_is_found_as_that() {
    // As an odometry writes it: the pose of the end of the scan with the stamp of its start, or with none.
    let ends = || {
        town().0.iter().filter_map(|scan| {
            let stamp_ns = scan.stamp_ns?;
            let last_ns = scan.time_offsets_ns.iter().max()?;
            Some((stamp_ns, town().1.world_from_body_at(stamp_ns + last_ns, i64::MAX)?))
        })
    };
    let stamped = Trajectory::stamped(ends().collect()).unwrap().trajectory;
    let unstamped = Trajectory::unstamped(ends().map(|(_, pose)| pose).collect()).unwrap();
    let runs = [Run::new("stamped", stamped), Run::new("unstamped", unstamped), truth()];
    let found = vetted(&runs, true);
    words(&found);
    for of_run in &found.found[..2] {
        assert_eq!(of_run.mends, [Mend::PoseAt(PoseAt::End)], "{}", of_run.name);
    }
    assert_eq!(found.found[2].mends, []);
    assert!(found.alike.is_empty());
    // Only the two: nobody else is to blame. With them alone it is the log that is.
    assert_eq!(vetted(&runs[..2], false).alike[0].axis, Axis::Time);
}

/// Trajectories of other drives that happen to have the log's stamps.
#[test]
fn a_trajectory_of_another_drive_does_not_belong() {
    let others = [Route::OneWay, Route::Ring, Route::OutAndBack].map(|route| {
        let lidar = LidarOptions { azimuth_steps: 4, rate_hz: 10.0, ..LidarOptions::with_beams(1) };
        let options = RecordingOptions { seed: 3, scans: 420, route, speed_m_s: 8.0, traffic: 0, lidar };
        Run::new(format!("{route:?}"), recorded(&options).1)
    });
    let runs: Vec<Run> = std::iter::once(truth()).chain(others).collect();
    let found = vetted(&runs, true);
    words(&found);
    assert_eq!(found.is_kept(), [true, false, false, false]);
    // Alone it is scored, and told.
    let alone = vetted(&runs[1..2], true);
    assert_eq!((alone.is_kept(), words(&alone).len()), (vec![true], 1));
}

#[test]
fn what_all_runs_are_off_by_is_not_theirs() {
    let late = |name: &str, run: Run| Run { name: name.into(), time_offset_ns: Some(50_000_000), ..run };
    let noisy = runs_of(&town().1, &[("noise", noise(0.01, 0.03))]).remove(1);
    let found = vetted(&[late("a", truth()), late("b", noisy)], false);
    let told = words(&found);
    assert!(
        told[0].starts_with("all runs are off alike: ") && told[0].contains("the log's clock"),
        "{told:?}"
    );
    assert!(told[1].contains("--time-offset a=0"), "{told:?}");
}

/// The scans with their points brought to an instant, told as a time after the stamp, by the truth.
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
fn points_that_were_corrected_already_are_told() {
    let (scans, truth_poses) = town();
    // Brought to the end of the scan, with their times still there: the run's clock is not to blame for all of it, but its
    // poses are looked up at the start.
    let at_ends =
        MemoryLog::new("town", corrected_to(|scan| scan.time_offsets_ns.iter().copied().max())).unwrap();
    let found = vet(&at_ends, &[truth()], &Config::default(), false, &()).unwrap();
    words(&found);
    assert!(matches!(found.point_times, PointTimes::Corrected(_)));
    let last_ns = scans[0].time_offsets_ns.iter().max().unwrap();
    let [Mend::TimeOffset(offset_ns)] = found.found[0].mends[..] else {
        panic!("{:?}", found.found[0].mends)
    };
    assert!((offset_ns - last_ns).abs() < 3_000_000, "{offset_ns} {last_ns}");
    // To the start.
    let corrected = corrected_to(|_| Some(0));
    let folder = tempfile::tempdir().unwrap();
    write_mcap(&folder.path().join("corrected.mcap"), &corrected);
    write_mcap(&folder.path().join("raw.mcap"), scans);
    write_tum(&mut fs::File::create(folder.path().join("truth.tum")).unwrap(), truth_poses).unwrap();
    let told = |arguments: &str| {
        let output = dmp(folder.path(), &format!("score {arguments} -t truth.tum --every 20"));
        text(&output.stderr)
    };
    let words = told("corrected.mcap");
    assert!(
        words.contains("at one instant already") && words.contains("--point-time ignore mends it"),
        "{words}"
    );
    // Mended it is the same as with the option.
    let json = |arguments: &str| {
        let output = dmp(folder.path(), &format!("score {arguments} -t truth.tum --every 20 --json -q"));
        let report: dmp::Report = serde_json::from_slice(&output.stdout).unwrap();
        report.runs[0].r_near_m2.clone()
    };
    assert_eq!(json("corrected.mcap --mend"), json("corrected.mcap --point-time ignore"));
    assert_ne!(json("corrected.mcap"), json("corrected.mcap --mend"));
    // And the other way round.
    let words = told("raw.mcap --point-time ignore");
    assert!(words.contains("leave --point-time out"), "{words}");
    assert!(!told("raw.mcap").contains("--point-time"));
}

/// Everything that users get wrong, through the command: one line names it with the option that puts it right, and the
/// right run beside it has the numbers it has alone.
#[test]
fn row_19_each_wrong_reading_is_told_in_a_line_and_harms_no_other_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = town();
    write_mcap(&path.join("town.mcap"), scans);
    let keep = |name: &str, trajectory: &Trajectory| {
        write_tum(&mut fs::File::create(path.join(name)).unwrap(), trajectory).unwrap();
    };
    keep("truth.tum", truth);
    let camera_from_sensor = turn(Vector3::x(), 90.0) * turn(Vector3::z(), 90.0);
    let scaled = |pose: &Isometry3<f64>| {
        Isometry3::from_parts((pose.translation.vector * 1000.0).into(), pose.rotation)
    };
    let wxyz = |pose: &Isometry3<f64>| {
        let [x, y, z, w] = [pose.rotation.i, pose.rotation.j, pose.rotation.k, pose.rotation.w];
        let written = UnitQuaternion::new_unchecked(Quaternion::new(z, w, x, y));
        Isometry3::from_parts(pose.translation, written)
    };
    keep("mm.tum", &moved(truth, scaled));
    keep("wxyz.tum", &moved(truth, wxyz));
    keep("inverse.tum", &moved(truth, Isometry3::inverse));
    keep("both.tum", &moved(truth, |pose| scaled(&pose.inverse())));
    keep("camera.tum", &moved(truth, |pose| camera_from_sensor * pose * camera_from_sensor.inverse()));
    keep("late.tum", &truth.clone().later_by(2_000_000_000).unwrap());
    keep("gps.tum", &truth.clone().later_by(18_000_000_000).unwrap());
    keep("hour.tum", &truth.clone().later_by(3_600_000_000_000).unwrap());
    let sparse = truth.stamps_ns().unwrap().iter().copied().zip(truth.poses().iter().copied()).step_by(60);
    keep("keyframes.tum", &Trajectory::stamped(sparse.collect()).unwrap().trajectory);
    let json = |arguments: &str| {
        let output = dmp(path, &format!("score town.mcap -t truth.tum {arguments} --every 12 --json"));
        let report: dmp::Report = serde_json::from_slice(&output.stdout).unwrap();
        (report, text(&output.stderr), output.status.code())
    };
    let (alone, told, code) = json("");
    assert_eq!((alone.runs.len(), code), (1, Some(0)));
    assert!(!told.contains("note: run"), "{told}");
    for (file, mends) in [
        ("mm", "--poses-as mm=mm mends it"),
        ("wxyz", "--poses-as wxyz=wxyz mends it"),
        ("inverse", "--poses-as inverse=inverted mends it"),
        ("camera", "--extrinsic camera=0,0,0,0.5,-0.5,0.5,0.5 mends it"),
        ("late", "--time-offset late=2 mends it"),
        ("gps", "--time-offset gps=18 mends it"),
        ("hour", "--time-offset hour=3600.000"),
        ("keyframes", "--between keyframes=FILE"),
    ] {
        let (report, told, code) = json(&format!("-t {file}.tum"));
        let lines: Vec<&str> = told.lines().filter(|line| line.starts_with("note: run")).collect();
        assert!(lines.len() == 1 && lines[0].contains(&format!("run `{file}` is left out: ")), "{told}");
        assert!(lines[0].contains(mends), "{told}");
        assert_eq!((code, report.left_out.len()), (Some(3), 1), "{file}");
        assert_eq!(report.left_out[0].name, file);
        // The others have the numbers they have without it.
        assert_eq!(report.runs, alone.runs, "{file}");
        assert_eq!(report.config, alone.config, "{file}");
        assert_eq!(report.order, ["truth"]);
        if file == "hour" || file == "keyframes" {
            continue;
        }
        // Mended, it is the run that it was meant to be.
        let (report, ..) = json(&format!("-t {file}.tum --mend"));
        assert!(report.left_out.is_empty() && report.inputs.runs[1].conventions.as_ref().unwrap().mended);
        let [truth, run] = [0, 1].map(|k| report.runs[k].r_cv_m2[0].unwrap().sqrt());
        assert!((truth / run - 1.0).abs() < 1e-3, "{file}: {truth} {run}");
        assert!(report.verdict_between("truth", file).unwrap().better().is_none(), "{file}");
    }
    // A gate that speaks of a run that is left out fails with the reason.
    let output = dmp(path, "score town.mcap -t truth.tum -t mm.tum --every 12 --fail-above mm:R_cv_0.5=30cm");
    assert_eq!(output.status.code(), Some(4));
    let told = text(&output.stdout);
    assert!(unwrapped(&told).contains("--poses-as mm=mm"), "{told}");
    // Who trusts what was given gets it.
    let (report, told, _) = json("-t wxyz.tum --trust");
    assert!(report.left_out.is_empty() && !told.contains("note: run"), "{told}");
    // Carried by an odometry between them, keyframes are as good as that.
    let (report, ..) = json("-t keyframes.tum --between keyframes=truth.tum");
    let [truth, run] = [0, 1].map(|k| report.runs[k].r_cv_m2[0].unwrap().sqrt());
    assert!((truth / run - 1.0).abs() < 0.01, "{truth} {run}");
    // What is wrong in two ways is told one after the other, and what was told first still stands.
    let both = "-t both.tum --poses-as both=mm";
    let (_, told, _) = json(both);
    assert!(told.contains("--poses-as both=inverted mends it"), "{told}");
    let (report, told, _) = json(&format!("{both} --poses-as both=inverted"));
    assert!(!told.contains("note: run"), "{told}");
    let [truth, run] = [0, 1].map(|k| report.runs[k].r_cv_m2[0].unwrap().sqrt());
    assert!((truth / run - 1.0).abs() < 1e-3, "{truth} {run}");
    // Log and trajectory swapped.
    refused(
        path,
        "score truth.tum -t town.mcap",
        1,
        &["truth.tum", "it is a trajectory (TUM", "the log comes first"],
    );
}

/// `dmp calibrate` through the command: what is off with its option, what is not seen, pictures.
#[test]
fn the_command_tells_each_number_with_its_interval() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = town();
    write_mcap(&path.join("town.mcap"), scans);
    let keep = |name: &str, trajectory: &Trajectory| {
        write_tum(&mut fs::File::create(path.join(name)).unwrap(), trajectory).unwrap();
    };
    keep("truth.tum", truth);
    keep("late.tum", &truth.clone().later_by(50_000_000).unwrap());
    keep(
        "mm.tum",
        &moved(truth, |pose| Isometry3::from_parts((pose.translation.vector * 1e3).into(), pose.rotation)),
    );
    let output = dmp(path, "calibrate town.mcap -t truth.tum -q");
    let told = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(told.contains("Nothing is surely off."), "{told}");
    let line = |axis: &str| told.lines().find(|line| line.trim_start().starts_with(axis)).unwrap();
    assert!(line("time").contains(" ms") && !line("time").contains("cannot be seen"), "{told}");
    assert!(line("z").contains("cannot be seen here"), "{told}");

    let output =
        dmp(path, "calibrate town.mcap -t late.tum -t truth.tum -t mm.tum --plots figures --json -q");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["schema"], "dmp-calibrate/1");
    let [late, right, mm] = [0, 1, 2].map(|run| &json["runs"][run]);
    let off_by_s = late["estimates"][0]["value"].as_f64().unwrap();
    assert!((off_by_s - 0.05).abs() < late["estimates"][0]["half"].as_f64().unwrap(), "{off_by_s}");
    let mend = late["mends"][0].as_str().unwrap();
    let offset_s: f64 = mend.strip_prefix("--time-offset late=").unwrap().parse().unwrap();
    assert!((offset_s - 0.05).abs() < 0.001 && late["mends"].as_array().unwrap().len() == 1, "{late}");
    assert_eq!((&right["mends"], &right["belongs"]), (&serde_json::json!([]), &true.into()));
    assert_eq!((&mm["mends"][0], &mm["belongs"]), (&"--poses-as mm=mm".into(), &false.into()));
    assert_eq!(json["messages"].as_array().unwrap().len(), 2, "{json}");
    // Alone it does not belong either, and that is told.
    let output = dmp(path, "calibrate town.mcap -t mm.tum -q");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("--poses-as mm=mm mends it"), "{}", text(&output.stdout));
    keep("hour.tum", &truth.clone().later_by(3_600_000_000_000).unwrap());
    refused(path, "calibrate town.mcap -t hour.tum", 1, &["hour", "--time-offset hour="]);
    let mut drawn: Vec<String> = fs::read_dir(path.join("figures"))
        .unwrap()
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    drawn.sort();
    assert_eq!(
        drawn,
        ["pitch.svg", "roll.svg", "sweep.svg", "time.svg", "x.svg", "y.svg", "yaw.svg", "z.svg"]
    );
    let time = fs::read_to_string(path.join("figures/time.svg")).unwrap();
    assert!(["late", "truth", "time [ms]"].iter().all(|word| time.contains(word)) && !time.contains(">mm<"));
}

/// The pictures' numbers: thinnest where the estimate is, as thick as was told with what was given.
#[test]
fn surfaces_are_thinnest_with_what_is_found() {
    let late = Run { name: "late".into(), time_offset_ns: Some(50_000_000), ..truth() };
    let (log, runs, config) = (memory(), [late], Config::default());
    let found = vet(&log, &runs, &config, false, &()).unwrap().found;
    let calibration = found[0].calibration.as_ref().unwrap();
    let profiles = profiles(&log, &runs, &found, &config, &()).unwrap();
    let time = &profiles[0];
    assert_eq!((profiles.len(), time.axis), (8, Axis::Time));
    let thickness_m = time.thickness_m[0].as_ref().unwrap();
    let thinnest = (0..thickness_m.len()).min_by(|&a, &b| thickness_m[a].total_cmp(&thickness_m[b])).unwrap();
    let step_s = time.values[1] - time.values[0];
    assert!((time.values[thinnest] - calibration.of(Axis::Time).value).abs() <= step_s, "{time:?}");
    let given = time.values.iter().position(|&value| value == 0.0).unwrap();
    let as_given_m = thickness_m[given];
    assert!((as_given_m / calibration.before_m - 1.0).abs() < 0.01, "{as_given_m} {}", calibration.before_m);
    assert!(thickness_m[thinnest] < 1.05 * calibration.after_m);
    // Height is not seen: nothing changes with it.
    let height_m = profiles[7].thickness_m[0].as_ref().unwrap();
    let least = height_m.iter().copied().fold(f64::INFINITY, f64::min);
    let most = height_m.iter().copied().fold(0.0, f64::max);
    assert!(most / least < 1.01, "{least} {most}");
}

#[test]
fn one_run_has_one_score_in_all_formats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = town();
    write_mcap(&path.join("town.mcap"), scans);
    let stamps_ns: Vec<i64> = scans.iter().filter_map(|scan| scan.stamp_ns).collect();
    let poses = stamps_ns.iter().map(|&ns| truth.world_from_body_at(ns, i64::MAX).unwrap());
    let at_scans = Trajectory::stamped(stamps_ns.iter().copied().zip(poses).collect()).unwrap().trajectory;
    let file = |name: &str| fs::File::create(path.join(name)).unwrap();
    write_tum(&mut file("tum.tum"), &at_scans).unwrap();
    write_kitti(&mut file("kitti.txt"), &at_scans).unwrap();
    let in_ns: String =
        fs::read_to_string(path.join("tum.tum")).unwrap().lines().skip(1).fold(String::new(), |all, line| {
            let (stamp, pose) = line.split_once(' ').unwrap();
            all + &format!("{} {pose}\n", stamp.replace('.', ""))
        });
    fs::write(path.join("ns.txt"), &in_ns).unwrap();
    let output = dmp(path, "score town.mcap -t tum.tum -t kitti.txt -t ns.txt --every 5 --json -q");
    let report: dmp::Report = serde_json::from_slice(&output.stdout).unwrap();
    for run in &report.runs {
        let apart = run.r_cv_m2[0].unwrap() / report.runs[0].r_cv_m2[0].unwrap() - 1.0;
        // Matrices are rounded otherwise than quaternions.
        assert!(apart.abs() < 1e-6, "{}: {apart}", run.name);
    }
    assert!(report.pairs.iter().all(|pair| pair.verdict.better().is_none()));
    // At an instant that they do not hold at, they are worse, all alike.
    let output =
        dmp(path, "score town.mcap -t tum.tum -t kitti.txt --pose-at end --every 5 --json -q --trust");
    let late: dmp::Report = serde_json::from_slice(&output.stdout).unwrap();
    assert!(late.runs[0].r_near_m2[2] > report.runs[0].r_near_m2[2]);
    assert!((late.runs[0].r_near_m2[2].unwrap() / late.runs[1].r_near_m2[2].unwrap() - 1.0).abs() < 1e-6);
    // In a unit that cannot be guessed.
    let seconds = in_ns.replace("0000000 ", "00 ");
    fs::write(path.join("us.txt"), seconds).unwrap();
    refused(path, "score town.mcap -t tum.tum --time-unit nobody=us", 2, &["no run has this name"]);
    refused(path, "score town.mcap -t kitti.txt --time-unit us", 2, &["kitti.txt", "has no stamps"]);
}

#[test]
fn a_log_of_which_only_the_index_is_read_is_vetted_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    write_mcap(&path, &town().0);
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    let wrong = Run { name: "inverse".into(), trajectory: moved(&town().1, Isometry3::inverse), ..truth() };
    let found = vet_outline(&outline, &[truth(), wrong], &Config::default(), false, &()).unwrap();
    words(&found);
    assert_eq!(found.is_kept(), [true, false]);
    assert!(matches!(found.found[1].left_out, Some(LeftOut::Misread)));
    assert_eq!(found.found[1].mends[0], Mend::PosesAs(PosesAs::Inverted));
}

#[test]
fn row_19_real_recordings_have_nothing_wrong() {
    let look = |folder: &Path, file: &str, body_from_sensor: Isometry3<f64>| {
        let trajectory = read_trajectory(&folder.join(file)).unwrap().trajectory;
        let run = Run { body_from_sensor: Some(body_from_sensor), ..Run::new("odometry", trajectory) };
        let found = vet(open(folder).as_ref(), &[run], &Config::default(), false, &()).unwrap();
        (words(&found), found.found.into_iter().next().unwrap().calibration)
    };
    let Some(nclt) = real_data("nclt_revisit") else { return };
    let (told, calibration) = look(&nclt, "poses_lidar_odometry.txt", Isometry3::identity());
    assert_eq!(told, [""; 0]);
    // Over flat ground height is not seen, and scans that are instants, a metre apart, tell no time; turns are seen.
    let seen = |axis: Axis| calibration.as_ref().unwrap().of(axis).is_seen;
    assert_eq!([Axis::Time, Axis::Yaw, Axis::Z].map(seen), [false, true, false]);
    // The sensor hung upside down; the poses are its own. With that undone:
    assert_eq!(look(&nclt, "poses_lidar_odometry.txt", turn(Vector3::x(), 180.0)).0.len(), 1);
    let Some(still) = real_data("rs32_static") else { return };
    assert_eq!(look(&still, "poses_icp_odom.txt", Isometry3::identity()).0, [""; 0]);
}
