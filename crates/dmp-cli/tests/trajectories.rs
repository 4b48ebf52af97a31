//! Trajectories of every format and of every body, as `dmp score` takes them.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::{code, dmp, folder, json, text};
use dmp_log::{parse_calib, read_trajectory, write_euroc, write_kitti, write_tum};
use dmp_sensor::{Isometry3, Trajectory, Vector3};
use serde_json::Value;

/// A LiDAR 0.27 m behind and 0.08 m above a camera that looks ahead; x right, y down, z ahead.
const TR: &str = "0 -1 0 0 0 0 -1 -0.08 1 0 0 -0.27";

/// The poses of the file with the body moved: `world_from_body` · `body_from_new`.
fn moved(path: &Path, body_from_new: &Isometry3<f64>) -> Trajectory {
    let poses = read_trajectory(path).unwrap().trajectory;
    Trajectory::unstamped(poses.poses().iter().map(|pose| pose * body_from_new).collect()).unwrap()
}

fn save_rows(path: &Path, trajectory: &Trajectory) {
    let mut text = Vec::new();
    write_kitti(&mut text, trajectory).unwrap();
    fs::write(path, text).unwrap();
}

/// A folder as KITTI has it: `07/velodyne/*.bin`, `07/times.txt`, and poses of the LiDAR in `lidar.txt`.
fn kitti(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    let town = "simulate town -o drive --truth lidar.txt --scans 40 --azimuth-steps 200 --instant --seed 3";
    let made = dmp(&folder, town);
    assert!(made.status.success(), "{made:?}");
    fs::create_dir(folder.join("07")).unwrap();
    fs::rename(folder.join("drive/scans"), folder.join("07/velodyne")).unwrap();
    fs::rename(folder.join("drive/times.txt"), folder.join("07/times.txt")).unwrap();
    folder
}

fn score(folder: &Path, arguments: &str) -> Value {
    let output = dmp(folder, &format!("score {arguments} --json -q"));
    assert_eq!((code(&output), text(&output.stderr)), (0, ""), "{arguments}: {output:?}");
    json(&output)
}

fn r_cv_m2(report: &Value, run: usize) -> f64 {
    report["runs"][run]["r_cv_m2"]["10"].as_f64().unwrap()
}

