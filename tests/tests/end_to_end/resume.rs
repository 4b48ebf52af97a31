//! Evaluations that are stopped or killed, and are taken up again: the same bits at the end.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use dmp::{Config, EvaluateError, Progress, Report, Run, evaluate};
use dmp_log::{McapScanWriter, McapWriterOptions};
use dmp_sensor::Scan;
use serde_json::Value;

use crate::common::{comparable, drift, noise, open, runs_of, small_town, text};

/// Every few scans can be kept, since a chunk is read as a whole.
pub(crate) fn write_in_small_chunks(path: &Path, scans: &[Scan]) {
    let options = McapWriterOptions { chunk_bytes: 64 << 10, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(path, &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
}

/// Asks to stop once so much was advanced.
struct StopAfter {
    left: AtomicU64,
    done: AtomicU64,
}

impl StopAfter {
    fn new(left: u64) -> Self {
        Self { left: left.into(), done: 0.into() }
    }
}

impl Progress for StopAfter {
    fn advance(&self, amount: u64) {
        self.done.fetch_add(amount, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.done.load(Ordering::Relaxed) > self.left.load(Ordering::Relaxed)
    }
}

/// Evaluates, stopped again and again after a little more; tells how often.
pub(crate) fn in_pieces(log: &Path, runs: &[Run], config: &Config, piece: u64) -> (Report, usize) {
    let log = open(log);
    for stops in 0.. {
        // What is done is counted anew each time, resumed work included: so each piece ends a little later.
        match evaluate(log.as_ref(), runs, config, &StopAfter::new(piece * (stops as u64 + 1))) {
            Ok(report) => return (report, stops),
            Err(EvaluateError::Cancelled) => {}
            Err(error) => panic!("{error}"),
        }
    }
    unreachable!()
}

#[test]
fn an_evaluation_in_many_pieces_is_the_one_in_one_piece() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    for (free_space, every) in [(false, 0), (true, 0), (false, 3600)] {
        let config = Config { free_space, memory_bytes: 32 << 20, per_tile: true, ..Config::default() };
        let whole = evaluate(open(&path).as_ref(), &runs, &config, ()).unwrap();
        let pieces = Config {
            work_folder: folder.path().to_path_buf(),
            checkpoint_every: Some(Duration::from_secs(every)),
            resume: true,
            ..config
        };
        let (report, stops) = in_pieces(&path, &runs, &pieces, 25_000);
        assert!(stops > 4, "{stops} stops");
        assert_eq!(comparable(&report), comparable(&whole));
        let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        assert_eq!(names.collect::<Vec<_>>(), ["town.mcap"], "nothing is left behind");
    }
}

#[test]
fn sums_by_tile_that_were_not_kept_are_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(20, 180);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let whole =
        evaluate(open(&path).as_ref(), &runs, &Config { per_tile: true, ..Config::default() }, ()).unwrap();
    assert!(!whole.tiles.is_empty());
    for per_tile in [true, false] {
        let config = Config {
            work_folder: folder.path().to_path_buf(),
            checkpoint_every: Some(Duration::ZERO),
            resume: true,
            per_tile: !per_tile,
            ..Config::default()
        };
        // Amid casting: fused is every return once, and cast once more.
        let amid = whole.inputs.returns_used * 3 / 2;
        let stopped = evaluate(open(&path).as_ref(), &runs, &config, &StopAfter::new(amid));
        assert!(matches!(stopped, Err(EvaluateError::Cancelled)));
        let gone_on = evaluate(open(&path).as_ref(), &runs, &Config { per_tile, ..config }, ()).unwrap();
        assert_eq!(gone_on.runs, whole.runs);
        assert_eq!(gone_on.tiles, if per_tile { whole.tiles.clone() } else { Vec::new() });
    }
}

#[test]
fn what_was_kept_of_another_evaluation_is_not_taken_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(20, 180);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let config = Config {
        work_folder: folder.path().to_path_buf(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..Config::default()
    };
    let stopped = evaluate(open(&path).as_ref(), &runs, &config, &StopAfter::new(60_000));
    assert!(matches!(stopped, Err(EvaluateError::Cancelled)));
    let other = Config { segment: Some(dmp::SegmentLength::Metres(5.0)), ..config.clone() };
    let expected = Config { segment: Some(dmp::SegmentLength::Metres(5.0)), ..Config::default() };
    let report = |config| comparable(&evaluate(open(&path).as_ref(), &runs, config, ()).unwrap());
    assert_eq!(report(&other), report(&expected));
    // A damaged checkpoint is refused, not guessed at.
    let left = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).find(|p| p.is_dir());
    for file in fs::read_dir(left.unwrap()).unwrap().map(|entry| entry.unwrap().path()) {
        if file.extension().is_some_and(|extension| extension == "checkpoint") {
            let mut bytes = fs::read(&file).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(&file, bytes).unwrap();
        }
    }
    let error = evaluate(open(&path).as_ref(), &runs, &config, ()).unwrap_err();
    assert!(error.to_string().contains("damaged in its content"), "{error}");
    let afresh = Config { resume: false, ..config };
    assert_eq!(report(&afresh), report(&Config::default()));
}

