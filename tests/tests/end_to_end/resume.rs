//! Evaluations that are stopped or killed, and are taken up again: the same bits at the end.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use dmp::{Config, EvaluateError, Progress, Report, Run, ScoredReturns, Sink, Watch, evaluate};

use crate::common::{
    SMALL_CHUNK, comparable, dmp_command, done, drift, noise, open, plain, runs_of, scores, small_town, text,
    town_in, write_chunks,
};

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
    write_chunks(&path, &scans, SMALL_CHUNK);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    for every in [0, 3600] {
        let config = Config { memory_bytes: 32 << 20, per_tile: true, ..plain() };
        let whole = evaluate(open(&path).as_ref(), &runs, &config, ()).unwrap();
        let pieces = Config {
            work_folder: folder.path().to_path_buf(),
            checkpoint_every: Some(Duration::from_secs(every)),
            resume: true,
            ..config
        };
        let (report, stops) = in_pieces(&path, &runs, &pieces, 60_000);
        assert!(stops > 2, "{stops} stops");
        assert_eq!(comparable(&report), comparable(&whole));
        let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        assert_eq!(names.collect::<Vec<_>>(), ["town.mcap"], "nothing is left behind");
    }
}

/// Counts returns.
#[derive(Default)]
struct Counting(AtomicU64);

impl Sink for Counting {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.0.fetch_add(returns.offsets_ns.len() as u64, Ordering::Relaxed);
    }

    fn wants_every_return(&self) -> bool {
        true
    }
}

#[test]
fn tiles_and_returns_that_a_checkpoint_lacks_are_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(20, 180);
    write_chunks(&path, &scans, SMALL_CHUNK);
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
        // What wants every return sees those of before the stop once more.
        let seen = Counting::default();
        let config = Config { per_tile, ..config };
        let gone_on = evaluate(open(&path).as_ref(), &runs, &config, Watch::sink(&seen)).unwrap();
        assert_eq!((seen.0.into_inner(), &gone_on.runs), (whole.inputs.returns_used, &whole.runs));
        assert_eq!(gone_on.tiles, if per_tile { whole.tiles.clone() } else { Vec::new() });
    }
}

#[test]
fn a_checkpoint_of_another_evaluation_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(20, 180);
    write_chunks(&path, &scans, SMALL_CHUNK);
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

const SCORE: &str = "score town.mcap -t truth.tum -t drift.tum --trust --work . --json --quiet";
const BUILD: &str = "map build town.mcap -t truth.tum -o truth.dmpmap --work . --quiet";
const RESUMED: &str = "--resume=0.01 --memory 32MiB";

/// Kills a command again and again, at any time, until it was killed this often and finished once; what it makes is looked at
/// each time that it finishes. Returns how many kills left a checkpoint.
fn killed(
    folder: &Path,
    arguments: &str,
    kills: u32,
    lasts: Duration,
    mut finished: impl FnMut(&[u8]),
) -> u32 {
    let mut command = dmp_command(folder, arguments);
    let (mut killed, mut finishes, mut resumed, mut state) = (0, 0, 0, 1u64);
    while killed < kills || finishes == 0 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        resumed += u32::from(has_checkpoint(folder));
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(lasts.mul_f64((state >> 40) as f64 / f64::from(1 << 24)));
        if child.try_wait().unwrap().is_none() {
            // SIGKILL: nothing of the process runs after this.
            child.kill().unwrap();
            child.wait().unwrap();
            killed += 1;
            continue;
        }
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        finished(&output.stdout);
        finishes += 1;
    }
    resumed
}

fn has_checkpoint(folder: &Path) -> bool {
    let files =
        |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_checkpoint = |file: PathBuf| file.extension().is_some_and(|extension| extension == "checkpoint");
    files(folder).filter(|path| path.is_dir()).any(|folder| files(&folder).any(is_checkpoint))
}

fn kills_change_no_bit(kills: u32) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    town_in(path);
    let begun = Instant::now();
    let expected = scores(done(path, SCORE).as_bytes());
    let lasts = begun.elapsed();
    let same = |json: &[u8]| assert_eq!(scores(json), expected);
    let resumed = killed(path, &format!("{SCORE} {RESUMED}"), kills, lasts, same);
    assert!(resumed > kills / 10, "{resumed} of {kills} kills left a checkpoint");
}

#[test]
fn a_killed_score_is_resumed_and_no_bit_changes() {
    kills_change_no_bit(6);
}

#[test]
#[ignore = "nightly: a hundred kills take minutes"]
fn a_hundred_kills_change_no_bit() {
    kills_change_no_bit(100);
}

/// Without `--resume` a map that is there is whole; with it, it is the same at the end, and nothing is left behind.
fn kills_harm_no_map(kills: u32) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    town_in(path);
    let begun = Instant::now();
    done(path, BUILD);
    let (lasts, map) = (begun.elapsed(), path.join("truth.dmpmap"));
    let whole = fs::read(&map).unwrap();
    for k in 0..kills {
        fs::remove_file(&map).unwrap_or_default();
        let mut child = dmp_command(path, BUILD).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(lasts.mul_f64(f64::from(k) / f64::from(kills)));
        child.kill().unwrap_or_default();
        child.wait().unwrap();
        match fs::read(&map) {
            Ok(found) => assert!(found == whole, "a map that is there is whole"),
            Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::NotFound),
        }
    }
    fs::remove_file(&map).unwrap_or_default();
    killed(path, &format!("{BUILD} {RESUMED}"), kills, lasts, |_| {
        assert!(fs::read(&map).unwrap() == whole);
        fs::remove_file(&map).unwrap();
    });
    done(path, &format!("{BUILD} {RESUMED}"));
    assert!(fs::read(&map).unwrap() == whole);
    let left = fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    assert!(left.into_iter().all(|path| !path.is_dir()), "nothing is left behind");
}

#[test]
fn a_killed_build_leaves_a_whole_map_or_none_and_is_resumed() {
    kills_harm_no_map(4);
}

#[test]
#[ignore = "nightly: 50 kills"]
fn fifty_kills_harm_no_map() {
    kills_harm_no_map(25);
}
