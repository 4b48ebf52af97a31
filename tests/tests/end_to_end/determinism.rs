//! The same inputs give the same bits, whatever the threads, the memory, the order of reading.

use std::collections::HashSet;
use std::fs;
use std::process::Command;

use dmp::{Config, FrameOrder, MapSource};
use dmp_sensor::{Scan, Trajectory};

use crate::common::{
    collapse, comparable, drift, noise, real_data, refused, runs_of, score, small_town, text, write_mcap,
};

const MIB: usize = 1 << 20;
/// About what three threads and three runs need.
const LEAST: usize = 44 * MIB;

fn variants() -> Vec<(String, Config)> {
    let mut variants = Vec::new();
    for threads in [1, 2, 3] {
        for memory_bytes in [LEAST, 64 * MIB, 256 * MIB, usize::MAX / 2] {
            for order in [FrameOrder::Log, FrameOrder::Shuffled(9)] {
                let name = format!("{threads} threads, {} MiB, {order:?}", memory_bytes / MIB);
                variants.push((name, Config { threads, memory_bytes, order, ..Config::default() }));
            }
        }
    }
    variants
}

#[test]
fn a_simulated_log_with_moving_sensor_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 300);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let reference = comparable(&score(&path, &runs, &variants()[0].1));
    for (name, config) in &variants()[1..] {
        let report = score(&path, &runs, config);
        let felt = report.memory.scratch_bytes > 0;
        assert!(felt || config.memory_bytes > LEAST, "{name}: partial tiles were to be put aside");
        assert_eq!(comparable(&report), reference, "{name}");
    }
}

/// The poses of times that come again are kept, but not of any number of times.
#[test]
fn returns_in_any_order_however_many_times_they_have() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(12, 500);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let told = |scans: &[Scan]| {
        write_mcap(&path, scans);
        let mut told = comparable(&score(&path, &runs, &Config::default()));
        // The file is another one.
        for name in ["bytes", "fingerprint"] {
            told["inputs"].as_object_mut().unwrap().remove(name).unwrap();
        }
        told
    };
    for has_own_times in [false, true] {
        let mut scans = scans.clone();
        if has_own_times {
            scans
                .iter_mut()
                .flat_map(|scan| scan.time_offsets_ns.iter_mut().zip(0..))
                .for_each(|(ns, k)| *ns += k);
        }
        let times: HashSet<i64> = scans[0].time_offsets_ns.iter().copied().collect();
        assert_eq!(times.len() > 4096, has_own_times, "{} times", times.len());
        let mut by_ring = scans.clone();
        for scan in &mut by_ring {
            let ring = |k: usize| k % 16;
            let mut order: Vec<usize> = (0..scan.len()).collect();
            order.sort_by_key(|&k| ring(k));
            scan.points_in_sensor_m = order.iter().map(|&k| scan.points_in_sensor_m[k]).collect();
            scan.time_offsets_ns = order.iter().map(|&k| scan.time_offsets_ns[k]).collect();
        }
        assert_ne!(by_ring[0].time_offsets_ns, scans[0].time_offsets_ns);
        assert_eq!(told(&by_ring), told(&scans));
    }
}

#[test]
fn a_real_log_under_a_budget_that_is_felt() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let truth = dmp_log::read_trajectory(&data.join("poses_lidar_odometry.txt")).unwrap().trajectory;
    let runs = runs_of(&truth, &[("drift", drift(1.0)), ("collapsed", collapse(0.5))]);
    let base = Config { voxel_m: Some(0.2), ..Config::default() };
    let whole = score(&data, &runs, &Config { memory_bytes: usize::MAX / 2, threads: 1, ..base.clone() });
    for (memory_bytes, threads) in [(96 * MIB, 2), (72 * MIB, 4)] {
        let tight = Config { memory_bytes, threads, order: FrameOrder::Shuffled(3), ..base.clone() };
        let tight = score(&data, &runs, &tight);
        assert!(tight.memory.scratch_bytes > 0, "partial tiles were to be put aside");
        assert_eq!(comparable(&tight), comparable(&whole));
    }
    assert!(runs.iter().all(|run| run.map == MapSource::Fused));
}

/// Processors with fewer vector instructions than this one, in software: each takes another path through the caster.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
fn other_processors() {
    const QEMU: &str = "qemu-x86_64";
    if Command::new(QEMU).arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "there is no {QEMU}");
        eprintln!("skipped: there is no {QEMU}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (scans, truth) = small_town(12, 200);
    write_mcap(&folder.path().join("town.mcap"), &scans);
    let save = |name: &str, trajectory: &Trajectory| {
        dmp_log::write_tum(&mut fs::File::create(folder.path().join(name)).unwrap(), trajectory).unwrap();
    };
    save("truth.tum", &truth);
    save("noise.tum", &noise(0.05, 0.2).apply(&truth).unwrap());
    let arguments =
        ["score", "town.mcap", "-t", "truth.tum", "-t", "noise.tum", "--json", "--quiet", "--threads", "1"];
    let scored = |command: &mut Command| {
        // All set, it does not begin again, which would be on the processor that is there.
        let memory = [
            ("MALLOC_MMAP_THRESHOLD_", "262144"),
            ("MALLOC_TRIM_THRESHOLD_", "1048576"),
            ("MALLOC_ARENA_MAX", "1"),
        ];
        let output = command.args(arguments).envs(memory).current_dir(&folder).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let mut report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let object = report.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        report
    };
    let program = env!("CARGO_BIN_EXE_dmp-under-test");
    let here = scored(&mut Command::new(program));
    assert!(here["runs"][0]["returns"].as_u64().unwrap() > 1000);
    for processor in ["Nehalem", "Haswell"] {
        let there = scored(Command::new(QEMU).args(["-cpu", processor, program]));
        assert_eq!(there, here, "{processor}");
    }
}

#[test]
fn too_little_memory_is_refused_with_what_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "score @/town.mcap -t @/truth.tum -t @/drift.tum --threads 64 --memory 40MiB";
    let words = ["memory 40 MiB", "64 threads and 2 runs", "need at least", "fewer --threads"];
    refused(folder.path(), arguments, 2, &words);
}
