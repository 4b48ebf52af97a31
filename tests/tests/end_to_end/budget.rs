//! Memory and disk: what is asked for is kept, or refused with what would do, and what is foreseen is what is written.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::common::{dmp_command, done, drift, noise, recorded, save_tum, text, trajectory, write_mcap};
use dmp_log::{FolderFormat, FolderScanWriter};
use dmp_sensor::{Isometry3, Scan, Trajectory};
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
    /// With mapped files and the program itself.
    peak_bytes: u64,
    disk_bytes: u64,
}

fn needed(mut command: Command, folder: &Path) -> Needed {
    let said = |name| fs::File::create(folder.join(name)).unwrap();
    command.stdin(Stdio::null()).stdout(said("stdout.txt")).stderr(said("stderr.txt"));
    let mut child = command.spawn().unwrap();
    let (mut anon_bytes, mut peak_bytes, mut disk_bytes) = (0, 0, 0);
    let code = loop {
        let process = format!("/proc/{}", child.id());
        let status = fs::read_to_string(format!("{process}/status")).unwrap_or_default();
        let bytes = |key: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(key));
            line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) * 1024
        };
        anon_bytes = anon_bytes.max(bytes("RssAnon:"));
        peak_bytes = peak_bytes.max(bytes("VmHWM:"));
        disk_bytes = disk_bytes.max(files_in(&folder.join("work")));
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let read = |name| text(&fs::read(folder.join(name)).unwrap());
    Needed {
        code,
        stdout: read("stdout.txt"),
        stderr: read("stderr.txt"),
        anon_bytes,
        peak_bytes,
        disk_bytes,
    }
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
        let command = dmp_command(folder.path(), &format!("{all} --memory {memory_mib}MiB"));
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
        let command = dmp_command(folder.path(), &format!("{all} --resume=3600 {more}"));
        let done = needed(command, folder.path());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let report: Value = serde_json::from_str(&done.stdout).unwrap();
        let said = report["memory"]["disk_bytes_estimated"].as_f64().unwrap();
        let ratio = done.disk_bytes as f64 / said;
        assert!((1.0 / SURE..=SURE).contains(&ratio), "{more}: {said} said, {} written", done.disk_bytes);
    }
}

/// Points on a wall around the sensor.
fn around(points: usize, k: usize) -> Scan {
    let point = |n: usize| {
        let angle = 2.4 * (n + k) as f32;
        [20.0 * angle.cos(), 20.0 * angle.sin(), (n % 4001) as f32 / 1000.0 - 1.0]
    };
    let stamp_ns = Some(1_700_000_000_000_000_000 + 100_000_000 * k as i64);
    Scan { stamp_ns, points_in_sensor_m: (0..points).map(point).collect(), time_offsets_ns: Vec::new() }
}

/// Along a circle, a pose for each of so many scans.
fn round(scans: usize) -> Trajectory {
    let pose = |k: usize| {
        let (y, x) = (k as f64 / 3000.0).sin_cos();
        (around(0, k).stamp_ns.unwrap(), Isometry3::translation(40.0 * x, 40.0 * y, 0.0))
    };
    Trajectory::stamped((0..scans).map(pose).collect()).unwrap().trajectory
}

/// Inputs that are long, large or many, of which 1 is the full size; commands on them.
fn large(folder: &Path, part: usize) -> Vec<String> {
    let runs = drive(folder, 12).split(" -t ").skip(1).map(|run| format!(" -t {run}")).collect::<String>();
    let truth = trajectory(&folder.join("run0.tum"));
    let stamps_ns = truth.stamps_ns().unwrap();
    let (first_ns, poses) = (stamps_ns[0], 1_000_000 / part as i64);
    let step_ns = (stamps_ns[stamps_ns.len() - 1] - first_ns) / poses;
    let pose = |k: i64| Some((first_ns + k * step_ns, truth.world_from_body_at(first_ns + k * step_ns, 0)?));
    save_tum(
        &folder.join("long.tum"),
        &Trajectory::stamped((0..poses).filter_map(pose).collect()).unwrap().trajectory,
    );
    let mut writer = FolderScanWriter::create(&folder.join("big"), FolderFormat::Bin).unwrap();
    for k in 0..4 {
        writer.write_scan(&around(if k == 1 { 10_000_000 / part } else { 20_000 }, k)).unwrap();
    }
    writer.finish().unwrap();
    let many = 100_000 / part;
    write_mcap(&folder.join("many.mcap"), &(0..many).map(|k| around(20, k)).collect::<Vec<_>>());
    save_tum(&folder.join("round.tum"), &round(many.max(4)));
    done(folder, "simulate room -o room --size 320x240 --frames 60 --rate 5 -q");
    [
        "score town.mcap -t long.tum",
        "score town.mcap -t long.tum --trust",
        &format!("score town.mcap{runs} --drift=none"),
        "score room -t room/groundtruth.txt",
        "score big -t round.tum",
        "score big -t round.tum --voxel 2",
        "score many.mcap -t round.tum",
        "drift town.mcap -t run2.tum",
        "repair town.mcap -t run2.tum -o repaired.tum",
        "score town.mcap -t run0.tum --report page.html",
        "score town.mcap -t run0.tum --residuals returns.laz --voxel 0.3",
    ]
    .map(str::to_owned)
    .into()
}

/// Whether each command keeps to each memory, or is refused before it starts with what would do. Prints what each needed.
fn keeps_to_memory(part: usize, memories_mib: &[u64]) {
    let folder = tempfile::tempdir().unwrap();
    let mut failed = Vec::new();
    for arguments in large(folder.path(), part) {
        for memory_mib in memories_mib {
            let command = format!("{arguments} --memory {memory_mib}MiB --threads 2");
            let done = needed(dmp_command(folder.path(), &command), folder.path());
            let peak_mib = done.peak_bytes as f64 / MIB as f64;
            let found = match done.code {
                Some(2) => format!("refused: needs {} MiB", would_do(&done.stderr)),
                _ => format!("{peak_mib:.0} MiB"),
            };
            println!("{:70} {memory_mib:5} MiB  {found}", arguments.split(" -t run1").next().unwrap());
            // The command prints its own peak, which may still grow a little.
            let printed = done.stderr.split(" of memory").next().and_then(|rest| rest.rsplit("; ").next());
            let printed = printed.and_then(|peak| peak.strip_suffix(" MiB")?.parse::<f64>().ok());
            let is_true = printed.is_none_or(|printed| (0.9..1.1).contains(&(printed / peak_mib)));
            let has_ended_well = done.code == Some(2) || done.code == Some(0) && is_true;
            if !has_ended_well || peak_mib > 1.1 * *memory_mib as f64 {
                failed.push(format!(
                    "{command}: {:?}, {found}, printed {printed:?}: {}",
                    done.code, done.stderr
                ));
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn the_process_keeps_to_the_memory_whatever_is_long_large_or_many() {
    keeps_to_memory(100, &[128]);
}

#[test]
#[ignore = "nightly: a million poses, a scan of ten million points, 100,000 scans"]
fn the_process_keeps_to_the_memory_at_full_size() {
    keeps_to_memory(1, &[64, 256, 2048]);
}
