//! The scene of `--scene`: what is in it, by the project's own readers; python/tests has what viewers make of it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use dmp_log::{LogOptions, PoseTopic, open_log, read_topic_trajectory};
use dmp_sensor::{Isometry3, Point3, Scan, Translation3, UnitQuaternion, Vector3};

use crate::common::{SCORE, TWO, done, misused, once, refused, sample, save_tum, scores, trajectory, write};

/// How many messages of each topic there are.
fn messages(path: &Path) -> BTreeMap<String, usize> {
    let bytes = fs::read(path).unwrap();
    let mut counts = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        *counts.entry(message.unwrap().channel.topic.clone()).or_default() += 1;
    }
    counts
}

/// The first message with points of a topic, and how many messages of it there are.
fn points(path: &Path, topic: &str) -> (Scan, usize) {
    let options = LogOptions { topic: Some(topic.into()), ..LogOptions::default() };
    let log = open_log(path, &options).unwrap();
    let mut scan = Scan::default();
    log.reader().unwrap().read(0, &mut scan).unwrap();
    (scan, log.frames().len())
}

fn poses(path: &Path, topic: &str) -> Vec<Isometry3<f64>> {
    let topic = PoseTopic { topic: Some(topic.into()), ..PoseTopic::default() };
    read_topic_trajectory(path, &topic, None).unwrap().trajectory.poses().to_vec()
}

#[test]
fn a_scene_shows_all_and_changes_no_score() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let bare = once(&format!("{TWO} --json --quiet"));
    let one = once(&format!("{TWO} --json --quiet --threads 1 --scene one.mcap"));
    assert_eq!(scores(&one.output.stdout), scores(&bare.output.stdout));
    done(path, &format!("{TWO} --quiet --threads 2 --scene two.mcap --report page.html --residuals all.ply"));
    let scene = one.folder.join("one.mcap");
    let same = fs::read(&scene).unwrap() == fs::read(path.join("two.mcap")).unwrap();
    assert!(same, "the bytes depend on threads or on what else is written");

    let report = bare.json();
    let scans = report["sampling"]["frames_scored"].as_u64().unwrap() as usize;
    let counts = messages(&scene);
    for (k, run) in ["truth", "drift"].into_iter().enumerate() {
        for what in ["map", "way", "path", "places", "labels"] {
            assert_eq!(counts[&format!("/{run}/{what}")], 1, "{run} {what}");
        }
        for what in ["pose", "residual", "returns"] {
            assert_eq!(counts[&format!("/{run}/{what}")], scans, "{run} {what}");
        }
        let of_run = |field: &str| report["runs"][k][field].as_u64().unwrap() as usize;
        let drawn = points(&scene, &format!("/{run}/map")).0.len();
        assert_eq!(drawn, of_run("surfels") - of_run("surfels_contradicted"));
        assert_eq!(points(&scene, &format!("/{run}/way")).0.len(), scans);
        assert_eq!(poses(&scene, &format!("/{run}/path")), poses(&scene, &format!("/{run}/pose")));
    }
    assert_eq!(counts["/tf"], 2 * scans);
    let places = ["truth", "drift"].map(|run| points(&scene, &format!("/{run}/places")).0.len());
    assert_eq!(counts["/worst_places"], places[0] + places[1]);
}

/// The truth of the town in a world that is turned and lies far away.
fn elsewhere(folder: &Path) {
    let world = Isometry3::from_parts(
        Translation3::new(400_000.0, 5_000_000.0, 200.0),
        UnitQuaternion::from_euler_angles(0.02, -0.03, 2.0),
    );
    save_tum(&folder.join("far.tum"), &trajectory(&sample("truth.tum")).moved(&world));
}

#[test]
fn runs_of_other_worlds_lie_on_each_other_within_reach() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    elsewhere(path);
    for runs in ["-t far.tum -t @/drift.tum", "-t far.tum -t @/truth.tum"] {
        done(path, &format!("{SCORE} {runs} --every 5 --scene scene.mcap"));
        let scene = path.join("scene.mcap");
        let far = poses(&scene, "/far/pose");
        assert!(far.iter().all(|pose| pose.translation.vector.amax() < 10_000.0), "{runs}");
        // A map is where the returns are that it was made of.
        let (returns, scans) = points(&scene, "/far/returns");
        assert_eq!(scans, 20);
        let (map, _) = points(&scene, "/far/map");
        let nearest_m = |place: Point3<f64>| {
            let to = |point: &[f32; 3]| (Vector3::from(point.map(f64::from)) - place.coords).norm();
            map.points_in_sensor_m.iter().map(to).fold(f64::INFINITY, f64::min)
        };
        let some = returns.points_in_sensor_m.iter().step_by(50);
        let mut apart_m: Vec<f64> =
            some.map(|point| nearest_m(far[0] * Point3::from(point.map(f64::from)))).collect();
        apart_m.sort_by(f64::total_cmp);
        assert!(apart_m[apart_m.len() / 2] < 0.4, "{runs}: {}", apart_m[apart_m.len() / 2]);
    }
    let [far, truth] = ["/far/pose", "/truth/pose"].map(|topic| poses(&path.join("scene.mcap"), topic));
    for (a, b) in far.iter().zip(&truth) {
        assert!((a.translation.vector - b.translation.vector).norm() < 1e-3);
        assert!(a.rotation.angle_to(&b.rotation) < 1e-5);
    }
}

#[test]
fn a_scene_that_cannot_be_written_is_refused_before_the_score() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "log.mcap", "not a log");
    fs::copy(sample("truth.tum"), path.join("truth.tum")).unwrap();
    for (outputs, words) in [
        ("--scene out.rrd", &["out.rrd", "written as .mcap"][..]),
        ("--scene no/out.mcap", &["no/out.mcap", "no folder no"]),
        ("--scene ./log.mcap", &["log.mcap", "take the place of the input"]),
        ("--scene a.mcap --residuals a.mcap", &["a.mcap", "two outputs"]),
    ] {
        refused(path, &format!("score log.mcap -t truth.tum {outputs}"), 2, words);
    }
    misused(path, "score log.mcap -t truth.tum --scene out.mcap --quick", &["cannot be used with"]);
}
