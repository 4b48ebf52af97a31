//! Wrong frames and wrong clocks on the sample town: each is told with its cause, the right ones are not.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use dmp::{Config, MapSource, Note, Progress, Report, Run, evaluate};
use dmp_log::read_trajectory;
use dmp_sensor::{Isometry3, Trajectory, UnitQuaternion, Vector3};

use crate::common::{dmp, open, real_data, text, workspace};

fn sample(name: &str) -> PathBuf {
    workspace().join("data-samples").join(name)
}

fn trajectory(name: &str) -> Trajectory {
    read_trajectory(&sample(name)).unwrap().trajectory
}

fn moved(trajectory: &Trajectory, pose: impl Fn(&Isometry3<f64>) -> Isometry3<f64>) -> Trajectory {
    let stamps = trajectory.stamps_ns().unwrap().iter().copied();
    Trajectory::stamped(stamps.zip(trajectory.poses().iter().map(pose)).collect()).unwrap().trajectory
}

/// Keeps what is told on the way.
#[derive(Default)]
struct Told(Mutex<Vec<String>>);

impl Progress for Told {
    fn note(&self, note: &Note) {
        self.0.lock().unwrap().push(note.to_string());
    }
}

const HINTS: [&str; 2] = ["meet those of other scans", "is the map in the trajectory's frame"];

/// The hints of all runs, which must have been told on the way too.
fn hints_of(log: &Path, runs: &[Run], config: &Config) -> Vec<String> {
    let told = Told::default();
    let report: Report = evaluate(open(log).as_ref(), runs, config, &told).unwrap();
    let is_hint = |text: &&String| HINTS.iter().any(|hint| text.contains(hint));
    let mut hints = Vec::new();
    for run in &report.runs {
        let warnings: Vec<String> = run.warnings.iter().map(ToString::to_string).collect();
        hints.extend(warnings.iter().filter(is_hint).map(|hint| format!("run `{}`: {hint}", run.name)));
    }
    let told = told.0.into_inner().unwrap();
    assert_eq!(told.iter().filter(is_hint).cloned().collect::<Vec<_>>(), hints);
    hints.iter().for_each(|hint| println!("{hint}"));
    hints
}

/// The only hint of a run on the sample town.
fn hint_of(run: Trajectory, config: &Config) -> String {
    let hints = hints_of(&sample("town.mcap"), &[Run::new("a", run)], config);
    assert_eq!(hints.len(), 1, "{hints:?}");
    hints.into_iter().next().unwrap()
}

fn turn(axis: Vector3<f64>, degrees: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::new(axis * degrees.to_radians()))
}

#[test]
fn row_19_right_runs_get_no_hint_however_bad_they_are() {
    let runs = ["truth", "noise", "drift", "collapsed"]
        .map(|name| Run::new(name, trajectory(&format!("{name}.tum"))));
    assert_eq!(hints_of(&sample("town.mcap"), &runs, &Config::default()), [""; 0]);
    // In the map of the truth too.
    let folder = tempfile::tempdir().unwrap();
    let map = saved_map(folder.path());
    let runs = runs.map(|run| Run { map: MapSource::Given(map.clone()), ..run });
    assert_eq!(hints_of(&sample("town.mcap"), &runs, &Config::default()), [""; 0]);
}

/// The map of the truth, kept.
fn saved_map(folder: &Path) -> PathBuf {
    let config = Config { save_maps: Some(folder.to_path_buf()), ..Config::default() };
    evaluate(open(&sample("town.mcap")).as_ref(), &[Run::new("truth", trajectory("truth.tum"))], &config, ())
        .unwrap();
    folder.join("truth.dmpmap")
}

#[test]
fn row_19_a_wrong_extrinsic_is_told_with_the_right_one() {
    for (degrees, told) in [
        (90.0, "by -90° about its z axis"),
        (-90.0, "by 90° about its z axis"),
        (180.0, "by 180° about its z axis"),
    ] {
        let config = Config { body_from_sensor: turn(Vector3::z(), degrees), ..Config::default() };
        let hint = hint_of(trajectory("truth.tum"), &config);
        // A turn by 180° is as well undone by leaving it out or by turning it round.
        let named = hint.contains(told) || hint.contains("no extrinsic") || hint.contains("other way round");
        assert!(named && hint.contains("is --extrinsic wrong"), "{hint}");
    }
    let upside_down = Config { body_from_sensor: turn(Vector3::x(), 180.0), ..Config::default() };
    let hint = hint_of(trajectory("truth.tum"), &upside_down);
    assert!(hint.contains("is --extrinsic wrong"), "{hint}");
    // Poses of a body beside the sensor, with the extrinsic the wrong way round.
    let mut body_from_sensor = turn(Vector3::z(), 120.0);
    body_from_sensor.translation.vector = Vector3::new(1.2, -0.4, 0.9);
    let body = moved(&trajectory("truth.tum"), |pose| pose * body_from_sensor.inverse());
    let config = Config { body_from_sensor: body_from_sensor.inverse(), ..Config::default() };
    let hint = hint_of(body, &config);
    assert!(hint.contains("with the extrinsic the other way round"), "{hint}");
    // Poses of a camera that looks ahead: KITTI's own.
    let camera_from_sensor = turn(Vector3::x(), 90.0) * turn(Vector3::z(), 90.0);
    let ahead = camera_from_sensor * Vector3::x();
    assert!(
        (ahead - Vector3::z()).norm() < 1e-12
            && (camera_from_sensor * Vector3::z() + Vector3::y()).norm() < 1e-12
    );
    let camera =
        moved(&trajectory("truth.tum"), |pose| camera_from_sensor * pose * camera_from_sensor.inverse());
    let hint = hint_of(camera, &Config::default());
    assert!(hint.contains("with poses taken for those of a camera"), "{hint}");
}

