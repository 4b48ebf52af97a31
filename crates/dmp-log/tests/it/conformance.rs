//! Files of other software against what is in them: `tests/conformance/README.md` says what wrote them and
//! what the JSON means. The folders are listed, so a new file there is tested without a word here.

use crate::common::read_all;
use crate::ros1::ALL;
use dmp_log::{
    LengthUnit, LogError, LogOptions, PoseTopic, open_log, read_cloud, read_mesh, read_pose_graph,
    read_topic_trajectory, read_trajectory,
};
use dmp_sensor::Isometry3;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Clouds that say their unit in a way that is not understood: it has to be given.
const UNIT_GIVEN: [(&str, LengthUnit); 1] = [("feet_us_geotiff_code", LengthUnit::UsSurveyFoot)];

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance").join(name)
}

/// Every JSON of a folder, with its name.
fn expectations(name: &str) -> Vec<(String, Value)> {
    let mut found: Vec<(String, Value)> = fs::read_dir(folder(name))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .map(|path| {
            let json = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            (path.file_stem().unwrap().to_string_lossy().into_owned(), json)
        })
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

/// The strings of a list; none where there is no list.
fn names<'a>(json: &'a Value, list: &str) -> impl Iterator<Item = &'a str> {
    json[list].as_array().into_iter().flatten().map(|name| name.as_str().unwrap())
}

fn list<'a>(json: &'a Value, name: &str) -> &'a [Value] {
    json[name].as_array().unwrap()
}

/// `null` is NaN here; which of the numbers that are not finite it was does not matter.
fn numbers<const N: usize>(row: &Value) -> [f64; N] {
    let row = row.as_array().unwrap();
    assert_eq!(row.len(), N);
    std::array::from_fn(|k| row[k].as_f64().unwrap_or(f64::NAN))
}

fn integers(json: &Value) -> Option<Vec<i64>> {
    Some(json.as_array()?.iter().map(|value| value.as_i64().unwrap()).collect())
}

/// Every file of the folder is named in one of its JSON.
fn assert_all_named(name: &str) {
    let expectations = expectations(name);
    let mut named: Vec<&str> = expectations
        .iter()
        .flat_map(|(_, json)| {
            let lists =
                ["files", "compressed_files", "refused"].into_iter().flat_map(|list| names(json, list));
            lists.chain(json["times"].as_str())
        })
        .collect();
    named.sort_unstable();
    named.dedup();
    let mut found: Vec<String> = fs::read_dir(folder(name))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|file| !["json", "py"].contains(&file.rsplit('.').next().unwrap()) && file != "__pycache__")
        .collect();
    found.sort_unstable();
    assert_eq!(found, named, "{name}");
}

#[test]
fn no_file_of_other_software_is_left_out() {
    for name in ["mcap", "rosbag1", "rosbag2", "clouds", "trajectories"] {
        assert_all_named(name);
    }
}

/// Compares every topic with scans of a log, each chosen by name.
fn assert_log(path: &Path, topics: &[Value]) {
    for topic in topics.iter().filter(|topic| topic["kind"] == "scans") {
        let name = topic["topic"].as_str().unwrap();
        let place = format!("{} {name}", path.display());
        let options = LogOptions { topic: Some(name.into()), ..LogOptions::default() };
        let log = open_log(path, &options).unwrap();
        let summary = log.summary();
        assert_eq!(summary.frame_id.as_deref(), topic["frame_id"].as_str(), "{place}");
        assert!(summary.damage.is_empty(), "{place}: {:?}", summary.damage);
        assert_eq!(
            summary.has_point_times(),
            topic["time_field"].is_object(),
            "{place}: {:?}",
            summary.notes
        );
        let scans = read_all(log.as_ref());
        assert_eq!(scans.len(), list(topic, "scans").len(), "{place}");
        for (number, (scan, wanted)) in scans.iter().zip(list(topic, "scans")).enumerate() {
            let place = format!("{place}, scan {number}");
            assert_eq!(scan.stamp_ns, wanted["stamp_ns"].as_i64(), "{place}");
            let points = list(wanted, "points").iter().map(|row| numbers::<3>(row).map(|c| c as f32));
            assert_eq!(scan.len(), points.len(), "{place}");
            for (k, (point, wanted)) in scan.points_in_sensor_m.iter().zip(points).enumerate() {
                let same = |(a, b): (&f32, f32)| *a == b || !a.is_finite() && !b.is_finite();
                assert!(point.iter().zip(wanted).all(same), "{place}, point {k}: {point:?}, not {wanted:?}");
            }
            let wanted = integers(&wanted["offsets_ns"]).unwrap_or_default();
            assert_eq!(scan.time_offsets_ns, wanted, "{place}");
        }
    }
}

#[test]
fn logs_of_other_software_are_read() {
    for kind in ["mcap", "rosbag1"] {
        for (_, json) in expectations(kind) {
            for file in names(&json, "files") {
                assert_log(&folder(kind).join(file), list(&json, "topics"));
            }
        }
    }
}

