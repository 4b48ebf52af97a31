//! A given map in another frame than the trajectory, on the sample town: it is told with its cause, the right ones are not.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use dmp::{Config, MapSource, Note, Progress, Report, Run, evaluate};
use dmp_log::read_trajectory;
use dmp_sensor::{Isometry3, Trajectory, UnitQuaternion, Vector3};

use crate::common::{open, workspace};

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

/// Ends with its cause.
const HINT: &str = "are where its map has a surface";
const FRAME: &str = "is the map in the trajectory's frame";

/// The hints of all runs, which must have been told on the way too.
fn hints_of(log: &Path, runs: &[Run], config: &Config) -> Vec<String> {
    let told = Told::default();
    let report: Report = evaluate(open(log).as_ref(), runs, config, &told).unwrap();
    let is_hint = |text: &&String| text.contains(HINT) || text.contains(FRAME);
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

fn turn(axis: Vector3<f64>, degrees: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::new(axis * degrees.to_radians()))
}

#[test]
fn row_19_right_maps_get_no_hint_however_bad_the_runs_are() {
    let folder = tempfile::tempdir().unwrap();
    let map = saved_map(folder.path());
    let runs = ["truth", "noise", "drift", "collapsed"].map(|name| Run {
        map: MapSource::Given(map.clone()),
        ..Run::new(name, trajectory(&format!("{name}.tum")))
    });
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
    assert!(hint.contains("the trajectory is around (300") && hint.contains("499,882 m apart"), "{hint}");
    let hint = given(Vector3::new(3.0, 5.0, 10.0), 40.0);
    assert!(hint.contains(HINT) && hint.contains(FRAME), "{hint}");
}
