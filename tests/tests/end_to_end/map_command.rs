//! `dmp map`: built, looked at, checked, exported; damaged and refused.

use std::path::Path;

use dmp_log::{LogError, read_cloud};
use serde_json::Value;

use crate::common::{dmp, refused, text, workspace};

const BUILD: &str = "map build @/town.mcap -t @/truth.tum -o truth.dmpmap --quiet";

fn built(folder: &Path) -> Value {
    let output = dmp(folder, BUILD);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let info = dmp(folder, "map info truth.dmpmap --json");
    serde_json::from_slice(&info.stdout).unwrap()
}

#[test]
fn a_built_map_is_the_one_that_score_saves() {
    let folder = tempfile::tempdir().unwrap();
    let info = built(folder.path());
    let score = "score @/town.mcap -t truth=@/truth.tum --save-maps maps --json --quiet";
    let report: Value = serde_json::from_slice(&dmp(folder.path(), score).stdout).unwrap();
    assert_eq!(info["surfels"], report["runs"][0]["surfels"]);
    assert_eq!(info["voxel_m"], report["config"]["voxel_m"]);
    assert!(info["provenance"].as_str().unwrap().contains("town.mcap"));
    assert!(info["segments"][1].as_i64().unwrap() > info["segments"][0].as_i64().unwrap());
    let [low, high] = [0, 1].map(|k| info["extent_m"][k][0].as_f64().unwrap());
    assert!(high - low > 100.0 && high - low < 1000.0, "{low} to {high}");
    let points = |file: &str| {
        let export = dmp(folder.path(), &format!("map export {file} -o {file}.ply"));
        assert!(export.status.success(), "{}", text(&export.stderr));
        std::fs::read(folder.path().join(format!("{file}.ply"))).unwrap()
    };
    assert!(points("truth.dmpmap") == points("maps/truth.dmpmap"), "the same surfels");
    let bytes = |file: &str| std::fs::read(folder.path().join(file)).unwrap();
    assert!(bytes("truth.dmpmap") == bytes("maps/truth.dmpmap"), "the same file");
}

#[test]
fn building_tells_of_the_run_and_the_file_that_were_given() {
    let folder = tempfile::tempdir().unwrap();
    let truth = std::fs::read_to_string(workspace().join("data-samples/truth.tum")).unwrap();
    let later = truth.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let (stamp_s, pose) = line.split_once(' ').unwrap();
        format!("{} {pose}\n", stamp_s.parse::<f64>().unwrap() + 7000.0)
    });
    std::fs::write(folder.path().join("far.tum"), later.collect::<String>()).unwrap();
    let apart = dmp(folder.path(), "map build @/town.mcap -t far.tum -o far.dmpmap");
    assert!(text(&apart.stderr).contains("--time-offset far=7000.000"), "{}", text(&apart.stderr));
    let shifted = "map build @/town.mcap -t far.tum --time-offset far=7000 -o far.dmpmap";
    assert!(dmp(folder.path(), shifted).status.success());

    let mesh = "v 0 0 0\nv 9 0 0\nv 9 9 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("floor.obj"), mesh).unwrap();
    let built = text(&dmp(folder.path(), "map build floor.obj -o floor.dmpmap").stderr);
    assert_eq!(built.matches("OBJ mesh of 1 triangle").count(), 1, "{built}");
    assert!(built.contains("map of `floor.obj`: ") && !built.contains("floor.dmpmap"), "{built}");
}

