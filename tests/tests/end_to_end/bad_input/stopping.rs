//! Row 24: interrupts end a program wherever it is, in long sums as at pipes that nobody opens; kills leave nothing half made.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use dmp_map::{Store, TileId};

use dmp_log::FolderFormat;

use super::table::Row;
use super::{KEEPING_WORK, Town, begin, ended, names_in, report, scores, signal};
use crate::common::dmp_command;

pub(super) const ROWS: &[Row] = &[Row {
    // Inputs are read more than once: who waited at a pipe would wait for ever, or read what is left.
    number: 24,
    made: |town| {
        town.write("bag.db3", b"SQLite format 3\0");
        // Beside scans, among them, and in the place of what describes a bag.
        ["stamps", "scans", "times"]
            .into_iter()
            .for_each(|name| town.scans(name, town.scans, FolderFormat::Bin));
        fs::remove_file(town.path("stamps/times.txt")).unwrap();
        fs::create_dir(town.path("bag")).unwrap();
        let beside = ["stamps/times.txt", "scans/scans/000024.bin", "times/calib.txt", "bag/metadata.yaml"];
        for name in
            ["pipe", "pipe.mcap", "pipe.laz", "pipe.obj", "pipe.dmpmap", "bag.db3-wal"].iter().chain(&beside)
        {
            town.pipe(name);
        }
        for command in [
            "score pipe.mcap -t truth.tum",
            "score pipe -t truth.tum",
            "info pipe",
            "score town.mcap -t pipe",
            "score town.mcap -t pipe:/odom",
            "score town.mcap -t truth.tum --extrinsic calib:pipe",
            "convert trajectory pipe --to tum -o out.tum",
            "score town.mcap -t truth.tum --map pipe.laz",
            "score town.mcap -t truth.tum --map pipe.obj",
            "score town.mcap -t truth.tum --map pipe.dmpmap",
            "map build pipe.laz -o out.dmpmap",
            "map info pipe.dmpmap",
            "compare pipe",
            "info stamps",
            "score scans -t truth.tum",
            "score times -t truth.tum",
            "info bag",
        ] {
            town.line(format!("{command} => 1 it is a pipe | save what comes out of it to a file first"));
        }
    },
    lines: "info bag.db3 => 1 bag.db3 | bag.db3-wal`, which belongs to it, is no file",
}];

/// Long enough for a program to come to where it waits.
const A_WHILE: Duration = Duration::from_secs(2);
const STOPPED: &str = "error: stopped before the end";

#[test]
#[ignore = "nightly: many runs of long steps"]
fn row_24_long_steps_stop_midway_and_leave_nothing() {
    let town = Town::new();
    town.make("simulate town -o town.mcap --truth truth.tum --scans 400 --quiet");
    town.make("score town.mcap -t truth.tum --every 4 --residuals cloud.laz --quiet");
    for arguments in [
        "calibrate town.mcap -t truth.tum",
        "drift town.mcap -t truth.tum",
        "score town.mcap -t truth.tum --quick",
        "score town.mcap -t truth.tum --map cloud.laz",
        "convert log town.mcap -o out",
    ] {
        let before = names_in(town.root());
        let begun = Instant::now();
        town.make(arguments);
        let takes = begun.elapsed();
        let mut stopped = 0;
        for eighth in [1, 3, 5, 6] {
            let _ = fs::remove_dir_all(town.path("out"));
            let child = begin(town.root(), arguments);
            std::thread::sleep(takes * eighth / 8);
            signal(&child, "-INT");
            let (code, stderr) = ended(child);
            // It was faster this time.
            if code != Some(0) {
                let what = format!("{arguments}, after {eighth}/8: {stderr}");
                assert!(code == Some(130) && stderr.ends_with(&format!("{STOPPED}\n")), "{what}");
                assert_eq!(names_in(town.root()), before, "{what}");
                stopped += 1;
            }
        }
        let _ = fs::remove_dir_all(town.path("out"));
        assert!(stopped > 0, "{arguments}: it was never stopped");
    }
}

#[test]
fn row_24_outputs_and_lists_that_are_pipes_wait_until_they_are_stopped() {
    let town = Town::new();
    ["pipe", "pipe.html", "pipe.laz"].into_iter().for_each(|name| town.pipe(name));
    let before = names_in(town.root());
    for arguments in [
        "score town.mcap -t truth.tum --report pipe.html --quiet",
        "score town.mcap -t truth.tum --residuals pipe.laz --quiet",
        "convert trajectory truth.tum --to tum -o pipe",
        "loops pipe --candidates pipe --quiet",
    ] {
        let mut child = begin(town.root(), arguments);
        std::thread::sleep(A_WHILE);
        assert_eq!(child.try_wait().unwrap(), None, "it was to wait: {arguments}");
        signal(&child, "-INT");
        let (code, stderr) = ended(child);
        assert_eq!((code, stderr.lines().last()), (Some(130), Some(STOPPED)), "{arguments}: {stderr}");
        assert_eq!(names_in(town.root()), before, "{arguments}");
    }
    // Nobody reads the messages, and the pipe for them is full.
    let (_reader, mut full) = std::io::pipe().unwrap();
    std::io::Write::write_all(&mut full, &vec![b'\n'; 1 << 16]).unwrap();
    for arguments in
        ["score town.mcap -t truth.tum --report pipe.html --quiet", "score town.mcap -t truth.tum"]
    {
        let mut command = dmp_command(town.root(), arguments);
        let child = command.stdout(Stdio::null()).stderr(full.try_clone().unwrap()).spawn().unwrap();
        std::thread::sleep(A_WHILE);
        signal(&child, "-INT");
        assert_eq!(ended(child).0, Some(130), "{arguments}");
    }
}

