//! Damaged files of each format, the same ones every time. Every reader gives an answer: no panic, no large allocation, no
//! reading without an end, and no wrong scan where the format has checksums.
//!
//! Each format is read in a process of its own, this test binary with [`FORMAT`] set, whose address space is limited. To see
//! one file again: `DMP_FORMAT=mcap_zstd DMP_RUN=17 cargo test -p dmp-log --test it mutation::child -- --nocapture`. More files:
//! `DMP_RUNS=2000`. `fuzz/` and `cargo xtask attack` have the same list of damage.
#![cfg(target_os = "linux")]

pub(crate) mod formats;
mod readers;
mod seeds;

use std::env;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use crate::damage::{Random, damage};
use formats::{Checksums, Format};
use readers::{Answer, bits};

/// Names the format that a child reads.
const FORMAT: &str = "DMP_FORMAT";
/// Address space of a child. The process alone has 80 MiB, damage up to 300 MiB; no format needs more than 20 beside them.
const ADDRESS_SPACE_KIB: u64 = 512 << 10;
/// How long the files of a format may take in all. Each takes about a millisecond.
const MOST: Duration = Duration::from_mins(5);

fn number(name: &str) -> Option<u64> {
    env::var(name).ok().map(|number| number.parse().unwrap())
}

/// Lets a child read every damaged file of a format. What is wrong, and in which run.
fn read_in_child(format: &str, most: Duration) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let [stdout, stderr] = ["out", "err"].map(|name| folder.path().join(name));
    let mut child = Command::new("sh")
        .args(["-c", "ulimit -v \"$1\" && shift && exec \"$@\"", "sh", &ADDRESS_SPACE_KIB.to_string()])
        .arg(env::current_exe().unwrap())
        .args(["--exact", "mutation::child", "--nocapture", "--test-threads=1"])
        .env(FORMAT, format)
        // Each thread of the allocator takes address space in advance.
        .env("MALLOC_ARENA_MAX", "1")
        .stdin(Stdio::null())
        .stdout(File::create(&stdout).unwrap())
        .stderr(File::create(&stderr).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.to_string();
        }
        if start.elapsed() > most {
            child.kill().unwrap();
            child.wait().unwrap();
            break format!("no answer within {most:?}");
        }
        thread::sleep(Duration::from_millis(20));
    };
    let [stdout, stderr] = [stdout, stderr].map(|path| fs::read_to_string(path).unwrap());
    println!("{format}: {}", stdout.lines().rfind(|line| line.starts_with("counted")).unwrap_or_default());
    let last = stdout.lines().rfind(|line| line.starts_with("run ")).unwrap_or("before the first run");
    let is_done = status == "exit status: 0" && stdout.contains("counted");
    if is_done { Ok(()) } else { Err(format!("{format}, {last}: {status}: {}", stderr.trim())) }
}

/// Not a test of its own: reads the damaged files of a format where one is named.
#[test]
fn child() {
    let Ok(name) = env::var(FORMAT) else { return };
    let format = formats::named(&name);
    let folder = tempfile::tempdir().unwrap();
    format.prepare(folder.path());
    let mut good = Vec::new();
    for seed in &format.seeds {
        // Without times: their meaning may be open.
        let answer = format.read(folder.path(), seed, 1);
        assert!(answer.refused.is_none(), "a good file is refused: {:?}", answer.refused);
        good.extend(answer.scans);
    }
    let runs = number("DMP_RUNS").unwrap_or(150);
    let (mut refused, mut scans) = (0, 0);
    for run in number("DMP_RUN").map_or(0..runs, |run| run..run + 1) {
        println!("run {run}");
        let (file, is_guarded) = damaged(&format, &name, run);
        let answer = format.read(folder.path(), &file, run);
        let is_promised = match format.checksums {
            Checksums::None => false,
            Checksums::OrDamage => answer.refused.is_none(),
            Checksums::Always => true,
        };
        for scan in &answer.scans {
            assert!(scan.time_offsets_ns.is_empty() || scan.time_offsets_ns.len() == scan.len());
            // Without times of points, as the good files were read.
            let same =
                |good: &dmp_sensor::Scan| (good.stamp_ns, bits(good).1) == (scan.stamp_ns, bits(scan).1);
            let is_known = !(is_promised && is_guarded) || good.iter().any(same);
            assert!(is_known, "it is no scan of the good files");
        }
        scans += answer.scans.len();
        refused += u64::from(answer.refused.is_some());
        if number("DMP_RUN").is_some() {
            println!("{answer:?}");
        }
    }
    println!("counted: {} read, {refused} refused in part or whole, {scans} scans", runs - refused);
    // Damage that does nothing, or leaves nothing, finds nothing.
    assert!(number("DMP_RUN").is_some() || (refused < runs && refused >= runs / 50));
}

fn damaged(format: &Format, name: &str, run: u64) -> (Vec<u8>, bool) {
    let name = name.bytes().fold(0_u64, |sum, c| sum.wrapping_mul(31).wrapping_add(c.into()));
    let mut random = Random::of(&[name, run]);
    let mut file = random.pick(&format.seeds).clone();
    let other = random.pick(&format.seeds).clone();
    let is_guarded = damage(format.form, &mut file, &other, &mut random);
    (file, is_guarded)
}

#[test]
fn damaged_files_of_every_format_get_an_answer() {
    let names = formats::all().into_iter().map(|format| format.name);
    let queue = Mutex::new(names.collect::<Vec<_>>());
    let wrong = Mutex::new(Vec::new());
    let work = || {
        loop {
            let Some(format) = queue.lock().unwrap().pop() else { break };
            wrong.lock().unwrap().extend(read_in_child(&format, MOST).err());
        }
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A reader that fails in its run 7.
fn failing(how: &str) -> fn(&Path, &Path, u64) -> Answer {
    match how {
        "panics" => |_, _, run| Answer::from(if run == 7 { panic!("on purpose") } else { Ok(()) }),
        "allocates" => |_, _, run| {
            let bytes = if run == 7 { 2 << 30 } else { 1 };
            Answer::from(if std::hint::black_box(vec![1_u8; bytes]).is_empty() {
                Err("none".into())
            } else {
                Ok(())
            })
        },
        "hangs" => |_, _, run| {
            if run == 7 {
                thread::sleep(Duration::from_hours(1));
            }
            Answer::from(Ok(()))
        },
        _ => |_, _, run| Answer {
            refused: None,
            scans: vec![crate::common::scan(usize::from(run == 7), 3, false)],
        },
    }
}

/// What the test above would not notice, it could not find.
#[test]
fn readers_that_fail_are_found() {
    for (how, words) in [
        ("panics", "on purpose"),
        ("allocates", "memory allocation"),
        ("hangs", "no answer"),
        ("errs", "no scan of the good files"),
    ] {
        let problem = read_in_child(&format!("that_{how}"), Duration::from_secs(20)).unwrap_err();
        assert!(problem.contains("run 7: ") && problem.contains(words), "{problem}");
    }
}