#[test]
fn bags_of_other_software_are_read() {
    for (_, json) in expectations("rosbag2") {
        for file in names(&json, "files") {
            assert_log(&folder("rosbag2").join(file), list(&json, "topics"));
        }
        for file in names(&json, "compressed_files") {
            let error =
                open_log(&folder("rosbag2").join(file), &LogOptions::default()).unwrap_err().to_string();
            assert!(error.contains("compression_mode") && error.contains("ros2 bag convert"), "{error}");
        }
    }
}

#[test]
fn of_several_topics_one_must_be_named() {
    for (name, json) in expectations("mcap") {
        let clouds: Vec<&Value> =
            list(&json, "topics").iter().filter(|topic| topic["kind"] == "scans").collect();
        for file in names(&json, "files") {
            let opened = open_log(&folder("mcap").join(file), &LogOptions::default());
            if clouds.len() == 1 {
                assert_eq!(opened.unwrap().summary().topic.as_deref(), clouds[0]["topic"].as_str(), "{name}");
                continue;
            }
            let error = opened.unwrap_err();
            assert!(matches!(error, LogError::SeveralTopics { .. }), "{file}: {error}");
            for topic in &clouds {
                assert!(error.to_string().contains(topic["topic"].as_str().unwrap()), "{file}: {error}");
            }
        }
    }
}

#[test]
fn clouds_of_other_software_are_read_in_metres() {
    let mut compared = 0;
    for (name, json) in expectations("clouds") {
        let is_float32 = json["coordinates"] == "float32";
        if json["faces"].is_array() {
            continue;
        }
        let unit = UNIT_GIVEN.iter().find(|(given, _)| *given == name).map(|&(_, unit)| unit);
        for file in names(&json, "files") {
            let path = folder("clouds").join(file);
            let mut points = Vec::new();
            let result = read_cloud(&path, unit, |batch| {
                points.extend_from_slice(batch);
                Ok::<(), LogError>(())
            });
            let units = [&json["unit_m"]["horizontal"], &json["unit_m"]["vertical"]].map(Value::as_f64);
            let [Some(horizontal_m), Some(vertical_m)] = units else {
                assert!(result.unwrap_err().to_string().contains("degrees"), "{file}");
                compared += 1;
                continue;
            };
            let summary = result.unwrap();
            let wanted: Vec<[f64; 3]> = list(&json, "points").iter().map(numbers).collect();
            assert_eq!((points.len(), summary.points), (wanted.len(), wanted.len() as u64), "{file}");
            // The order of the sums of integer, scale and offset may differ: a thousandth of a scale of 1 mm.
            let tolerance =
                if json["coordinates"].as_str().unwrap().starts_with("integers") { 1e-6 } else { 0.0 };
            for (k, (point, wanted)) in points.iter().zip(&wanted).enumerate() {
                let [x, y, z] = wanted.map(|c| if is_float32 { f64::from(c as f32) } else { c });
                let wanted = [x * horizontal_m, y * horizontal_m, z * vertical_m];
                let same =
                    |(a, b): (&f64, f64)| !a.is_finite() && !b.is_finite() || (a - b).abs() <= tolerance;
                assert!(point.iter().zip(wanted).all(same), "{file}, point {k}: {point:?}, not {wanted:?}");
            }
            compared += 1;
        }
    }
    assert!(compared > 0);
}

#[test]
fn meshes_of_other_software_are_read_in_full() {
    let mut compared = 0;
    for (_, json) in expectations("clouds") {
        let Some(faces) = json["faces"].as_array() else { continue };
        let corners: Vec<[f64; 3]> = list(&json, "points").iter().map(numbers).collect();
        let wanted: Vec<[[f64; 3]; 3]> =
            faces.iter().map(|face| numbers::<3>(face).map(|corner| corners[corner as usize])).collect();
        for file in names(&json, "files") {
            let mut triangles = Vec::new();
            let summary = read_mesh(&folder("clouds").join(file), |batch| {
                triangles.extend_from_slice(batch);
                Ok::<(), LogError>(())
            });
            assert_eq!(summary.unwrap().vertices, corners.len() as u64, "{file}");
            assert_eq!(triangles, wanted, "{file}");
            compared += 1;
        }
    }
    assert!(compared > 0);
}

#[test]
fn trajectories_of_other_software_are_read() {
    for (_, json) in expectations("trajectories") {
        for file in names(&json, "refused") {
            let error = read_trajectory(&folder("trajectories").join(file)).unwrap_err();
            assert!(error.to_string().contains(file), "{error}");
        }
        for file in names(&json, "files") {
            let path = folder("trajectories").join(file);
            let read = read_trajectory(&path).unwrap();
            assert_eq!((read.out_of_order, read.repeated), (0, 0), "{file}");
            let trajectory = read.trajectory;
            let stamps_ns = trajectory.stamps_ns().map(<[i64]>::to_vec);
            assert_eq!(stamps_ns, integers(&json["stamps_ns"]), "{file}");
            let tolerance = json["quaternion_tolerance"].as_f64().unwrap();
            assert_poses(trajectory.poses(), list(&json, "poses"), [1e-14, tolerance], file);
            if json["ids"].is_array() {
                assert_graph(&path, &json, tolerance);
            }
        }
    }
}

