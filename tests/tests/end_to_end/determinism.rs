//! The same inputs give the same bits, whatever the threads, the memory, the order of reading.

use std::collections::HashSet;
use std::process::Command;

use dmp::{Config, FrameOrder};
use dmp_sensor::Scan;

use crate::common::{
    PROGRAM, TWO, collapse, comparable, drift, noise, real_data, refused, runs_of, save_tum, score, scores,
    small_town, text, trajectory, write_mcap,
};

const MIB: usize = 1 << 20;
/// About what three threads and three runs need.
const LEAST: usize = 44 * MIB;

#[test]
fn a_simulated_log_with_moving_sensor_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 300);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let variant = |threads: usize, memory_bytes: usize, order: FrameOrder| {
        let report = score(&path, &runs, &Config { threads, memory_bytes, order, ..Config::default() });
        let is_felt = report.memory.scratch_bytes > 0;
        assert!(is_felt || memory_bytes > LEAST, "{threads} threads: partial tiles were to be spilled");
        comparable(&report)
    };
    let reference = variant(1, LEAST, FrameOrder::Log);
    for (threads, memory_bytes, order) in
        [(3, LEAST, FrameOrder::Shuffled(9)), (3, usize::MAX / 2, FrameOrder::Shuffled(4))]
    {
        let other = variant(threads, memory_bytes, order);
        assert_eq!(other, reference, "{threads} threads, {memory_bytes} bytes, {order:?}");
    }
}

/// The poses of times that come again are kept, but not of any number of times.
#[test]
fn returns_in_any_order_however_many_times_they_have() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(12, 500);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let scored = |scans: &[Scan]| {
        write_mcap(&path, scans);
        let mut report = comparable(&score(&path, &runs, &Config::default()));
        // The file is another one.
        for name in ["bytes", "fingerprint"] {
            report["inputs"].as_object_mut().unwrap().remove(name).unwrap();
        }
        report
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
        assert_eq!(scored(&by_ring), scored(&scans));
    }
}

#[test]
#[ignore = "nightly: a real drive three times"]
fn a_real_log_under_a_budget_that_is_felt() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let truth = trajectory(&data.join("poses_lidar_odometry.txt"));
    let runs = runs_of(&truth, &[("drift", drift(1.0)), ("collapsed", collapse(0.5))]);
    let base = Config { voxel_m: Some(0.2), ..Config::default() };
    let whole = score(&data, &runs, &Config { memory_bytes: usize::MAX / 2, threads: 1, ..base.clone() });
    for (memory_bytes, threads) in [(96 * MIB, 2), (72 * MIB, 4)] {
        let tight = Config { memory_bytes, threads, order: FrameOrder::Shuffled(3), ..base.clone() };
        let tight = score(&data, &runs, &tight);
        assert!(tight.memory.scratch_bytes > 0, "partial tiles were to be spilled");
        assert_eq!(comparable(&tight), comparable(&whole));
    }
}

/// Processors with fewer vector instructions than this one, in software: each takes another path through the caster.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
#[ignore = "nightly: QEMU takes minutes"]
fn other_processors_have_the_same_bits() {
    const QEMU: &str = "qemu-x86_64";
    if Command::new(QEMU).arg("--version").output().is_err() {
        assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "there is no {QEMU}");
        eprintln!("skipped: there is no {QEMU}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (scans, truth) = small_town(12, 200);
    write_mcap(&folder.path().join("town.mcap"), &scans);
    save_tum(&folder.path().join("truth.tum"), &truth);
    save_tum(&folder.path().join("noise.tum"), &noise(0.05, 0.2).apply(&truth).unwrap());
    let arguments = "score town.mcap -t truth.tum -t noise.tum --json --quiet --threads 1".split(' ');
    let scored = |command: &mut Command| {
        // All set, it does not begin again, which would be on the processor that is there.
        let memory = [
            ("MALLOC_MMAP_THRESHOLD_", "262144"),
            ("MALLOC_TRIM_THRESHOLD_", "1048576"),
            ("MALLOC_ARENA_MAX", "1"),
        ];
        let output = command.args(arguments.clone()).envs(memory).current_dir(&folder).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        scores(&output.stdout)
    };
    let here = scored(&mut Command::new(PROGRAM));
    assert!(here["runs"][0]["returns"].as_u64().unwrap() > 1000);
    for processor in ["Nehalem", "Haswell"] {
        let there = scored(Command::new(QEMU).args(["-cpu", processor, PROGRAM]));
        assert_eq!(there, here, "{processor}");
    }
}

#[test]
fn too_little_memory_is_refused_with_what_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["memory 40 MiB", "64 threads and 2 runs", "need at least", "fewer --threads"];
    refused(folder.path(), &format!("{TWO} --threads 64 --memory 40MiB"), 2, &words);
}
