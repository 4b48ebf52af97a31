//! `dmp truth smd`: the command on meshes, clouds, stores and runs, and what bad input gets.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{ends, has, once, refused};

/// The JSON of `dmp truth smd`, but for times.
fn smd(folder: &Path, arguments: &str) -> Value {
    let mut value = crate::common::json(folder, &format!("truth smd {arguments}"));
    assert_eq!(value["schema"], "dmp-smd/1");
    assert!(value.as_object_mut().unwrap().remove("timing").is_some());
    value
}

fn cloud(path: &Path, points: &[[f64; 3]]) {
    let count = points.len();
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {count}\n");
    text += "property double x\nproperty double y\nproperty double z\nend_header\n";
    points.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    fs::write(path, text).unwrap();
}

/// A floor of 20 m × 20 m at UTM coordinates as a mesh, and points 7 cm above it.
fn floor(folder: &Path) {
    let (x, y) = (458_000.0, 5_421_000.0);
    let corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)];
    let mut text = String::new();
    corners.iter().for_each(|(u, v)| writeln!(text, "v {} {} 100", x + u, y + v).unwrap());
    fs::write(folder.join("floor.obj"), text + "f 1 2 3 4\n").unwrap();
    let point = |k: u32| [x + 0.1 + f64::from(k % 100) * 0.2, y + 0.1 + f64::from(k / 100) * 0.2, 100.07];
    cloud(&folder.join("map.ply"), &(0..10_000).map(point).collect::<Vec<_>>());
}

#[test]
fn a_runs_own_map_lies_on_the_truths() {
    let folder = tempfile::tempdir().unwrap();
    // The truth's map as the reference.
    once(crate::map_command::BUILD).copy("truth.dmpmap", folder.path());
    let store = dmp_map::Store::open(&folder.path().join("truth.dmpmap")).unwrap();
    let mut centres = Vec::new();
    for entry in store.entries() {
        centres.extend(store.discs_in_own(entry.tile).unwrap().map(|disc| disc.centre_in_own_m));
    }
    cloud(&folder.path().join("reference.ply"), &centres);

    let given = smd(folder.path(), "reference.ply truth.dmpmap");
    assert_eq!(given["maps"][0]["accuracy"]["max_m"], 0.0);
    assert_eq!(given["maps"][0]["points"], centres.len());

    let runs = "reference.ply @/town.mcap -t @/truth.tum -t @/drift.tum";
    let fused = smd(folder.path(), runs);
    let mean = |k: usize| fused["maps"][k]["accuracy"]["mean_m"].as_f64().unwrap();
    // Fused beside others the truth's map is the same, and the other's is worse.
    assert!(mean(0) < 1e-6, "{}", mean(0));
    assert!(mean(1) > 0.01, "{}", mean(1));
    assert_eq!(fused["maps"][1]["name"], "drift");
}

#[test]
fn an_alignment_brings_a_moved_map_back() {
    let folder = tempfile::tempdir().unwrap();
    floor(folder.path());
    let pose = |k: u32| (f64::from(k), 458_000.0 + f64::from(k), 5_421_000.0 + f64::from(k * k % 7), 101.0);
    let line = |(t, x, y, z): (f64, f64, f64, f64)| format!("{t} {x} {y} {z} 0 0 0 1\n");
    let reference: String = (0..20).map(|k| line(pose(k))).collect();
    // Turned by a quarter around z: x' = -y, y' = x.
    let turned = |(t, x, y, z): (f64, f64, f64, f64)| (t, -y, x, z - 50.0);
    let estimate: String = (0..20).map(|k| line(turned(pose(k)))).collect();
    fs::write(folder.path().join("reference.tum"), reference).unwrap();
    fs::write(folder.path().join("estimate.tum"), estimate).unwrap();
    let point = |k: u32| [-5_421_001.0 - f64::from(k % 10), 458_001.0 + f64::from(k / 10), 50.07];
    cloud(&folder.path().join("moved.ply"), &(0..100).map(point).collect::<Vec<_>>());
    let result = smd(folder.path(), "floor.obj moved.ply --align reference.tum estimate.tum");
    let mean_m = result["maps"][0]["accuracy"]["mean_m"].as_f64().unwrap();
    assert!((mean_m - 0.07).abs() < 1e-5, "{mean_m}");
    let apart = ends(folder.path(), "truth smd floor.obj moved.ply", 1);
    has(&crate::common::text(&apart.stderr), &["same frame"]);
}

#[test]
fn bad_input_gets_one_line_and_its_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    floor(folder.path());
    cloud(&folder.path().join("empty.ply"), &[]);
    fs::write(folder.path().join("bad.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    fs::write(folder.path().join("text.xyz"), "1 2 3\n").unwrap();
    for (arguments, code, words) in [
        ("none.ply map.ply", 2, "none.ply: no such file"),
        ("floor.obj none.ply", 2, "none.ply: no such file"),
        ("floor.obj @/town.mcap", 2, "-t RUN.tum"),
        ("floor.obj map.ply --cap 0", 2, "cap 0 m"),
        ("floor.obj map.ply --thresholds 0.1,2", 2, "at most the cap"),
        ("floor.obj map.ply --align @/truth.tum", 2, "ESTIMATE.tum"),
        ("floor.obj empty.ply", 1, "empty.ply: the map has no points"),
        ("empty.ply map.ply", 1, "the reference has neither"),
        ("bad.obj map.ply", 1, "bad.obj: line 2: `2` names no vertex"),
        ("floor.obj text.xyz", 1, "text.xyz: not a format known here"),
        ("floor.obj map.ply --align @/truth.tum floor.obj", 1, "floor.obj"),
        ("floor.obj map.ply --thin 0.2 --cap 1cm --thresholds 1cm", 1, "same frame"),
    ] {
        refused(folder.path(), &format!("truth smd {arguments}"), code, &[words]);
    }
}