/// The graph of the same file, where it is in space.
fn assert_graph(path: &Path, json: &Value, tolerance: f64) {
    let graph = match read_pose_graph(path) {
        Ok(file) => file.graph,
        Err(error) => {
            assert!(
                path.ends_with("gtsam_flat.g2o") && error.to_string().contains("in the plane"),
                "{error}"
            );
            return;
        }
    };
    assert_eq!(Some(graph.ids().to_vec()), integers(&json["ids"]));
    assert_poses(graph.poses(), list(json, "poses"), [1e-14, tolerance], "graph");
    let edges = list(json, "edges");
    assert!(!edges.is_empty() && edges.len() == graph.edges().len());
    for (edge, wanted) in graph.edges().iter().zip(edges) {
        assert_eq!([Some(edge.from), Some(edge.to)], ["from", "to"].map(|end| wanted[end].as_i64()));
        let pose = std::slice::from_ref(&wanted["pose"]);
        assert_poses(&[edge.from_from_to], pose, [1e-14, tolerance], "edge");
        let upper = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        let upper: Vec<f64> = upper.map(|place| edge.information[place]).collect();
        assert_eq!(upper, numbers::<21>(&wanted["information"]));
    }
}

/// To `place` metres, and to `turn` in each number of the quaternion, either sign.
fn assert_poses(poses: &[Isometry3<f64>], wanted: &[Value], [place, turn]: [f64; 2], what: &str) {
    assert_eq!(poses.len(), wanted.len(), "{what}");
    for (k, (pose, wanted)) in poses.iter().zip(wanted).enumerate() {
        let [x, y, z, quaternion @ ..] = numbers::<7>(wanted);
        let found = pose.translation.vector;
        let apart = (found - dmp_sensor::Translation3::new(x, y, z).vector).amax();
        assert!(apart <= place, "{what}, pose {k}: {found:?}, not {x} {y} {z}");
        let norm = quaternion.iter().map(|c| c * c).sum::<f64>().sqrt();
        let found = pose.rotation.coords;
        let off =
            |sign: f64| (0..4).map(|c| (found[c] - sign * quaternion[c] / norm).abs()).fold(0.0, f64::max);
        assert!(off(1.0).min(off(-1.0)) <= turn, "{what}, pose {k}: {found:?}, not {quaternion:?}");
    }
}

#[test]
fn topics_with_poses_of_other_software_are_read_and_frames_are_chained() {
    let (_, json) = expectations("mcap").into_iter().find(|(name, _)| name == "poses").unwrap();
    let bags = ALL.map(|packing| format!("../rosbag1/poses_{packing}.bag"));
    for file in names(&json, "files").chain(bags.iter().map(String::as_str)) {
        let path = folder("mcap").join(file);
        let read = |topic: &str, world: Option<&str>, body: Option<&str>| {
            let [topic, world, body] = [Some(topic), world, body].map(|name| name.map(str::to_owned));
            read_topic_trajectory(&path, &PoseTopic { topic, world, body }, Some("lidar")).unwrap()
        };
        let mut topics = 0;
        for topic in list(&json, "topics").iter().filter(|topic| topic["kind"] == "poses") {
            let name = topic["topic"].as_str().unwrap();
            let run = read(name, None, None);
            assert_eq!(
                run.trajectory.stamps_ns().map(<[i64]>::to_vec),
                integers(&topic["stamps_ns"]),
                "{name}"
            );
            assert_poses(run.trajectory.poses(), list(topic, "poses"), [0.0, 1e-15], name);
            assert_eq!(run.body_frame.as_deref(), topic["child_frame_id"].as_str());
            assert!(run.damage.is_empty() && run.out_of_order == 0 && run.repeated == 0);
            topics += 1;
        }
        assert_eq!(topics, 4);
        // The chain has the stamps of the odometry, which comes more often; at those of the scans it is known.
        for (world, body, wanted) in [
            (None, None, "map_from_lidar"),
            (Some("map"), Some("/lidar"), "map_from_lidar"),
            (Some("map"), Some("base_link"), "map_from_base_link"),
        ] {
            let run = read("/tf", world, body);
            let at = |stamp_ns: &i64| run.trajectory.world_from_body_at(*stamp_ns, 0).unwrap();
            let found: Vec<_> = integers(&json["derived"]["stamps_ns"]).unwrap().iter().map(at).collect();
            assert_poses(&found, list(&json["derived"], wanted), [1e-12, 1e-12], file);
            assert_eq!(run.body_frame.as_deref(), Some(body.unwrap_or("lidar").trim_start_matches('/')));
            assert!(run.trajectory.len() > found.len(), "{}", run.trajectory.len());
        }
    }
}