#[test]
fn row_19_wrong_times_are_told_with_the_shift() {
    for (offset_ns, told) in [
        (1_000_000_000, "shifted by -1 s"),
        (-1_000_000_000, "shifted by 1 s"),
        (500_000_000, "shifted by -0.5 s"),
    ] {
        let config = Config { time_offset_ns: offset_ns, ..Config::default() };
        let hint = hint_of(trajectory("truth.tum"), &config);
        assert!(hint.contains(told) && hint.ends_with("is --time-offset wrong?"), "{hint}");
    }
    // What a tenth of a second does is too little to be told from a bad trajectory.
    let config = Config { time_offset_ns: 100_000_000, ..Config::default() };
    assert_eq!(hints_of(&sample("town.mcap"), &[Run::new("a", trajectory("truth.tum"))], &config), [""; 0]);
}

#[test]
fn row_19_inverse_poses_are_told() {
    let hint = hint_of(moved(&trajectory("truth.tum"), Isometry3::inverse), &Config::default());
    assert!(hint.contains("with the poses inverted") && hint.contains("sensor_from_world"), "{hint}");
}

#[test]
fn row_19_a_map_in_another_frame_is_told_with_both_places() {
    let folder = tempfile::tempdir().unwrap();
    let map = saved_map(folder.path());
    let truth = trajectory("truth.tum");
    let given = |shift: Vector3<f64>, degrees: f64| {
        let world = Isometry3::from_parts(shift.into(), turn(Vector3::z(), degrees).rotation);
        let run = moved(&truth, |pose| world * pose);
        let runs = [Run { map: MapSource::Given(map.clone()), ..Run::new("a", run) }];
        let hints = hints_of(&sample("town.mcap"), &runs, &Config::default());
        assert_eq!(hints.len(), 1, "{hints:?}");
        hints.into_iter().next().unwrap()
    };
    let hint = given(Vector3::new(300_000.0, 400_000.0, 0.0), 0.0);
    assert!(hint.contains("the trajectory is around (300") && hint.contains("499882 m apart"), "{hint}");
    let hint = given(Vector3::new(3.0, 5.0, 10.0), 40.0);
    assert!(hint.contains("are where its map has a surface"), "{hint}");
}

/// The command tells it before the report, and in it.
#[test]
fn row_19_the_command_tells_the_hint_early_and_in_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let output = dmp(folder.path(), "score @/town.mcap -t a=@/truth.tum --time-offset 1");
    assert!(output.status.success());
    let words = "with the times shifted by -1 s";
    assert!(text(&output.stderr).contains("note: run `a`: only "), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains(words) && text(&output.stdout).contains(words));
    let output = dmp(folder.path(), "score @/town.mcap -t a=@/truth.tum --quiet");
    assert!(text(&output.stderr).is_empty());
}

#[test]
fn row_19_real_recordings_get_no_hint() {
    let Some(nclt) = real_data("nclt_revisit") else { return };
    let run = read_trajectory(&nclt.join("poses_lidar_odometry.txt")).unwrap().trajectory;
    assert_eq!(hints_of(&nclt, &[Run::new("odometry", run.clone())], &Config::default()), [""; 0]);
    // The sensor hung upside down; the poses are its own. With that undone:
    let config = Config { body_from_sensor: turn(Vector3::x(), 180.0), ..Config::default() };
    assert_eq!(hints_of(&nclt, &[Run::new("odometry", run)], &config).len(), 1);
    let Some(still) = real_data("rs32_static") else { return };
    let run = read_trajectory(&still.join("poses_icp_odom.txt")).unwrap().trajectory;
    assert_eq!(hints_of(&still, &[Run::new("still", run)], &Config::default()), [""; 0]);
}