#[test]
#[ignore = "nightly: up to a hundred runs"]
fn row_24_what_is_asked_to_stop_twice_names_the_work_that_it_keeps() {
    let town = Town::new();
    let work = town.path("work");
    fs::create_dir(&work).unwrap();
    for _ in 0..100 {
        let mut child =
            begin(town.root(), &format!("score town.mcap -t truth.tum -t drift.tum {KEEPING_WORK}"));
        while child.try_wait().unwrap().is_none() && !has_checkpoint(&work) {}
        signal(&child, "-INT");
        signal(&child, "-INT");
        let (code, stderr) = ended(child);
        let left = names_in(&work);
        // It may have ended meanwhile.
        if code != Some(0) {
            let is_named =
                left.iter().all(|name| stderr.contains(name.as_str()) && stderr.contains("--resume"));
            assert!(code == Some(130) && is_named, "{left:?}\n{stderr}");
            if !left.is_empty() {
                return;
            }
        }
    }
    panic!("no work was kept");
}

/// Whether a work folder has a checkpoint.
pub(super) fn has_checkpoint(work: &Path) -> bool {
    let files = |folder: &String| fs::read_dir(work.join(folder)).into_iter().flatten().flatten();
    let mut files = names_in(work).into_iter().flat_map(|folder| files(&folder).collect::<Vec<_>>());
    files.any(|file| file.path().extension().is_some_and(|e| e == "checkpoint"))
}

#[test]
#[ignore = "nightly: a dozen stopped scores, each checked by another"]
fn row_24_interrupts_leave_nothing_and_kills_nothing_that_counts() {
    let town = Town::new();
    let work = town.path("work");
    fs::create_dir(&work).unwrap();
    let small = "score @/town.mcap -t @/truth.tum -t @/drift.tum --work work";
    let clean = scores(&report(town.root(), "", small, 0));
    // Copies of one run, so that there is time to stop it.
    let runs: String = (0..8).map(|k| format!(" -t run{k}=@/drift.tum")).collect();
    let score = format!("score @/town.mcap --work work{runs}");
    let map = "map build @/town.mcap -t @/drift.tum -o map.dmpmap --work work";
    let begun = || !names_in(&work).is_empty();
    for (command, signals) in
        [&score[..], map].iter().flat_map(|c| ["-INT", "-TERM", "-INT,-INT"].map(|s| (*c, s)))
    {
        let (code, last) = stop(begin(town.root(), command), signals, &begun);
        assert_eq!((code, last.as_str()), (Some(130), STOPPED), "{command} {signals}");
        assert_eq!(names_in(&work), [""; 0], "{command} {signals}");
        assert_eq!(
            names_in(town.root()),
            ["drift.tum", "town.mcap", "truth.tum", "work"],
            "{command} {signals}"
        );
    }
    let whole = Instant::now();
    town.make(map);
    let takes = whole.elapsed();
    for (command, eighth) in [&score[..], map].iter().flat_map(|c| [1, 4, 7].map(|eighth| (*c, eighth))) {
        let _ = fs::remove_file(town.path("map.dmpmap"));
        let mut child = begin(town.root(), command);
        std::thread::sleep(takes * eighth / 8);
        child.kill().unwrap();
        child.wait().unwrap();
        // A map that is there is whole.
        if town.path("map.dmpmap").exists() {
            let store = Store::open(&town.path("map.dmpmap")).unwrap();
            let tiles: Vec<TileId> = store.entries().map(|entry| entry.tile).collect();
            assert!(!tiles.is_empty());
            tiles.into_iter().for_each(|tile| drop(store.load(tile).unwrap()));
        }
        assert_eq!(scores(&report(town.root(), "", small, 0)), clean);
        names_in(&work).iter().for_each(|name| drop(fs::remove_dir_all(work.join(name))));
    }

    // A simulation asks nobody whether to stop: it stops at once.
    let empty = tempfile::tempdir().unwrap();
    let begun = || !names_in(empty.path()).is_empty();
    for arguments in [
        "simulate city -o city.mcap --truth truth.tum --km 100",
        "simulate town -o town.mcap --truth truth.tum --scans 10000",
        "simulate room -o room --frames 100000",
    ] {
        let (code, last) = stop(begin(empty.path(), arguments), "-INT", &begun);
        assert_eq!((code, last.as_str()), (Some(130), STOPPED), "{arguments}");
        assert_eq!(names_in(empty.path()), [""; 0], "{arguments}");
    }
}

/// Waits until `begun`, sends the signals, and gives the exit code and the last line on standard error.
fn stop(mut child: Child, signals: &str, begun: &dyn Fn() -> bool) -> (Option<i32>, String) {
    while !begun() {
        assert_eq!(child.try_wait().unwrap(), None, "it was to run for a while");
        std::thread::sleep(Duration::from_millis(5));
    }
    signals.split(',').for_each(|name| signal(&child, name));
    let (code, stderr) = ended(child);
    assert!(!stderr.contains("panicked"), "{stderr}");
    (code, stderr.lines().last().unwrap_or_default().to_owned())
}