#[test]
fn every_format_holds_every_surfel_and_a_box_those_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let surfels = built(folder.path())["surfels"].as_u64().unwrap();
    let read = |file: &str| {
        let mut points: Vec<[f64; 3]> = Vec::new();
        let sink = |batch: &[[f64; 3]]| {
            points.extend_from_slice(batch);
            Ok::<(), LogError>(())
        };
        read_cloud(&folder.path().join(file), None, sink).unwrap();
        points
    };
    let export = |arguments: &str| {
        let output = dmp(folder.path(), &format!("map export truth.dmpmap {arguments} --quiet"));
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    let mut first: Option<Vec<[f64; 3]>> = None;
    for file in ["a.ply", "a.pcd", "a.las", "a.laz"] {
        export(&format!("-o {file}"));
        let points = read(file);
        assert_eq!(points.len() as u64, surfels, "{file}");
        let first = first.get_or_insert_with(|| points.clone());
        let apart = first.iter().zip(&points).flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()));
        assert!(apart.fold(0.0, f64::max) <= 0.5001e-4, "{file}");
    }
    let all = first.unwrap();
    // Around some surfel, over the borders of tiles.
    let [x, y] = [0, 1].map(|k| all[all.len() / 2][k].round());
    let (xs, ys) = (x - 20.0..=x + 20.5, y - 15.0..=y + 30.0);
    export(&format!("-o box.ply --box {},{},{},{}", xs.start(), ys.start(), xs.end(), ys.end()));
    let inside = |p: &&[f64; 3]| xs.contains(&p[0]) && ys.contains(&p[1]);
    let expected: Vec<[f64; 3]> = all.iter().filter(inside).copied().collect();
    let found = read("box.ply");
    assert!(expected.len() > 100 && expected.len() < all.len() / 2, "{} of {}", expected.len(), all.len());
    assert!(found == expected, "{} for {}", found.len(), expected.len());
}

#[test]
fn a_cloud_becomes_a_map_too() {
    let folder = tempfile::tempdir().unwrap();
    built(folder.path());
    dmp(folder.path(), "map export truth.dmpmap -o cloud.laz --quiet");
    let output = dmp(folder.path(), "map build cloud.laz -o again.dmpmap --voxel 0.5");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let info: Value =
        serde_json::from_slice(&dmp(folder.path(), "map info again.dmpmap --json").stdout).unwrap();
    assert!(info["surfels"].as_u64().unwrap() > 1000 && info["segments"].is_null());
    assert!(info["provenance"].as_str().unwrap().contains("cloud.laz"));
}

#[test]
fn damage_is_named_tile_by_tile_and_misuse_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let tiles = built(path)["tiles"].as_u64().unwrap();
    let sound = dmp(path, "map verify truth.dmpmap");
    assert!(sound.status.success() && text(&sound.stdout).contains("sound"), "{}", text(&sound.stderr));
    let mut bytes = std::fs::read(path.join("truth.dmpmap")).unwrap();
    // Somewhere among the blobs, twice.
    let (a, b) = (bytes.len() / 5, bytes.len() / 2);
    bytes[a] ^= 1;
    bytes[b] ^= 0x80;
    std::fs::write(path.join("bad.dmpmap"), &bytes).unwrap();
    let output = dmp(path, "map verify bad.dmpmap");
    assert_eq!(output.status.code(), Some(3));
    let told = text(&output.stderr);
    assert_eq!(
        told.lines().filter(|line| line.starts_with("error: bad.dmpmap: tile (")).count(),
        2,
        "{told}"
    );
    assert!(
        text(&output.stdout).contains(&format!("2 of {tiles} tiles damaged")),
        "{}",
        text(&output.stdout)
    );
    refused(path, "map export bad.dmpmap -o x.ply", 1, &["bad.dmpmap: tile (", "checksum"]);
    refused(path, "map info @/town.mcap", 1, &["town.mcap: not a map store"]);
    refused(path, "map export truth.dmpmap -o x.xyz", 2, &["x.xyz", ".laz, .las, .ply or .pcd"]);
    refused(path, "map build @/town.mcap -o x.dmpmap", 2, &["town.mcap", "-t RUN.tum"]);
    let wrong = dmp(path, "map export truth.dmpmap -o x.ply --box 1,2,1,4");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(!path.join("x.ply").exists() && !path.join("x.dmpmap").exists());
}
