//! Rows 5 and 6: full disks, and what stands where outputs go.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::{names_in, refused_limited, scored, scores, town};
use crate::common::{refused, text, workspace};

/// A limit of file sizes stands for the full disk: both refuse to write midway.
#[cfg(unix)]
#[test]
fn row_05_a_full_disk_leaves_what_was_there() {
    let (folder, _) = town();
    let path = folder.path();
    for name in ["maps/truth.dmpmap", "old.mcap", "old.truth.tum", "work/other", "wrong.tum"] {
        fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
        fs::write(path.join(name), "what was there before").unwrap();
    }
    let before = (names_in(path), names_in(&path.join("maps")), names_in(&path.join("work")));
    let score = "score town.mcap -t truth.tum";
    // So many that each run's share of the memory is small.
    let many: String =
        (0..24).flat_map(|k| [" -t run".into(), k.to_string(), "=@/noise.tum".into()]).collect();
    // In blocks of 512 bytes, or of 1024 in some shells.
    for (limits, arguments, words) in [
        ("ulimit -f 8", format!("{score} --work work"), ["work", "cannot write the store"]),
        (
            "ulimit -f 8",
            format!("score @/town.mcap{many} --work work --memory 128MiB"),
            ["work", "cannot write the scratch file"],
        ),
        ("ulimit -f 8", format!("{score} --save-maps maps"), ["truth.dmpmap", "cannot write"]),
        ("ulimit -f 8", "convert log town.mcap -o new.mcap".into(), ["new.mcap", "cannot write"]),
        ("ulimit -f 2", "convert log town.mcap -o new --to pcd".into(), ["new", "cannot write"]),
        ("ulimit -f 2", "convert log town.mcap -o new --to laz".into(), ["new", "cannot write"]),
        (
            "ulimit -f 8",
            "simulate town -o old.mcap --truth old.truth.tum --scans 20".into(),
            ["old.mcap", "cannot write"],
        ),
        // The first pages are short.
        ("ulimit -f 8", "man -o pages".into(), ["pages/dmp", "cannot write"]),
        ("ulimit -f 8", "simulate town -o new --scans 20".into(), ["new", "cannot write"]),
        (
            "ulimit -f 1",
            "simulate errors truth.tum --scale 1.1 -o wrong.tum".into(),
            ["wrong.tum", "cannot write"],
        ),
    ] {
        refused_limited(path, limits, &arguments, &words);
        let after = (names_in(path), names_in(&path.join("maps")), names_in(&path.join("work")));
        assert_eq!(after, before, "{arguments}");
        for name in ["maps/truth.dmpmap", "old.mcap", "wrong.tum"] {
            assert_eq!(fs::read_to_string(path.join(name)).unwrap(), "what was there before", "{arguments}");
        }
    }
}

fn start(folder: &Path, arguments: &str) -> Child {
    let samples = workspace().join("data-samples").display().to_string();
    let arguments = arguments.split_whitespace().map(|argument| argument.replace('@', &samples));
    Command::new(env!("CARGO_BIN_EXE_dmp-under-test"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[test]
fn row_06_leftovers_are_never_used() {
    let (folder, _) = town();
    let path = folder.path();
    let arguments = "score town.mcap -t truth.tum -t drift.tum --work work --save-maps maps";
    fs::create_dir(path.join("work")).unwrap();
    let clean = scored(path, arguments, 0);
    let maps: Vec<Vec<u8>> =
        ["truth", "drift"].map(|name| fs::read(path.join(format!("maps/{name}.dmpmap"))).unwrap()).into();
    // What killed runs leave: half of a work folder, of a store and of a log, under names of theirs.
    fs::create_dir(path.join("work/dmp-work-AbC123")).unwrap();
    fs::write(path.join("work/dmp-work-AbC123/truth.dmpmap"), &maps[1]).unwrap();
    fs::write(path.join("maps/.dmp-store-AbC123"), &maps[1][..100]).unwrap();
    assert_eq!(scores(&scored(path, arguments, 0)), scores(&clean));
    for (name, map) in ["truth", "drift"].iter().zip(&maps) {
        assert!(fs::read(path.join(format!("maps/{name}.dmpmap"))).unwrap() == *map, "{name}");
    }
    assert_eq!(fs::read(path.join("work/dmp-work-AbC123/truth.dmpmap")).unwrap(), maps[1]);
    assert_eq!(names_in(&path.join("work")), ["dmp-work-AbC123"]);
    assert_eq!(names_in(&path.join("maps")), [".dmp-store-AbC123", "drift.dmpmap", "truth.dmpmap"]);
}

#[test]
fn row_06_two_runs_at_once_do_not_meet() {
    let (folder, _) = town();
    let path = folder.path();
    fs::create_dir(path.join("work")).unwrap();
    // The same name for other runs.
    let arguments = ["run=truth.tum", "run=drift.tum", "run=truth.tum"]
        .map(|run| format!("score town.mcap -t {run} --work work --json --quiet"));
    let alone = ["run=truth.tum", "run=drift.tum"]
        .map(|run| scored(path, &format!("score town.mcap -t {run} --work work"), 0));
    let children: Vec<Child> = arguments.iter().map(|arguments| start(path, arguments)).collect();
    for (child, alone) in children.into_iter().zip([&alone[0], &alone[1], &alone[0]]) {
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(scores(&report), scores(alone));
    }
    assert_eq!(names_in(&path.join("work")), [""; 0]);
}

/// Maps of two runs at once in one folder would be each other's: the second is told.
#[cfg(unix)]
#[test]
fn row_06_a_folder_of_maps_is_one_programs_at_a_time() {
    let (folder, _) = town();
    let path = folder.path();
    fs::create_dir(path.join("maps")).unwrap();
    let arguments = "score town.mcap -t truth.tum --save-maps maps";
    let taken = fs::File::open(path.join("maps")).unwrap();
    taken.lock().unwrap();
    refused(path, arguments, 1, &["maps", "another dmp is saving here"]);
    assert_eq!(names_in(&path.join("maps")), [""; 0]);
    drop(taken);
    scored(path, arguments, 0);
    assert_eq!(names_in(&path.join("maps")), ["truth.dmpmap"]);
}
