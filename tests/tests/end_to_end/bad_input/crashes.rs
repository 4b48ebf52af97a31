//! Row 24: interrupted and killed programs.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use dmp_map::{Store, TileId};

use super::{names_in, scored, scores};
use crate::common::{dmp_command, text, workspace};

/// Copies of one run, so that there is time to stop it.
const RUNS: usize = 8;

fn long_job(work: &Path, maps: &Path) -> Child {
    let samples = workspace().join("data-samples");
    let mut command = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"));
    command.arg("score").arg(samples.join("town.mcap")).arg("--work").arg(work).arg("--save-maps").arg(maps);
    for k in 0..RUNS {
        command.arg("-t").arg(format!("run{k}={}", samples.join("drift.tum").display()));
    }
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until `begun`, sends the signal, and gives the exit code and the last line on standard error.
fn stop(mut child: Child, signal: &str, begun: impl Fn() -> bool) -> (Option<i32>, String) {
    while !begun() {
        assert_eq!(child.try_wait().unwrap(), None, "it was to run for a while");
        std::thread::sleep(Duration::from_millis(5));
    }
    // With a comma, twice.
    for signal in signal.split(',') {
        // It may have ended meanwhile.
        Command::new("kill").args([signal, &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
    }
    let output = child.wait_with_output().unwrap();
    let stderr = text(&output.stderr);
    assert!(!stderr.contains("panicked"), "{stderr}");
    (output.status.code(), stderr.lines().last().unwrap_or_default().to_owned())
}

#[cfg(unix)]
#[test]
fn row_24_interrupts_leave_nothing_and_kills_nothing_that_counts() {
    let folder = tempfile::tempdir().unwrap();
    let [work, maps] = ["work", "maps"].map(|name| folder.path().join(name));
    fs::create_dir(&work).unwrap();
    let small = "score @/town.mcap -t @/truth.tum -t @/drift.tum --work work --save-maps maps";
    let clean = scored(folder.path(), small, 0);
    let saved = |name: &str| fs::read(maps.join(format!("{name}.dmpmap"))).unwrap();
    let (truth, drift) = (saved("truth"), saved("drift"));
    // The work folder appears before anything is fused, the last map when all are.
    let fusing = || !names_in(&work).is_empty();
    let casting = || maps.join(format!("run{}.dmpmap", RUNS - 1)).exists();
    for signal in ["-INT", "-TERM"] {
        for begun in [&fusing as &dyn Fn() -> bool, &casting] {
            let (code, last) = stop(long_job(&work, &maps), signal, begun);
            assert_eq!((code, last.as_str()), (Some(130), "error: stopped before the end"), "{signal}");
            assert_eq!(names_in(&work), [""; 0], "{signal}");
            assert!(names_in(&maps).iter().all(|name| !name.starts_with('.')), "{:?}", names_in(&maps));
            (0..RUNS).for_each(|k| drop(fs::remove_file(maps.join(format!("run{k}.dmpmap")))));
        }
    }
    // Who cannot wait: whatever its threads are at, nothing is left behind.
    for begun in [&fusing as &dyn Fn() -> bool, &casting] {
        let (code, last) = stop(long_job(&work, &maps), "-INT,-INT", begun);
        assert_eq!((code, last.as_str()), (Some(130), "error: stopped before the end"));
        assert_eq!(names_in(&work), [""; 0]);
        assert!(names_in(&maps).iter().all(|name| !name.starts_with('.')), "{:?}", names_in(&maps));
        (0..RUNS).for_each(|k| drop(fs::remove_file(maps.join(format!("run{k}.dmpmap")))));
    }
    for begun in [&fusing as &dyn Fn() -> bool, &casting] {
        let (code, _) = stop(long_job(&work, &maps), "-KILL", begun);
        assert_eq!(code, None, "killed");
        // A map that is there is whole.
        for name in names_in(&maps).iter().filter(|name| name.starts_with("run")) {
            let store = Store::open(&maps.join(name)).unwrap();
            let tiles: Vec<TileId> = store.entries().map(|entry| entry.tile).collect();
            assert!(!tiles.is_empty());
            tiles.into_iter().for_each(|tile| drop(store.load(tile).unwrap()));
            drop(fs::remove_file(maps.join(name)));
        }
        assert_eq!(scores(&scored(folder.path(), small, 0)), scores(&clean));
        assert!(saved("truth") == truth && saved("drift") == drift, "the same bytes");
        names_in(&work).iter().for_each(|name| drop(fs::remove_dir_all(work.join(name))));
    }
}

/// What asks nobody whether to stop: it stops at once.
#[cfg(unix)]
#[test]
fn row_24_a_simulation_stops_at_once_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let begun = || !names_in(path).is_empty();
    for arguments in [
        "simulate city -o city.mcap --truth truth.tum --km 100",
        "simulate town -o town.mcap --truth truth.tum --scans 10000",
        "simulate room -o room --frames 100000",
    ] {
        let mut command = dmp_command(path, arguments);
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let (code, last) = stop(child, "-INT", begun);
        assert_eq!((code, last.as_str()), (Some(130), "error: stopped before the end"), "{arguments}");
        assert_eq!(names_in(path), [""; 0], "{arguments}");
    }
}
