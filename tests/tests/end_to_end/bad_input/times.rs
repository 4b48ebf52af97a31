//! Rows 14 to 17: times of points, what a stamp is, disorder, and clocks that differ.

use std::fs;
use std::path::Path;

use dmp_log::{FolderFormat, read_trajectory};
use dmp_sensor::{Scan, Trajectory};

use super::{assert_close, save_tum, says, scored, scores, town, write_folder};
use crate::common::{refused, write_mcap};

const RUNS: &str = "-t truth.tum -t drift.tum";

/// A folder of PCD files called after their stamps, with fields of bytes made of stamp and time: name, type, size.
pub(super) fn timed(path: &Path, scans: &[Scan], fields: &[Field<'_>]) {
    fs::create_dir_all(path).unwrap();
    let column = |value: &dyn Fn(&Field<'_>) -> String| -> String {
        fields.iter().flat_map(|field| [" ".to_owned(), value(field)]).collect()
    };
    let head = format!(
        "VERSION .7\nFIELDS x y z{}\nSIZE 4 4 4{}\nTYPE F F F{}\nCOUNT 1 1 1{}\n",
        column(&|field| field.0.into()),
        column(&|field| field.2.to_string()),
        column(&|field| field.1.to_string()),
        column(&|_| "1".into())
    );
    for scan in scans {
        let stamp_ns = scan.stamp_ns.unwrap();
        let size = format!("WIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n", scan.len());
        let mut bytes = format!("{head}{size}").into_bytes();
        for (point, &time_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            bytes.extend(point.iter().flat_map(|c| c.to_le_bytes()));
            fields.iter().for_each(|field| bytes.extend((field.3)(stamp_ns, time_ns)));
        }
        fs::write(path.join(format!("{stamp_ns}.pcd")), bytes).unwrap();
    }
}

/// Name, type, size, and the bytes for a scan's stamp and a point's time after it, nanoseconds.
pub(super) type Field<'a> = (&'a str, char, u8, &'a dyn Fn(i64, i64) -> Vec<u8>);

fn f32_of(value: f64) -> Vec<u8> {
    (value as f32).to_le_bytes().into()
}

fn f64_of(value: f64) -> Vec<u8> {
    value.to_le_bytes().into()
}

fn at_end(scan: &Scan) -> Scan {
    let last_ns = scan.time_offsets_ns.iter().max().unwrap();
    let times = scan.time_offsets_ns.iter().map(|ns| ns - last_ns);
    Scan { stamp_ns: scan.stamp_ns.map(|ns| ns + last_ns), time_offsets_ns: times.collect(), ..scan.clone() }
}

#[test]
fn row_14_times_in_every_unit_and_from_every_origin_mean_the_same() {
    let (folder, scans) = town();
    let path = folder.path();
    let wanted = scored(path, &format!("score town.mcap {RUNS}"), 0);
    let ends: Vec<Scan> = scans.iter().map(at_end).collect();
    let s = |ns: i64| ns as f64 / 1e9;
    let kinds: [(&str, &[Scan], Field<'_>); 11] = [
        ("seconds", &scans, ("time", 'F', 4, &|_, ns| f32_of(s(ns)))),
        ("seconds", &scans, ("time", 'F', 8, &|_, ns| f64_of(s(ns)))),
        ("milliseconds", &scans, ("time", 'F', 4, &|_, ns| f32_of(1e3 * s(ns)))),
        ("microseconds", &scans, ("ts", 'F', 4, &|_, ns| f32_of(1e6 * s(ns)))),
        ("microseconds", &scans, ("offset_time", 'U', 4, &|_, ns| ((ns / 1000) as u32).to_le_bytes().into())),
        ("nanoseconds", &scans, ("t", 'U', 4, &|_, ns| (ns as u32).to_le_bytes().into())),
        ("seconds", &ends, ("time", 'F', 4, &|_, ns| f32_of(s(ns)))),
        ("nanoseconds", &ends, ("t", 'I', 4, &|_, ns| (ns as i32).to_le_bytes().into())),
        ("seconds", &scans, ("timestamp", 'F', 8, &|stamp, ns| f64_of(s(stamp + ns)))),
        ("microseconds", &scans, ("timestamp", 'F', 8, &|stamp, ns| f64_of(1e6 * s(stamp + ns)))),
        ("nanoseconds", &scans, ("timestamp", 'U', 8, &|stamp, ns| (stamp + ns).to_le_bytes().into())),
    ];
    for (number, (unit, scans, field)) in kinds.into_iter().enumerate() {
        let log = format!("timed{number}");
        timed(&path.join(&log), scans, &[field]);
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        let told = report["inputs"]["point_times"].as_str().unwrap();
        let words = [unit, field.0, "found from the values"];
        assert!(words.iter().all(|word| told.contains(word)), "{words:?}: {told}");
        assert_eq!(report["order"], wanted["order"], "{log}");
        assert_close(&report, &wanted, 2e-3);
        let info = scored(path, &format!("info {log}"), 0);
        assert_eq!(info["streams"][0]["scans"]["point_times"].as_str(), Some(told));
    }
}

#[test]
fn row_14_times_that_say_nothing_are_no_times() {
    let (folder, scans) = town();
    let path = folder.path();
    let plain = |scan: &Scan| Scan { time_offsets_ns: Vec::new(), ..scan.clone() };
    write_mcap(&path.join("plain.mcap"), &scans.iter().map(plain).collect::<Vec<_>>());
    let wanted = scores(&scored(path, &format!("score plain.mcap {RUNS}"), 0));
    for (log, value) in [("zero", 0.0), ("equal", 0.25)] {
        timed(&path.join(log), &scans, &[("time", 'F', 4, &|_, _| f32_of(value))]);
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        assert_eq!(scores(&report), wanted, "{log}");
        assert_eq!(report["inputs"]["point_times"], serde_json::Value::Null);
        assert!(says(&report["inputs"]["notes"], &["`time` is the same for all points"]), "{report}");
    }
}

#[test]
fn row_14_times_that_could_mean_this_or_that_are_refused() {
    let (folder, scans) = town();
    let path = folder.path();
    let wanted = scored(path, &format!("score town.mcap {RUNS}"), 0);
    let mixed = |ns: i64| (ns.wrapping_mul(2_654_435_761) >> 7) & 0xffff;
    timed(&path.join("garbage"), &scans, &[("time", 'F', 4, &|_, ns| f32_of(mixed(ns) as f64 / 1.3e4))]);
    timed(&path.join("huge"), &scans, &[("time", 'F', 4, &|_, ns| f32_of(mixed(ns) as f64 * 1e30))]);
    // The sensor's own clock: seconds since it was switched on.
    timed(
        &path.join("own"),
        &scans,
        &[("time", 'F', 8, &|stamp, ns| f64_of((stamp - 1_500_000_000_000_000_000 + ns) as f64 / 1e9))],
    );
    // Two fields, one of which counts half as fast.
    timed(
        &path.join("two"),
        &scans,
        &[
            ("t", 'U', 4, &|_, ns| (ns as u32).to_le_bytes().into()),
            ("time", 'F', 4, &|_, ns| f32_of(ns as f64 / 2e9)),
        ],
    );
    for (log, words) in [
        ("garbage", ["`time`", "span"]),
        ("huge", ["`time`", "span"]),
        ("own", ["`time`", "clock"]),
        ("two", ["`t` and `time`", "span"]),
    ] {
        let words = [log, words[0], words[1], "--point-time"];
        refused(path, &format!("score {log} {RUNS}"), 1, &words);
        let info = scored(path, &format!("info {log}"), 0);
        let problem = info["streams"][0]["problem"].as_str().unwrap();
        assert!(words.iter().all(|word| problem.contains(word)), "{problem}");
        assert_eq!(scored(path, &format!("score {log} {RUNS} --point-time ignore"), 0)["order"][0], "truth");
    }
    for (log, option) in [("own", "first-s"), ("two", "ns")] {
        let said = scored(path, &format!("score {log} {RUNS} --point-time {option}"), 0);
        let told = said["inputs"]["point_times"].as_str().unwrap();
        assert!(told.contains("as was said"), "{told}");
        assert_close(&said, &wanted, 2e-3);
    }
    refused(path, &format!("score plain {RUNS} --point-time ms"), 2, &["plain"]);
}

#[test]
fn row_15_stamps_of_the_middle_and_the_end_are_brought_to_the_start() {
    let (folder, scans) = town();
    let path = folder.path();
    let wanted = scored(path, &format!("score town.mcap {RUNS}"), 0);
    assert!(wanted["inputs"]["point_times"].as_str().unwrap().contains("the stamp is its start"));
    for (option, share) in [("mid", 0.5), ("end", 1.0)] {
        let moved = |scan: &Scan| {
            let [first, last] = [scan.time_offsets_ns.iter().min(), scan.time_offsets_ns.iter().max()];
            let shift_ns = (share * (last.unwrap() - first.unwrap()) as f64).round() as i64;
            Scan { stamp_ns: scan.stamp_ns.map(|ns| ns + shift_ns), ..scan.clone() }
        };
        let moved: Vec<Scan> = scans.iter().map(moved).collect();
        write_mcap(&path.join("moved.mcap"), &moved);
        let right = scored(path, &format!("score moved.mcap {RUNS} --stamp {option}"), 0);
        let told = right["inputs"]["point_times"].as_str().unwrap();
        assert!(told.contains(&format!("the stamp is its {option}")), "{told}");
        assert_close(&right, &wanted, 1e-6);
        // It matters: taken for the start, the scans are where the vehicle was not.
        let wrong = scored(path, &format!("score moved.mcap {RUNS}"), 0);
        let sum = |report: &serde_json::Value| report["runs"][0]["dmp_sum_m2"].as_f64().unwrap();
        assert!((sum(&wrong) / sum(&wanted) - 1.0).abs() > 0.1, "{} {}", sum(&wrong), sum(&wanted));
    }
}

#[test]
fn row_16_disorder_is_sorted_counted_and_told() {
    let (folder, mut scans) = town();
    let path = folder.path();
    let wanted = scored(path, &format!("score town.mcap {RUNS}"), 0);
    scans.reverse();
    scans.swap(3, 9);
    write_mcap(&path.join("backwards.mcap"), &scans);
    write_folder(&path.join("backwards"), &scans, FolderFormat::Pcd);
    let steps = scans.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count();
    for log in ["backwards.mcap", "backwards"] {
        let report = scored(path, &format!("score {log} {RUNS}"), 0);
        let told = format!("stamps go backwards {steps} times");
        assert!(says(&report["warnings"], &[&told]), "{}", report["warnings"]);
        assert_eq!(scores(&report)[1], wanted["order"]);
        assert_close(&report, &wanted, 1e-9);
        let info = scored(path, &format!("info {log}"), 0);
        assert_eq!(info["streams"][0]["scans"]["steps_back"].as_u64(), Some(steps as u64));
    }
    let twice: Vec<Scan> = scans.iter().chain(&scans[4..7]).cloned().collect();
    write_mcap(&path.join("twice.mcap"), &twice);
    let report = scored(path, &format!("score twice.mcap {RUNS}"), 0);
    assert!(says(&report["warnings"], &["3 scans have the stamp of another"]), "{}", report["warnings"]);
    let info = scored(path, "info twice.mcap", 0);
    assert_eq!(info["streams"][0]["scans"]["same_stamp"], 3);
}

/// A counter of nanoseconds in 32 bits: it starts again every 4.3 s.
#[test]
fn row_16_a_clock_that_starts_again_is_told() {
    let (folder, scans) = town();
    let path = folder.path();
    let short = |scan: &Scan| Scan { stamp_ns: scan.stamp_ns.map(|ns| ns & 0xffff_ffff), ..scan.clone() };
    write_mcap(&path.join("short.mcap"), &scans.iter().map(short).collect::<Vec<_>>());
    let info = scored(path, "info short.mcap", 0);
    let steps = info["streams"][0]["scans"]["steps_back"].as_u64().unwrap();
    assert!((2..=3).contains(&steps), "{steps}");
    refused(path, &format!("score short.mcap {RUNS}"), 1, &["0 of 24 scans have a pose", "--time-offset"]);
}

#[test]
fn row_17_clocks_that_differ_are_told_with_the_offset_that_helps() {
    let (folder, _) = town();
    let path = folder.path();
    let wanted = scored(path, &format!("score town.mcap {RUNS}"), 0);
    fs::create_dir(path.join("own")).unwrap();
    for name in ["truth", "drift"] {
        let run = read_trajectory(&path.join(format!("{name}.tum"))).unwrap().trajectory;
        let stamps = run.stamps_ns().unwrap().iter().map(|ns| ns - 1_600_000_000_000_000_000);
        let shifted = Trajectory::stamped(stamps.zip(run.poses().iter().copied()).collect()).unwrap();
        save_tum(&path.join(format!("own/{name}.tum")), &shifted.trajectory);
    }
    let runs = "-t own/truth.tum -t own/drift.tum";
    let words = ["run `truth`: 0 of 24 scans have a pose", "s apart", "--time-offset truth=-1600000000.000"];
    refused(path, &format!("score town.mcap {runs}"), 1, &words);
    let report = scored(path, &format!("score town.mcap {runs} --time-offset -1600000000"), 0);
    assert_close(&report, &wanted, 1e-9);
}
