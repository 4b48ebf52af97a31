//! Commands that another program runs: their results, what they say, how far they are, and how they are stopped.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use dmp_cli::{Exit, Failure, FailureKind, Host, run_for};
use serde_json::Value;

/// Keeps the lines that it gets, and may stop the command at its first step.
#[derive(Debug, Default)]
struct Listening {
    lines: Mutex<Vec<String>>,
    stages: Mutex<Vec<Stage>>,
    stops: bool,
    is_stopped: AtomicBool,
}

#[derive(Debug, Clone, Copy)]
struct Stage {
    name: &'static str,
    unit: &'static str,
    total: Option<u64>,
    done: u64,
}

impl Host for Listening {
    fn say(&self, line: &str) {
        self.lines.lock().unwrap().push(line.to_owned());
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: Option<u64>) {
        self.stages.lock().unwrap().push(Stage { name, unit, total, done: 0 });
    }

    fn advance(&self, steps: u64) {
        self.stages.lock().unwrap().last_mut().unwrap().done += steps;
        self.is_stopped.store(self.stops, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }
}

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data-samples").join(name)
}

fn score(work: &Path) -> Vec<OsString> {
    let (log, truth) = (sample("town.mcap"), sample("truth.tum"));
    let (log, truth, work) = (log.as_os_str(), truth.as_os_str(), work.as_os_str());
    let texts = ["score".as_ref(), log, "-t".as_ref(), truth, "--json".as_ref(), "--work".as_ref(), work];
    texts.map(OsString::from).to_vec()
}

fn hosted(arguments: &[OsString], host: &Arc<Listening>) -> (Result<Exit, Failure>, String) {
    let mut out = Vec::new();
    let program = std::iter::once("dmp".into());
    let host: Arc<dyn Host> = Arc::clone(host) as Arc<dyn Host>;
    let done = run_for(program.chain(arguments.iter().cloned()), &mut out, host);
    (done, String::from_utf8(out).unwrap())
}

/// A result without what differs from one time to the next.
fn scores(json: &str) -> Value {
    let mut result: Value = serde_json::from_str(json).unwrap();
    let fields = result.as_object_mut().unwrap();
    assert!(fields.remove("timing").is_some() && fields.remove("memory").is_some());
    result
}

#[test]
fn a_hosted_command_gives_what_the_process_prints() {
    let folder = tempfile::tempdir().unwrap();
    let host = Arc::new(Listening::default());
    let (done, out) = hosted(&score(folder.path()), &host);
    assert_eq!(done, Ok(Exit::Done));
    let process = Command::new(env!("CARGO_BIN_EXE_dmp")).args(score(folder.path())).output().unwrap();
    assert_eq!(scores(&out), scores(&String::from_utf8(process.stdout).unwrap()));

    // All that is said but for what it took, which comes last.
    let lines = host.lines.lock().unwrap();
    let printed = String::from_utf8(process.stderr).unwrap();
    let printed: Vec<&str> = printed.lines().collect();
    let [said @ .., took] = lines.as_slice() else { panic!("nothing was said") };
    assert_eq!(said, &printed[..printed.len() - 1]);
    assert!(took.contains("returns scored for 1 run"), "{took}");

    let stages = host.stages.lock().unwrap();
    let cast = stages.iter().find(|stage| stage.name == "casting rays").unwrap();
    assert_eq!((cast.unit, cast.total), ("points", Some(cast.done)));
    assert!(cast.done > 0);
}

#[test]
fn one_command_is_stopped_and_another_beside_it_goes_on() {
    let (stopped_in, whole_in) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let stopping = Arc::new(Listening { stops: true, ..Listening::default() });
    let going_on = Arc::new(Listening::default());
    let (stopped, whole) = std::thread::scope(|scope| {
        let stopped = scope.spawn(|| hosted(&score(stopped_in.path()), &stopping));
        let whole = scope.spawn(|| hosted(&score(whole_in.path()), &going_on));
        (stopped.join().unwrap(), whole.join().unwrap())
    });
    let failure = stopped.0.unwrap_err();
    assert_eq!((failure.kind, failure.line.as_str()), (FailureKind::Interrupted, "stopped before the end"));
    assert_eq!(stopped.1, "");
    assert_eq!(std::fs::read_dir(stopped_in.path()).unwrap().count(), 0);
    assert_eq!(whole.0, Ok(Exit::Done));
    assert!(scores(&whole.1)["runs"].is_array());
}

#[test]
fn a_simulation_is_stopped_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("town.mcap").into_os_string();
    let host = Arc::new(Listening { stops: true, ..Listening::default() });
    let (done, _) = hosted(&["simulate".into(), "town".into(), "-o".into(), log], &host);
    assert_eq!(done.unwrap_err().kind, FailureKind::Interrupted);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn failures_say_what_is_at_fault() {
    let folder = tempfile::tempdir().unwrap();
    let garbage = folder.path().join("garbage.mcap");
    std::fs::write(&garbage, b"no log").unwrap();
    let failure = |arguments: &[&str]| {
        let arguments: Vec<OsString> = arguments.iter().map(Into::into).collect();
        let failure = hosted(&arguments, &Arc::default()).0.unwrap_err();
        (failure.kind, failure.line)
    };
    let (kind, line) = failure(&["score", "a.mcap"]);
    assert_eq!(kind, FailureKind::Usage);
    assert_eq!(line, "the following required arguments were not provided: --trajectory <[NAME=]RUN>");
    let (kind, line) = failure(&["score", "a.mcap", "-t", "b.tum", "--voxel", "wide"]);
    assert_eq!(kind, FailureKind::Usage);
    assert!(line.starts_with("invalid value 'wide' for '--voxel"), "{line}");
    let (kind, line) = failure(&["info", "no\nlog"]);
    assert_eq!(kind, FailureKind::Usage);
    assert!(line.ends_with("cannot be printed: rename it"), "{line}");
    let (kind, line) = failure(&["info", garbage.to_str().unwrap()]);
    assert_eq!(kind, FailureKind::Input);
    assert!(line.starts_with(garbage.to_str().unwrap()), "{line}");
    assert!(line.lines().count() == 1, "{line}");
}

#[test]
fn help_is_a_result() {
    let (done, out) = hosted(&["score".into(), "--help".into()], &Arc::default());
    assert_eq!(done, Ok(Exit::Done));
    assert!(out.contains("Usage: dmp score [OPTIONS] LOG"), "{out}");
}
