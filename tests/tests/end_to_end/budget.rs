//! Memory and disk: what is asked for is kept, or refused with what would do, and what is foreseen is what is written.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::common::{dmp_command, drift, noise, recorded, save_tum, text, write_mcap};
use dmp_sim::{LidarOptions, RecordingOptions, Route};

const MIB: u64 = 1 << 20;
/// How far the disk may be from what was said of it.
const SURE: f64 = 1.5;

/// A drive on which maps outgrow a small memory, and so many trajectories of it; the arguments that score them.
fn drive(folder: &Path, runs: u64) -> String {
    let lidar = LidarOptions { azimuth_steps: 200, rate_hz: 4.0, ..LidarOptions::with_beams(32) };
    let options =
        RecordingOptions { seed: 4, scans: 40, route: Route::Loop, speed_m_s: 8.0, traffic: 2, lidar };
    let (scans, truth) = recorded(&options);
    write_mcap(&folder.join("town.mcap"), &scans);
    let mut arguments =
        "score town.mcap --json --trust --drift=none --voxel 0.3 --threads 2 --work work".to_owned();
    fs::create_dir(folder.join("work")).unwrap();
    for seed in 0..runs {
        let wrong =
            if seed % 2 == 0 { drift(0.2 + 0.1 * seed as f64) } else { noise(0.01 * seed as f64, 0.05) };
        let wrong = dmp_sim::SlamErrors { seed, ..wrong };
        let run = if seed == 0 { truth.clone() } else { wrong.apply(&truth).unwrap() };
        save_tum(&folder.join(format!("run{seed}.tum")), &run);
        arguments.extend([" -t run".to_owned(), seed.to_string(), ".tum".to_owned()]);
    }
    arguments
}

/// What a command printed and needed at most: memory, and the files in its folder, those without a name too.
struct Needed {
    code: Option<i32>,
    stdout: String,
    stderr: String,
    anon_bytes: u64,
    disk_bytes: u64,
}

fn needed(mut command: Command, folder: &Path) -> Needed {
    let said = |name| fs::File::create(folder.join(name)).unwrap();
    command.stdin(Stdio::null()).stdout(said("stdout.txt")).stderr(said("stderr.txt"));
    let mut child = command.spawn().unwrap();
    let (mut anon_bytes, mut disk_bytes) = (0, 0);
    let code = loop {
        let process = format!("/proc/{}", child.id());
        let status = fs::read_to_string(format!("{process}/status")).unwrap_or_default();
        let anon = status.lines().find_map(|line| line.strip_prefix("RssAnon:"));
        let anon = anon.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
        anon_bytes = anon_bytes.max(anon.unwrap_or(0) * 1024);
        disk_bytes = disk_bytes.max(files_in(&folder.join("work")));
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let read = |name| text(&fs::read(folder.join(name)).unwrap());
    Needed { code, stdout: read("stdout.txt"), stderr: read("stderr.txt"), anon_bytes, disk_bytes }
}

/// Bytes of the files in a folder and those below it, as far as they have names.
fn files_in(folder: &Path) -> u64 {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let bytes = |entry: fs::DirEntry| match entry.metadata() {
        Ok(data) if data.is_dir() => files_in(&entry.path()),
        Ok(data) => data.len(),
        Err(_) => 0,
    };
    entries.filter_map(Result::ok).map(bytes).sum()
}

/// The mebibytes that a refusal says would do.
fn would_do(stderr: &str) -> u64 {
    let rest = stderr.split("need at least ").nth(1).unwrap_or_else(|| panic!("{stderr}"));
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn memory_stays_within_the_budget_or_the_error_states_what_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let all = drive(folder.path(), 12);
    let scored = |memory_mib: u64| {
        let command = dmp_command(folder.path(), &format!("{all} --sample 8 --memory {memory_mib}MiB"));
        needed(command, folder.path())
    };
    let refused = scored(40);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    let least_mib = would_do(&refused.stderr);
    let mut scores = Vec::new();
    for memory_mib in [least_mib, 256] {
        let done = scored(memory_mib);
        assert_eq!(done.code, Some(0), "{memory_mib} MiB: {}", done.stderr);
        let anon_mib = done.anon_bytes / MIB;
        assert!(anon_mib <= memory_mib, "{anon_mib} MiB of {memory_mib}");
        let report: Value = serde_json::from_str(&done.stdout).unwrap();
        scores.push((report["runs"].clone(), report["pairs"].clone()));
    }
    assert!(scores.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn the_disk_that_is_used_is_the_one_estimated() {
    let folder = tempfile::tempdir().unwrap();
    let all = drive(folder.path(), 4);
    for more in ["--memory 64MiB", "--memory 1GiB"] {
        let command = dmp_command(folder.path(), &format!("{all} --sample 8 --resume=3600 {more}"));
        let done = needed(command, folder.path());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let report: Value = serde_json::from_str(&done.stdout).unwrap();
        let said = report["memory"]["disk_bytes_estimated"].as_f64().unwrap();
        let ratio = done.disk_bytes as f64 / said;
        assert!((1.0 / SURE..=SURE).contains(&ratio), "{more}: {said} said, {} written", done.disk_bytes);
    }
}
