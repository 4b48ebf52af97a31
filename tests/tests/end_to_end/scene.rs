//! The scene of `--scene`: what is in it, by the project's own readers; python/tests has what viewers make of it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use dmp_log::{LogOptions, PoseTopic, open_log, read_topic_trajectory};
use dmp_sensor::{Isometry3, Point3, Scan, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::common::{dmp, refused, text, workspace, write};

const RUNS: &str = "-t @/truth.tum -t @/drift.tum -t @/noise.tum";

/// What a command prints to standard error, and its JSON without what may differ from time to time.
fn scored(folder: &Path, arguments: &str) -> (String, Value) {
    let output = dmp(folder, &format!("score @/town.mcap {arguments} --json"));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    let mut json: Value = serde_json::from_slice(&output.stdout).unwrap();
    for part in ["timing", "memory"] {
        json.as_object_mut().unwrap().remove(part);
    }
    (stderr, json)
}

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
    let (_, bare) = scored(path, RUNS);
    let (said, with_scene) = scored(path, &format!("{RUNS} --scene one.mcap --threads 1 --save-maps maps"));
    assert_eq!(bare, with_scene);
    scored(path, &format!("{RUNS} --scene two.mcap --threads 2 --report page.html --residuals all.ply"));
    let [one, two] = ["one.mcap", "two.mcap"].map(|name| fs::read(path.join(name)).unwrap());
    assert!(one == two, "the bytes depend on threads or on what else is written");

    let scene = path.join("one.mcap");
    let scans = bare["sampling"]["frames_scored"].as_u64().unwrap() as usize;
    let counts = messages(&scene);
    let mut surfels = 0;
    for run in ["truth", "drift", "noise"] {
        for (what, expected) in [("map", 1), ("way", 1), ("path", 1), ("places", 1), ("labels", 1)] {
            assert_eq!(counts[&format!("/{run}/{what}")], expected, "{run} {what}");
        }
        for what in ["pose", "residual", "returns"] {
            assert_eq!(counts[&format!("/{run}/{what}")], scans, "{run} {what}");
        }
        let store = dmp_map::Store::open(&path.join(format!("maps/{run}.dmpmap"))).unwrap();
        let in_map: usize = store.entries().map(|entry| entry.own.surfels as usize).sum();
        assert_eq!(points(&scene, &format!("/{run}/map")).0.len(), in_map);
        surfels += in_map;
        assert_eq!(points(&scene, &format!("/{run}/way")).0.len(), scans);
        assert_eq!(poses(&scene, &format!("/{run}/path")), poses(&scene, &format!("/{run}/pose")));
    }
    assert_eq!(counts["/tf"], 3 * scans);
    let places: usize =
        ["truth", "drift", "noise"].iter().map(|run| points(&scene, &format!("/{run}/places")).0.len()).sum();
    assert_eq!(counts["/worst_places"], places);
    let thousands = format!("{},{:03}", surfels / 1000, surfels % 1000);
    assert!(said.contains(&format!("; all {thousands} surfels and all ")), "{said}");
}

/// The truth of the town in a world that is turned and lies far away.
fn elsewhere(folder: &Path) {
    let world = Isometry3::from_parts(
        Translation3::new(400_000.0, 5_000_000.0, 200.0),
        UnitQuaternion::from_euler_angles(0.02, -0.03, 2.0),
    );
    let truth = dmp_log::read_trajectory(&workspace().join("data-samples/truth.tum")).unwrap().trajectory;
    let mut tum = String::new();
    for (stamp_ns, pose) in truth.stamps_ns().unwrap().iter().zip(truth.poses()) {
        let moved = world * pose;
        let (place, turn) = (moved.translation.vector, moved.rotation.coords);
        let numbers: Vec<String> = place.iter().chain(turn.iter()).map(f64::to_string).collect();
        writeln!(tum, "{}.{:09} {}", stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000, numbers.join(" "))
            .unwrap();
    }
    write(folder, "far.tum", &tum);
}

#[test]
fn runs_of_other_worlds_lie_on_each_other_within_reach() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    elsewhere(path);
    for runs in ["-t far.tum -t @/truth.tum", "-t far.tum -t @/drift.tum"] {
        scored(path, &format!("{runs} --every 5 --scene scene.mcap"));
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
    scored(path, "-t far.tum -t @/truth.tum --every 5 --scene scene.mcap");
    let [far, truth] = ["/far/pose", "/truth/pose"].map(|topic| poses(&path.join("scene.mcap"), topic));
    for (a, b) in far.iter().zip(&truth) {
        assert!((a.translation.vector - b.translation.vector).norm() < 1e-3);
        assert!(a.rotation.angle_to(&b.rotation) < 1e-5);
    }
}

#[test]
fn what_cannot_be_shown_is_refused_before_it_is_scored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "log.mcap", "not a log");
    fs::copy(workspace().join("data-samples/truth.tum"), path.join("truth.tum")).unwrap();
    for (outputs, words) in [
        ("--scene out.rrd", &["out.rrd", "written as .mcap"][..]),
        ("--scene no/out.mcap", &["no/out.mcap", "no folder no"]),
        ("--scene ./log.mcap", &["log.mcap", "take the place of the input"]),
        ("--scene a.mcap --residuals a.mcap", &["a.mcap", "two outputs"]),
    ] {
        refused(path, &format!("score log.mcap -t truth.tum {outputs}"), 2, words);
    }
    let quick = dmp(path, "score log.mcap -t truth.tum --scene out.mcap --quick");
    assert_eq!(quick.status.code(), Some(2), "{}", text(&quick.stderr));
    assert!(text(&quick.stderr).contains("cannot be used with"), "{}", text(&quick.stderr));

    let output = dmp(path, "convert log @/town.mcap -o town --to bin --quiet");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    fs::remove_file(path.join("town/times.txt")).unwrap();
    write(path, "run.txt", &"1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(100));
    let score = "score town -t run.txt --point-time ignore --scene out.mcap";
    refused(path, score, 2, &["out.mcap", "no stamps", "--report"]);
    assert!(!path.join("out.mcap").exists());
}

#[cfg(unix)]
#[test]
fn a_full_disk_costs_no_scores() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("disk")).unwrap();
    let (dmp, samples) = (env!("CARGO_BIN_EXE_dmp-under-test"), workspace().join("data-samples"));
    let samples = samples.display();
    let script = format!(
        "mount -t tmpfs -o size=200k none disk || exit 99; \
         {dmp} score {samples}/town.mcap -t {samples}/truth.tum --every 5 --scene disk/out.mcap --work . --json --quiet \
         >out.json 2>out.txt; echo $? >out.code; ls -A disk >left.txt"
    );
    let mut command = std::process::Command::new("unshare");
    let output = command.args(["--map-root-user", "--mount", "sh", "-c", &script]).current_dir(path).output();
    match output {
        Ok(output) if output.status.code() != Some(99) && path.join("out.code").exists() => {}
        _ => {
            println!("skipped: this system does not let us mount a disk of our own");
            return;
        }
    }
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    assert_eq!((read("out.code").trim(), read("left.txt").as_str()), ("1", ""), "{}", read("out.txt"));
    let said = read("out.txt");
    assert!(said.contains("disk/out.mcap: cannot write") && said.contains("No space left"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let report: Value = serde_json::from_str(&read("out.json")).unwrap();
    assert_eq!(report["runs"][0]["name"], "truth");
}
