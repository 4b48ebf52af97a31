//! What people trip over with files of their own, through the command.

use std::fs;
use std::path::Path;

use crate::common::{dmp, text, workspace};

fn conformance(name: &str) -> std::path::PathBuf {
    workspace().join("tests/conformance").join(name)
}

/// A wrong extrinsic, given as users give it, is told as that, and not as a wrong clock.
#[test]
fn the_hint_looks_along_the_extrinsic_that_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let half_turn = "--extrinsic 0,0,0,0,0,0.7071067811865476,0.7071067811865476";
    let output = dmp(folder.path(), &format!("score @/town.mcap -t @/truth.tum {half_turn} --json"));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("--extrinsic truth=0,0,0,0,0,0,1 mends it"), "{warnings}");
}

/// Within a few metres of the sample's sensor lies hardly anything: then nothing is said of how runs are read, and as soon as
/// there is enough, what is wrong.
#[test]
fn a_short_range_calls_no_good_run_misread() {
    let folder = tempfile::tempdir().unwrap();
    let score = |options: &str| {
        let runs = "-t @/truth.tum -t @/drift.tum -t camera=@/truth.tum";
        let output = dmp(folder.path(), &format!("score @/town.mcap {runs} --voxel 0.3 --json {options}"));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (text(&output.stderr), report["left_out"].as_array().unwrap().len())
    };
    for range_m in [3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 15.0] {
        let (told, left_out) = score(&format!("--max-range {range_m}"));
        assert!(!told.contains("misread") && left_out == 0, "{range_m}: {told}");
    }
    let camera = "--extrinsic camera=0,0,0,0.5,-0.5,0.5,0.5";
    for range_m in [8.0, 15.0, 100.0] {
        let (told, left_out) = score(&format!("--max-range {range_m} {camera}"));
        assert!(told.contains("run `camera` is left out: its poses are misread"), "{range_m}: {told}");
        assert_eq!((told.matches("misread").count(), left_out), (1, 1), "{range_m}: {told}");
    }
}

/// A return that did not come back has often a zero for its absolute time; it must not move the stamps.
#[test]
fn a_hole_without_a_time_does_not_move_a_stamp() {
    let folder = tempfile::tempdir().unwrap();
    let log = conformance("mcap/robosense.mcap");
    let done = dmp(folder.path(), &format!("convert log {} -o scans --to bin", log.display()));
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let times = fs::read_to_string(folder.path().join("scans/times.txt")).unwrap();
    assert!(times.lines().all(|line| line.starts_with("1700000000.")), "{times}");
}

#[test]
fn nothing_that_is_there_is_overwritten_by_a_conversion() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("out.mcap"), "precious").unwrap();
    let done = dmp(folder.path(), "convert log @/town.mcap -o out.mcap");
    assert_eq!(done.status.code(), Some(2), "{}", text(&done.stderr));
    assert_eq!(fs::read(folder.path().join("out.mcap")).unwrap(), b"precious");
    for wrong in ["-o new --to pcd --compression lz4", "-o new.mcap --to bin"] {
        let done = dmp(folder.path(), &format!("convert log @/town.mcap {wrong}"));
        assert_eq!(done.status.code(), Some(2), "{wrong}: {}", text(&done.stderr));
    }
    assert!(!folder.path().join("new.mcap").exists() && !folder.path().join("new").exists());
}

/// The folder of the scans, named from within, has the same companions.
#[test]
fn scans_named_from_their_own_folder_keep_their_stamps() {
    let folder = tempfile::tempdir().unwrap();
    let done = dmp(folder.path(), "convert log @/town.mcap -o log --to bin");
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let told = text(&dmp(&folder.path().join("log/scans"), "info . --json").stdout);
    let info: serde_json::Value = serde_json::from_str(&told).unwrap();
    let scans = &info["streams"][0]["scans"];
    assert!(scans["span_ns"].is_array() && scans["point_times"].is_string(), "{told}");
}

/// A bag is a bag, whatever maps lie beside it.
#[test]
fn clouds_beside_a_bag_are_no_scans() {
    let folder = tempfile::tempdir().unwrap();
    for file in fs::read_dir(conformance("rosbag2/sqlite3")).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), folder.path().join(file.file_name())).unwrap();
    }
    for map in ["map.pcd", "map_filtered.pcd"] {
        fs::copy(conformance("clouds/open3d_binary.pcd"), folder.path().join(map)).unwrap();
    }
    let told = text(&dmp(folder.path(), "info .").stdout);
    assert!(told.contains("rosbag2 (SQLite)"), "{told}");
    let named = dmp(folder.path(), "info metadata.yaml");
    assert!(text(&named.stderr).contains("name the folder"), "{}", text(&named.stderr));
}

/// Points of 20 bytes are not read as points of 16.
#[test]
fn bin_files_of_another_layout_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (number, points) in [5_usize, 6, 7, 9].into_iter().enumerate() {
        fs::write(folder.path().join(format!("{number:06}.bin")), vec![0; 20 * points]).unwrap();
    }
    refused(folder.path(), "info .", &["4 of 4 files", "16 bytes"]);
}

/// A world's tiles are no scans, feet are no metres, and a ROS 1 bag is told how to become readable.
#[test]
fn what_is_taken_for_something_else_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let tiles = folder.path().join("tiles");
    fs::create_dir(&tiles).unwrap();
    for name in ["a.laz", "b.laz"] {
        fs::copy(conformance("clouds/las_format1.laz"), tiles.join(name)).unwrap();
    }
    refused(folder.path(), "info tiles", &["world coordinates", "--made-with"]);
    fs::write(folder.path().join("a.bag"), "#ROSBAG V2.0\n").unwrap();
    refused(folder.path(), "info a.bag", &["mcap convert"]);
    refused(folder.path(), "score @/town.mcap -t a.bag", &["mcap convert"]);
}

fn refused(folder: &Path, arguments: &str, words: &[&str]) {
    let output = dmp(folder, arguments);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments}: {error}");
    for word in words {
        assert!(error.contains(word), "no `{word}` in: {error}");
    }
}

/// The file in world coordinates gives the scores of the log that it was made from, and the mapper's extrinsic
/// must be known.
#[test]
fn a_world_file_is_scored_with_what_it_was_made_with() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = "score @/town.mcap -t @/truth.tum --made-with @/truth.tum";
    let error = dmp(folder.path(), wrong);
    assert_eq!(error.status.code(), Some(2), "{}", text(&error.stderr));
    let unknown = format!(
        "score {} -t @/truth.tum --made-with @/truth.tum --extrinsic truth=1,0,0,0,0,0,1",
        conformance("clouds/las_format1.laz").display()
    );
    let error = dmp(folder.path(), &unknown);
    assert_eq!(error.status.code(), Some(2), "{}", text(&error.stderr));
    assert!(text(&error.stderr).contains("for all runs"), "{}", text(&error.stderr));
}