#[test]
fn one_trajectory_in_every_format_has_one_score() {
    let folder = kitti("formats");
    let rows = read_trajectory(&folder.join("lidar.txt")).unwrap().trajectory;
    let mut array = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 4, 4), }}", rows.len());
    array.extend(format!("{header:<117}\n").as_bytes());
    let mut graph = String::from("# a graph\nFIX 0\n");
    for (id, pose) in rows.poses().iter().enumerate().rev() {
        let matrix = pose.to_homogeneous();
        // Column by column of the transpose is row by row.
        array.extend(matrix.transpose().iter().flat_map(|number| number.to_le_bytes()));
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let _ =
            writeln!(graph, "VERTEX_SE3:QUAT {id} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    graph += "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1\n";
    // The array is in the order of the scans, the graph in that of its ids.
    let data = array.split_off(128);
    for pose in data.chunks(128).rev() {
        array.extend(pose);
    }
    fs::write(folder.join("array.npy"), array).unwrap();
    fs::write(folder.join("graph.g2o"), graph).unwrap();
    let report = score(&folder, "07 -t lidar.txt array.npy graph.g2o");
    assert!(r_cv_m2(&report, 0) > 0.0);
    for run in [1, 2] {
        assert!((r_cv_m2(&report, run) / r_cv_m2(&report, 0) - 1.0).abs() < 1e-6, "{report}");
    }
    let inputs = &report["inputs"]["runs"];
    for (run, file, format) in [(0, "lidar.txt", "KITTI"), (1, "array.npy", "NumPy"), (2, "graph.g2o", "g2o")]
    {
        assert_eq!((&inputs[run]["file"], &inputs[run]["format"]), (&file.into(), &format.into()));
        assert!(inputs[run]["notes"][0].as_str().unwrap().contains("n-th scan"), "{inputs}");
    }

    let truth = read_trajectory(&folder.join("truth.tum")).unwrap().trajectory;
    let mut csv = Vec::new();
    write_euroc(&mut csv, &truth).unwrap();
    fs::write(folder.join("truth.csv"), csv).unwrap();
    let report = score(&folder, "town.mcap -t tum=truth.tum -t euroc=truth.csv");
    assert_eq!(r_cv_m2(&report, 0).to_bits(), r_cv_m2(&report, 1).to_bits());
    assert_eq!(report["inputs"]["runs"][1]["format"], "EuRoC");
    let info = dmp(&folder, "info town.mcap -t truth.csv");
    assert!(text(&info.stdout).contains("EuRoC"), "{info:?}");
}

#[test]
fn the_format_can_be_given() {
    let folder = folder("format_given");
    // The stamps of a simulation, in nanoseconds without a heading: to the eye this is TUM.
    let truth = read_trajectory(&folder.join("truth.tum")).unwrap().trajectory;
    let mut csv = Vec::new();
    write_euroc(&mut csv, &truth).unwrap();
    let lines: Vec<&str> = text(&csv).lines().skip(1).collect();
    fs::write(folder.join("run.csv"), lines.join("\n") + "\n").unwrap();
    let found = dmp(&folder, "info town.mcap -t run.csv --poses-as euroc --json");
    assert_eq!(json(&found)["trajectories"][0]["format"], "EuRoC", "{found:?}");
    let scored = score(&folder, "town.mcap -t run.csv --poses-as euroc");
    assert_eq!(scored["inputs"]["runs"][0]["format"], "EuRoC");
    let other = dmp(&folder, "score town.mcap -t truth.tum --poses-as kitti");
    assert_eq!(code(&other), 1);
    assert!(text(&other.stderr).starts_with("error: truth.tum: line 2: 8 columns, expected 12"), "{other:?}");
    let unknown = dmp(&folder, "score town.mcap -t truth.tum --poses-as truth=pdf");
    assert_eq!(code(&unknown), 2);
    assert!(text(&unknown.stderr).contains("tum, kitti, euroc, npy, g2o"), "{unknown:?}");
}

#[test]
fn row_19_kittis_camera_is_brought_into_the_lidar() {
    let folder = kitti("camera");
    let velodyne_from_camera = parse_calib(format!("Tr: {TR}").as_bytes()).unwrap().inverse();
    save_rows(&folder.join("camera.txt"), &moved(&folder.join("lidar.txt"), &velodyne_from_camera));

    // Without a calibration the sensor is the body; the scans contradict that, and both are reported.
    let output = dmp(&folder, "score 07 -t camera.txt lidar.txt");
    assert_eq!(code(&output), 0, "{output:?}");
    for words in [
        "body_from_sensor: identity: neither a calib.txt nor frames say otherwise",
        "run `camera`: its poses are misread",
        "fix it with --extrinsic camera=0,0,0,0.5,-0.5,0.5,0.5",
    ] {
        // What runs are told of stands in the report.
        let lines = text(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
        let said = format!("{} {lines}", text(&output.stderr));
        assert!(said.contains(words), "no `{words}` in {output:?}");
    }

    fs::write(folder.join("07/calib.txt"), format!("P0: 1 2 3\nTr: {TR}\n")).unwrap();
    for log in ["07", "07/velodyne"] {
        let report = score(&folder, &format!("{log} -t camera.txt lidar.txt"));
        assert!((r_cv_m2(&report, 0) / r_cv_m2(&report, 1) - 1.0).abs() < 1e-3, "{report}");
        let inputs = &report["inputs"]["runs"];
        let source = |run: usize| inputs[run]["body_from_sensor_source"].as_str().unwrap();
        assert!(source(0).contains("calib.txt: the body travels along its z"), "{inputs}");
        assert!(source(1).starts_with("identity: the body travels along its x"), "{inputs}");
        let numbers: Vec<f64> = serde_json::from_value(inputs[0]["body_from_sensor"].clone()).unwrap();
        let expected = [0.0, -0.08, -0.27, 0.5, -0.5, 0.5, 0.5];
        let sign = numbers[6].signum();
        let rotation = numbers[3..].iter().map(|number| sign * number);
        let found = numbers[..3].iter().copied().chain(rotation);
        assert!(found.zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{numbers:?}");
        assert_eq!(report["config"]["body_from_sensor"], Value::Null);
    }
    // Scored as the LiDAR's, the camera's poses explain nothing.
    let report = score(&folder, "07 -t camera.txt lidar.txt --extrinsic identity --trust");
    assert_eq!((&report["order"][0], &report["pairs"][0]["verdict"]), (&"lidar".into(), &"lidar".into()));
    let identity = serde_json::json!([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(report["config"]["body_from_sensor"], identity);
    // Each run may have its own.
    let options = "--extrinsic camera=calib:07/calib.txt --extrinsic 0,0,0,0,0,0,1";
    let report = score(&folder, &format!("07 -t camera.txt lidar.txt {options}"));
    assert!((r_cv_m2(&report, 0) / r_cv_m2(&report, 1) - 1.0).abs() < 1e-3, "{report}");
    assert_eq!(report["inputs"]["runs"][1]["body_from_sensor_source"], "given");
}

#[test]
fn row_19_what_is_neither_camera_nor_lidar_is_asked_for() {
    let folder = kitti("askew");
    let askew = Isometry3::rotation(Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_4));
    save_rows(&folder.join("askew.txt"), &moved(&folder.join("lidar.txt"), &askew));
    fs::write(folder.join("calib.txt"), format!("Tr: {TR}\n")).unwrap();
    let asked = dmp(&folder, "score 07 -t askew.txt -q");
    assert_eq!((code(&asked), text(&asked.stdout)), (2, ""), "{asked:?}");
    for words in ["error: run `askew`: ", "(0.71, -0.7", "--extrinsic calib ", "--extrinsic identity "] {
        assert!(text(&asked.stderr).contains(words), "no `{words}` in {asked:?}");
    }
    for extrinsic in ["calib", "identity", "askew=calib"] {
        score(&folder, &format!("07 -t askew.txt --extrinsic {extrinsic}"));
    }
    for (options, words) in [
        ("--extrinsic none=calib", "--extrinsic none=…: no run has this name; the runs are askew"),
        ("--extrinsic calib --extrinsic identity", "calib and identity are both given for all runs"),
        ("--extrinsic calib:nowhere.txt", "nowhere.txt: no such file"),
    ] {
        let refused = dmp(&folder, &format!("score 07 -t askew.txt -q {options}"));
        assert_eq!(code(&refused), 2, "{refused:?}");
        assert!(text(&refused.stderr).contains(words), "{refused:?}");
    }
    fs::remove_file(folder.join("calib.txt")).unwrap();
    let none = dmp(&folder, "score 07 -t askew.txt -q --extrinsic calib");
    assert_eq!(code(&none), 2, "{none:?}");
    assert!(text(&none.stderr).contains("no calib.txt with Tr in "), "{none:?}");
    fs::write(folder.join("calib.txt"), "Tr: 1 2 3\n").unwrap();
    let broken = dmp(&folder, "score 07 -t askew.txt -q");
    assert_eq!(code(&broken), 1, "{broken:?}");
    assert!(text(&broken.stderr).contains("calib.txt: line 1: 3 columns, expected 12"), "{broken:?}");
}

#[test]
fn row_18_scans_without_a_pose_are_counted_and_too_few_are_refused() {
    let folder = folder("coverage");
    let truth = read_trajectory(&folder.join("truth.tum")).unwrap().trajectory;
    let stamps_ns = truth.stamps_ns().unwrap();
    let (first_ns, last_ns) = (stamps_ns[0], stamps_ns[stamps_ns.len() - 1]);
    let part = |name: &str, keep: &dyn Fn(f64) -> bool| {
        let share = |ns: i64| (ns - first_ns) as f64 / (last_ns - first_ns) as f64;
        let poses = stamps_ns.iter().copied().zip(truth.poses().iter().copied());
        let kept = Trajectory::stamped(poses.filter(|&(ns, _)| keep(share(ns))).collect()).unwrap();
        let mut text = Vec::new();
        write_tum(&mut text, &kept.trajectory).unwrap();
        fs::write(folder.join(name), text).unwrap();
    };
    part("half.tum", &|share| share <= 0.5);
    part("gap.tum", &|share| !(0.3..0.8).contains(&share));
    part("start.tum", &|share| share < 0.02);
    let report = score(&folder, "town.mcap -t truth.tum half.tum");
    let without = |run: usize| report["inputs"]["runs"][run]["scans_without_pose"].as_u64().unwrap();
    assert_eq!(without(0), 0);
    assert!((18..=22).contains(&without(1)), "{}", without(1));
    assert_eq!(report["inputs"]["scans_used"].as_u64().unwrap(), 40);
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("of 40 scans have no pose in `half`"), "{warnings}");

    let report = score(&folder, "town.mcap -t gap.tum --max-time-gap 0.2");
    let gap = report["inputs"]["runs"][0]["scans_without_pose"].as_u64().unwrap();
    assert!((18..=22).contains(&gap), "{gap}");

    let refused = dmp(&folder, "score town.mcap -t start.tum -q");
    assert_eq!((code(&refused), text(&refused.stdout)), (1, ""), "{refused:?}");
    let line = text(&refused.stderr);
    assert!(line.starts_with("error: run `start`: 1 of 40 scans have a pose: the log spans "), "{line}");
}
