//! Damage that breaks no form: rows of scans unlike the others, scans twice, stamps that jump, points that cannot be unpacked.

use std::fs;
use std::path::Path;

use dmp_log::FolderFormat;
use dmp_sensor::Scan;
use serde_json::Value;

use super::times::timed;
use super::{says, scored, town, write_folder};
use crate::common::{dmp, real_data, text, write_mcap};

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

/// What is done to the bytes of a file.
type Damage<'a> = &'a dyn Fn(&mut Vec<u8>);

/// Changes the bytes of a file.
fn change(file: &Path, how: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(file).unwrap();
    how(&mut bytes);
    fs::write(file, bytes).unwrap();
}

/// Whether a report doubts scans for what they hold or when they are stamped.
fn doubts(report: &Value) -> bool {
    ["unlike the others", "the same as scan", "is stamped", "no scan for"]
        .iter()
        .any(|words| says(&report["warnings"], &[words]))
}

/// Scans in a row that are damaged in the same way are like each other: what is usual in the log tells.
#[test]
fn row_31_rows_of_damaged_scans_are_named() {
    let (folder, scans) = town();
    let path = folder.path();
    let foreign_bytes = |bytes: &mut Vec<u8>| bytes[1024..5120].copy_from_slice(&foreign(4096));
    let lost = |bytes: &mut Vec<u8>| {
        let quarter = bytes.len() / 4;
        bytes[quarter..].fill(0);
    };
    // A bit of the exponents of a sector.
    let far = |bytes: &mut Vec<u8>| {
        let exponents = bytes[1024..5120].iter_mut().skip(3).step_by(4);
        exponents.filter(|byte| **byte & 0x7e == 0x40).for_each(|byte| *byte |= 4);
    };
    let kinds: [(&str, Damage<'_>, &[&str]); 3] = [
        ("foreign", &foreign_bytes, &["have up to", "ranges below 1 mm or above 100 km"]),
        ("lost", &lost, &["have down to", "returns where about", "are usual"]),
        ("far", &far, &["have ranges beyond", "where those of most scans end before"]),
    ];
    for (log, damage, words) in kinds {
        write_folder(&path.join(log), &scans, FolderFormat::Bin);
        for number in 10..14 {
            change(&path.join(format!("{log}/scans/{number:06}.bin")), damage);
        }
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        let told = [&["4 scans are unlike the others", "scans 10 to 13"], words].concat();
        assert!(says(&report["warnings"], &told), "{log}: {}", report["warnings"]);
    }
}

/// A driver that has stopped sends its last scan again, with new stamps.
#[test]
fn row_31_scans_that_hold_the_same_are_named() {
    let (folder, mut scans) = town();
    let path = folder.path();
    for copy in [12, 13, 20] {
        let Scan { points_in_sensor_m, time_offsets_ns, .. } = scans[if copy == 20 { 3 } else { 11 }].clone();
        scans[copy] = Scan { points_in_sensor_m, time_offsets_ns, ..scans[copy] };
    }
    // Scans without returns are alike, and no copies.
    for empty in [16, 17] {
        scans[empty] = Scan { stamp_ns: scans[empty].stamp_ns, ..Scan::default() };
    }
    write_folder(&path.join("bin"), &scans, FolderFormat::Bin);
    write_mcap(&path.join("frozen.mcap"), &scans);
    let words = ["scans 12 to 13 hold the same as scan 11; scan 20 holds the same as scan 3:"];
    for log in ["bin", "frozen.mcap"] {
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        assert!(says(&report["warnings"], &words), "{log}: {}", report["warnings"]);
        assert_eq!(report, scored(path, &format!("score {log} {RUNS} --threads 1"), 0), "{log}");
    }
}

/// The null: what is well, simulated and real, is not doubted.
#[test]
fn row_31_logs_that_are_well_are_not_doubted() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("bin"), &scans, FolderFormat::Bin);
    let city = "simulate city --km 0.1 --beams 16 --azimuth-steps 100 -o city/ --truth city.tum";
    assert!(dmp(path, city).status.success());
    let room = "simulate room -o room --size 80x60 --frames 60 --rate 10";
    assert!(dmp(path, room).status.success());
    let mut logs: Vec<String> = [
        format!("town.mcap {RUNS}"),
        format!("bin {RUNS}"),
        "@/town.mcap -t @/truth.tum".to_owned(),
        "city/ -t city.tum".to_owned(),
        "room -t room/groundtruth.txt".to_owned(),
    ]
    .into();
    for (log, poses) in [("nclt_revisit", "poses_lidar_odometry.txt"), ("rs32_static", "poses_icp_odom.txt")]
    {
        let real = real_data(log).map(|folder| folder.display().to_string());
        logs.extend(real.map(|folder| format!("{folder} -t {folder}/{poses}")));
    }
    for log in logs {
        let report = scored(path, &format!("score {log}"), 0);
        assert!(!doubts(&report), "{log}: {}", report["warnings"]);
    }
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
