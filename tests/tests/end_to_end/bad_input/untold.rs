//! Damage that breaks no form: rows of scans unlike the others, scans twice, stamps that jump, points that cannot be unpacked.

use std::fs;
use std::path::Path;

use dmp_log::FolderFormat;
use dmp_sensor::Scan;

use super::times::timed;
use super::{says, scored, town, write_folder};
use crate::common::{dmp, text, write_mcap};


const RUNS: &str = "-t truth.tum -t drift.tum";

/// Bytes that mean nothing.
fn foreign(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut any = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..count).map(|_| any()).collect()
}

/// Changes the bytes of a file.
fn change(file: &Path, how: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(file).unwrap();
    how(&mut bytes);
    fs::write(file, bytes).unwrap();
}

#[test]
fn row_16_stamps_that_jump_are_told() {
    let (folder, scans) = town();
    let path = folder.path();
    let shifted = |scan: &Scan, by_s: i64| Scan {
        stamp_ns: scan.stamp_ns.map(|ns| ns + by_s * 1_000_000_000),
        ..scan.clone()
    };
    let mut one = scans.clone();
    one[12] = shifted(&one[12], 3600);
    write_mcap(&path.join("one.mcap"), &one);
    let mut pause = scans.clone();
    pause[16..].iter_mut().for_each(|scan| *scan = shifted(scan, 60));
    write_mcap(&path.join("pause.mcap"), &pause);
    for (log, words) in [
        ("one.mcap", "scan 12 is stamped 3599.5 s after the scans around it"),
        ("pause.mcap", "no scan for 60.5 s after scan 15, where scans are 0.50 s apart"),
    ] {
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        assert!(says(&report["warnings"], &[words]), "{log}: {}", report["warnings"]);
        let info = dmp(path, &format!("info {log}"));
        assert!(text(&info.stdout).contains(words), "{log}\n{}", text(&info.stdout));
    }
}

#[test]
fn row_10_a_scan_that_cannot_be_unpacked_is_named_and_the_rest_is_scored() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("laz"), &scans, FolderFormat::Laz);
    change(&path.join("laz/scans/000012.laz"), |bytes| {
        let middle = bytes.len() / 2;
        bytes[middle..middle + 500].copy_from_slice(&foreign(500));
    });
    let words = ["scans/000012.laz, point 0", "cannot decode the points", "the scan is skipped"];
    let report = scored(path, &format!("score laz {RUNS}"), 3);
    assert!(says(&report["inputs"]["damage"], &words), "{}", report["inputs"]["damage"]);
    assert_eq!(report["inputs"]["scans"], 23);
    let info = scored(path, "info laz", 3);
    assert!(says(&info["damage"], &words), "{info}");
}

#[test]
fn row_14_one_scan_with_other_times_is_named_and_the_rest_is_scored() {
    let (folder, scans) = town();
    let path = folder.path();
    let odd_ns = scans[1].stamp_ns.unwrap();
    let time = |stamp_ns: i64, ns: i64| {
        let time_s = ns as f64 / 1e9 * if stamp_ns == odd_ns { 3e8 } else { 1.0 };
        (time_s as f32).to_le_bytes().to_vec()
    };
    timed(&path.join("pcd"), &scans, &[("time", 'F', 4, &time)]);
    let words = [&format!("{odd_ns}.pcd"), "times in field `time` are not like those of the other scans"];
    let report = scored(path, &format!("score pcd {RUNS}"), 3);
    assert!(says(&report["inputs"]["damage"], &words), "{}", report["inputs"]["damage"]);
    assert_eq!(report["inputs"]["scans"], 23);
    assert!(says(&scored(path, "info pcd", 3)["damage"], &words));
}