/// A log of a small town and two runs in `folder`, and the command that scores them there.
pub(crate) fn town_command(folder: &Path) -> Command {
    let (scans, truth) = small_town(60, 180);
    write_in_small_chunks(&folder.join("town.mcap"), &scans);
    for run in runs_of(&truth, &[("drift", drift(1.0))]) {
        let lines =
            run.trajectory.stamps_ns().unwrap().iter().zip(run.trajectory.poses()).map(|(ns, pose)| {
                let (t, q) = (pose.translation.vector, pose.rotation.coords);
                let (s, ns) = (ns.div_euclid(1_000_000_000), ns.rem_euclid(1_000_000_000));
                format!("{s}.{ns:09} {} {} {} {} {} {} {}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
            });
        fs::write(folder.join(format!("{}.tum", run.name)), lines.collect::<String>()).unwrap();
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"));
    command.current_dir(folder).args("score town.mcap -t truth.tum -t drift.tum --work . --json".split(' '));
    command
}

pub(crate) fn scores(json: &[u8]) -> Value {
    let mut json: Value = serde_json::from_slice(json).unwrap();
    let object = json.as_object_mut().unwrap();
    assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
    json
}

#[test]
fn a_hundred_kills_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = town_command(folder.path());
    let begun = Instant::now();
    let whole = command.output().unwrap();
    let whole_time = begun.elapsed();
    let expected = scores(&whole.stdout);
    command.args(["--resume", "--checkpoint", "0.01", "--quiet", "--memory", "32MiB"]);
    let (mut kills, mut finished, mut resumed) = (0, 0, 0);
    let mut state = 1u64;
    while kills < 100 || finished == 0 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        resumed += usize::from(has_checkpoint(folder.path()));
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(whole_time.mul_f64((state >> 40) as f64 / f64::from(1 << 24)));
        if child.try_wait().unwrap().is_none() {
            // SIGKILL: nothing of the process runs after this.
            child.kill().unwrap();
            child.wait().unwrap();
            kills += 1;
            continue;
        }
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(scores(&output.stdout), expected, "after {kills} kills");
        finished += 1;
    }
    assert!(resumed > 10, "{resumed} of {kills} kills left something to go on from");
    println!("{kills} kills, {resumed} times gone on, {finished} times finished");
}

/// A map that is built of the town's log, and what the command made when nothing stopped it.
struct WholeBuild {
    build: Command,
    map: PathBuf,
    whole: Vec<u8>,
    whole_time: Duration,
}

impl WholeBuild {
    fn new(folder: &Path) -> Self {
        town_command(folder);
        let mut build = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"));
        build.current_dir(folder);
        build.args("map build town.mcap -t truth.tum -o truth.dmpmap --work . --quiet".split(' '));
        let map = folder.join("truth.dmpmap");
        let begun = Instant::now();
        assert!(build.output().unwrap().status.success());
        let (whole_time, whole) = (begun.elapsed(), fs::read(&map).unwrap());
        Self { build, map, whole, whole_time }
    }
}

#[test]
fn a_killed_build_leaves_a_whole_map_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let WholeBuild { mut build, map, whole, whole_time } = WholeBuild::new(folder.path());
    let (mut kills, mut kept) = (0, 0);
    for k in 0..25 {
        fs::remove_file(&map).unwrap_or_default();
        let mut child = build.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(whole_time.mul_f64(f64::from(k) / 20.0));
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap_or_default();
        child.wait().unwrap();
        match fs::read(&map) {
            Ok(found) => {
                assert!(found == whole, "a map that is there is whole");
                kept += 1;
            }
            Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::NotFound),
        }
    }
    assert!(kills > 5, "{kills} kills, {kept} maps");
}

#[test]
fn a_killed_build_goes_on_and_ends_with_the_same_map() {
    let folder = tempfile::tempdir().unwrap();
    let WholeBuild { mut build, map, whole, whole_time } = WholeBuild::new(folder.path());
    build.args(["--resume", "--checkpoint", "0.005", "--memory", "32MiB"]);
    let (mut kills, mut finished, mut resumed) = (0, 0, 0);
    let mut state = 3u64;
    while kills < 25 || finished == 0 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        fs::remove_file(&map).unwrap_or_default();
        resumed += usize::from(has_checkpoint(folder.path()));
        let mut child = build.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(whole_time.mul_f64((state >> 40) as f64 / f64::from(1 << 24)));
        let killed = child.try_wait().unwrap().is_none();
        child.kill().unwrap_or_default();
        let output = child.wait_with_output().unwrap();
        if !killed {
            assert!(output.status.success(), "{}", text(&output.stderr));
            finished += 1;
        }
        kills += usize::from(killed);
        if !killed || map.exists() {
            assert!(fs::read(&map).unwrap() == whole, "after {kills} kills");
        }
    }
    assert!(resumed > 3, "{resumed} of {kills} kills left something to go on from");
    assert!(build.output().unwrap().status.success() && fs::read(&map).unwrap() == whole);
    let left = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    assert!(left.into_iter().all(|path| !path.is_dir()), "nothing is left behind");
}

fn has_checkpoint(folder: &Path) -> bool {
    let files =
        |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    files(folder)
        .filter(|path| path.is_dir())
        .flat_map(|folder| files(&folder).collect::<Vec<_>>())
        .any(|file| file.extension().is_some_and(|extension| extension == "checkpoint"))
}
