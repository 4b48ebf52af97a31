//! Trajectories in the messages of a log, and the frames of a log, as `dmp` takes them. The log is one that
//! other software wrote: `tests/conformance/README.md`.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn log() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance/mcap/poses.mcap")
}

fn dmp(arguments: &str) -> Output {
    let log = log().display().to_string();
    let arguments = arguments.split_whitespace().map(|argument| argument.replace("LOG", &log));
    Command::new(env!("CARGO_BIN_EXE_dmp")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// The run's inputs as `dmp score` reports them.
fn scored(arguments: &str) -> Value {
    let output = dmp(&format!("score LOG --json -q --min-range 0 {arguments}"));
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), ""), "{arguments}");
    serde_json::from_slice::<Value>(&output.stdout).unwrap()["inputs"]["runs"][0].clone()
}

fn refused(arguments: &str, words: &[&str]) {
    let output = dmp(&format!("score LOG -q --min-range 0 {arguments}"));
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(2), ""), "{arguments}: {output:?}");
    let line = text(&output.stderr);
    assert!(line.starts_with("error: ") && line.lines().count() == 1, "{line}");
    for word in words {
        assert!(line.contains(word), "no `{word}` in {line}");
    }
}

fn body_from_sensor(run: &Value) -> Vec<f64> {
    serde_json::from_value(run["body_from_sensor"].clone()).unwrap()
}

const BASE_FROM_LIDAR: [f64; 7] = [
    0.25,
    -0.05,
    1.1,
    -0.034_394_720_117_454_244,
    0.044_007_597_585_983_445,
    0.199_583_487_795_747_94,
    0.978_287_670_361_860_8,
];

fn is_base_from_lidar(run: &Value) -> bool {
    body_from_sensor(run).iter().zip(BASE_FROM_LIDAR).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn a_topic_of_the_log_or_of_another_bag_is_a_trajectory() {
    for trajectory in ["topic:/odom", "LOG:/odom", "a=topic:/tf:odom:base_link"] {
        let run = scored(&format!("-t {trajectory}"));
        assert!(is_base_from_lidar(&run), "{run}");
        assert_eq!(run["body_from_sensor_source"], "/tf_static: `lidar` on `base_link`");
        assert_eq!((&run["pairing"], &run["scans_without_pose"]), (&"by stamp".into(), &0.into()));
    }
    let run = scored("-t topic:/odom");
    let [name, file, format] = ["name", "file", "format"].map(|key| run[key].as_str().unwrap());
    assert_eq!((name, file, format), ("odom", "topic:/odom", "Odometry"));
    // The tree of frames gives the sensor's own poses.
    let run = scored("-t topic:/tf");
    assert_eq!(body_from_sensor(&run), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(run["body_from_sensor_source"], "identity: the trajectory moves the scans' frame `lidar`");
    assert!(run["notes"][0].as_str().unwrap().contains("`lidar` in `map`"), "{run}");
    let info = dmp("info LOG -t topic:/odom --json");
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!(
        (&info["trajectories"][0]["format"], &info["trajectories"][0]["poses"]),
        (&"Odometry".into(), &11.into())
    );
}

#[test]
fn row_19_what_does_not_name_its_frame_is_asked_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.tum");
    let line = |s: f64| format!("{:.9} {s} 0 0 0 0 0 1\n", 1_700_000_000.0 + s);
    std::fs::write(&file, line(0.0) + &line(1.0)).unwrap();
    let file = file.display().to_string();
    for trajectory in ["topic:/slam/pose", "topic:/slam/path", "topic:/slam/pose_with_covariance", &file] {
        refused(
            &format!("-t {trajectory}"),
            &[
                "does not say which frame it moves",
                "--extrinsic identity (the scans' own `lidar`)",
                "--extrinsic frame:base_link",
            ],
        );
        let run = scored(&format!("-t {trajectory} --extrinsic frame:base_link"));
        assert!(is_base_from_lidar(&run), "{run}");
        let run = scored(&format!("-t {trajectory} --extrinsic identity"));
        assert_eq!(run["body_from_sensor_source"], "identity: as given");
    }
    refused(
        "-t topic:/odom --extrinsic frame:camera",
        &["where the scans' frame `lidar` is on the body's `camera`", "--extrinsic X,Y,Z"],
    );
    refused("-t topic:/tf:map:odom", &["`lidar` is on the body's `odom`"]);
}

#[test]
fn topics_that_are_not_there_are_named() {
    refused("-t topic:/nope", &["poses.mcap: no topic `/nope` with poses", "/odom ["]);
    refused("-t topic:/points", &["no topic `/points` with poses"]);
    refused("-t LOG", &["several topics hold poses", "/odom, /slam/path, /slam/pose, "]);
    refused("-t topic:/odom:map", &["/odom holds Odometry: world and body are chosen in /tf only"]);
    refused("-t topic:/tf:nowhere", &["`nowhere` is not above `lidar`"]);
    refused("-t nothing.mcap:/odom", &["nothing.mcap: no such file"]);
    refused("-t topic:", &["`` is no topic: try topic:/odom"]);
}
