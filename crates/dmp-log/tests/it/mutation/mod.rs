//! Thousands of damaged files of each format. Whatever comes of them is an answer: no panic, no large
//! allocation, no reading without an end, and no wrong scan where the format has checksums.
//!
//! Each format is read in a process of its own, this test binary with [`FORMAT`] set, whose address space is
//! limited. Here another file is damaged for each run; the same ones every time. To see one again:
//! `DMP_MUTATION=mcap_zstd DMP_MUTATION_RUN=17 cargo test -p dmp-log --test it mutation::child -- --nocapture`
#![cfg(target_os = "linux")]

mod child;
mod formats;
mod mutator;
mod readers;
mod seeds;

use std::env;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// Names the format that a child reads.
const FORMAT: &str = "DMP_MUTATION";
/// The only run of a child; all where it is not set.
const RUN: &str = "DMP_MUTATION_RUN";
/// Address space of a child. The process alone has 80 MiB, and no format needs more than 20 beside them: each
/// child prints its peak.
const ADDRESS_SPACE_KIB: u64 = 256 << 10;
/// How long one file may take. They are of some kilobytes and take about a millisecond.
const ANSWER_WITHIN: Duration = Duration::from_secs(20);

/// Lets a child read every damaged file of a format. What the child counted, or what is wrong and in which run.
fn read_in_child(format: &str, answer_within: Duration) -> Result<String, String> {
    let limit = "ulimit -v \"$1\" && shift && exec \"$@\"";
    let mut child = Command::new("sh")
        .args(["-c", limit, "sh", &ADDRESS_SPACE_KIB.to_string()])
        .arg(env::current_exe().unwrap())
        .args(["--exact", "mutation::child", "--nocapture", "--test-threads=1"])
        .env(FORMAT, format)
        // Each thread of the allocator takes address space in advance.
        .env("MALLOC_ARENA_MAX", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (stdout, mut stderr) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let (send, lines) = mpsc::channel();
    let from_stdout = thread::spawn(move || {
        for line in BufReader::new(stdout).lines() {
            let _ = send.send(line.unwrap());
        }
    });
    let from_stderr = thread::spawn(move || {
        let mut text = String::new();
        stderr.read_to_string(&mut text).unwrap();
        text
    });
    let (mut run, mut counted, mut hangs) = (String::from("before the first run"), None, false);
    loop {
        match lines.recv_timeout(answer_within) {
            Ok(line) if line.starts_with("run ") => run = line,
            Ok(line) => counted = line.strip_prefix("counted: ").map(str::to_owned).or(counted),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                hangs = true;
                child.kill().unwrap();
                break;
            }
        }
    }
    let status = child.wait().unwrap();
    from_stdout.join().unwrap();
    let said = from_stderr.join().unwrap();
    if hangs {
        return Err(format!("{format}, {run}: no answer within {answer_within:?}"));
    }
    match counted {
        Some(counted) if status.success() => Ok(counted),
        _ => Err(format!("{format}, {run}: {status}: {}", said.trim())),
    }
}

/// Not a test of its own: reads the damaged files of a format where one is named.
#[test]
fn child() {
    if let Ok(format) = env::var(FORMAT) {
        child::read_all(&format, env::var(RUN).ok().map(|run| run.parse().unwrap()));
    }
}

#[test]
fn damaged_files_of_every_format_get_an_answer() {
    let queue = Mutex::new(formats::all().into_iter().map(|format| format.name).collect::<Vec<_>>());
    let wrong = Mutex::new(Vec::new());
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let work = || {
        loop {
            let Some(format) = queue.lock().unwrap().pop() else { break };
            match read_in_child(&format, ANSWER_WITHIN) {
                Ok(counted) => println!("{format}: {counted}"),
                Err(problem) => wrong.lock().unwrap().push(problem),
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(work);
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the test above would not notice, it could not find.
#[test]
fn readers_that_fail_are_found() {
    let problem = |format| read_in_child(format, Duration::from_secs(5)).unwrap_err();
    let panics = problem("that_panics");
    assert!(panics.contains("run 7: ") && panics.contains("a reader panicked on purpose"), "{panics}");
    let allocates = problem("that_allocates");
    assert!(allocates.contains("run 7: ") && allocates.contains("memory allocation"), "{allocates}");
    let hangs = problem("that_hangs");
    assert!(hangs.contains("run 7: no answer"), "{hangs}");
    let wrong = problem("that_is_wrong");
    assert!(wrong.contains("run 7: ") && wrong.contains("no scan of the good files"), "{wrong}");
}
