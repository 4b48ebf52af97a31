//! Rows 4, 7 and 22: logs of more points and files than fit in small numbers, and logs that change.

use std::fs::{self, File};
use std::sync::Mutex;

use dmp::{Config, Progress, Run, Stage, evaluate};
use dmp_log::{FolderFormat, read_trajectory};
use dmp_sensor::{Scan, Trajectory};

use super::{dmp_limited, report_of, save_tum, scored, scores, town, write_folder};
use crate::common::{open, write_mcap};

/// More than 2³² points in files that take no room on the disk: counted to the last, from their lengths.
#[test]
fn row_04_points_beyond_32_bits_are_counted() {
    const POINTS_EACH: u64 = 200_000_000;
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("huge/scans");
    fs::create_dir_all(&scans).unwrap();
    for k in 0..25 {
        File::create(scans.join(format!("{k:06}.bin"))).unwrap().set_len(16 * POINTS_EACH).unwrap();
    }
    let info = scored(folder.path(), "info huge", 0);
    let scans = &info["streams"][0]["scans"];
    assert_eq!(scans["returns"].as_u64(), Some(25 * POINTS_EACH));
    const { assert!(25 * POINTS_EACH > 1 << 32) };
    assert_eq!(scans["returns_per_scan"]["max"].as_u64(), Some(POINTS_EACH));
    assert_eq!((info["bytes"].as_u64(), scans["scans"].as_u64()), (Some(400 * POINTS_EACH), Some(25)));
}

/// Hundreds of files, a hundred tiles and six runs with few file descriptors: the same scores.
#[cfg(unix)]
#[test]
fn row_07_few_file_descriptors_are_enough() {
    let (folder, scans) = town();
    let path = folder.path();
    // Every scan in ten parts, a nanosecond apart, and poses far apart.
    let part = |scan: &Scan, k: usize| Scan {
        stamp_ns: scan.stamp_ns.map(|ns| ns + k as i64),
        points_in_sensor_m: scan.points_in_sensor_m.iter().copied().skip(k).step_by(10).collect(),
        time_offsets_ns: scan.time_offsets_ns.iter().copied().skip(k).step_by(10).collect(),
    };
    let parts: Vec<Scan> = scans.iter().flat_map(|scan| (0..10).map(move |k| part(scan, k))).collect();
    write_folder(&path.join("parts"), &parts, FolderFormat::Pcd);
    let truth = read_trajectory(&path.join("truth.tum")).unwrap().trajectory;
    let stretched = truth.stamps_ns().unwrap().iter().zip(truth.poses()).map(|(&stamp_ns, pose)| {
        let mut pose = *pose;
        pose.translation.vector *= 50.0;
        (stamp_ns, pose)
    });
    save_tum(&path.join("far.tum"), &Trajectory::stamped(stretched.collect()).unwrap().trajectory);
    let runs = "-t a=far.tum -t b=far.tum -t c=far.tum -t d=drift.tum -t e=drift.tum -t f=truth.tum";
    let arguments = format!("score parts {runs} --point-time ns --threads 4 --memory 64MiB --work . --trust");
    let free = scored(path, &arguments, 0);
    let output = dmp_limited(path, "ulimit -n 24", &format!("{arguments} --json --quiet"));
    let few = report_of(&output, &arguments, 0);
    assert_eq!(scores(&few), scores(&free));
    assert!(few["runs"][0]["tiles"].as_u64().unwrap() > 60, "{}", few["runs"][0]["tiles"]);
}

/// Changes the log when a stage begins.
struct Meddler<F: Fn() + Sync> {
    at: fn(Stage) -> bool,
    change: F,
    done: Mutex<bool>,
}

impl<F: Fn() + Sync> Progress for Meddler<F> {
    fn begin(&self, stage: Stage, _: u64) {
        let mut done = self.done.lock().unwrap();
        if (self.at)(stage) && !*done {
            (self.change)();
            *done = true;
        }
    }
}

/// The log, what happens to it, and words of the error.
type Change<'a> = (&'a str, Box<dyn Fn() + Sync + 'a>, &'a [&'a str]);

#[test]
fn row_22_a_log_that_changes_while_it_is_read_is_never_scored() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("pcd"), &scans, FolderFormat::Pcd);
    let run = Run::new("truth", read_trajectory(&path.join("truth.tum")).unwrap().trajectory);
    let stages: [fn(Stage) -> bool; 2] =
        [|stage| matches!(stage, Stage::Fuse), |stage| matches!(stage, Stage::Cast)];
    for at in stages {
        let shrunk = path.join("pcd/scans/000012.pcd");
        let whole = fs::read(&shrunk).unwrap();
        let mut other = whole.clone();
        *other.last_mut().unwrap() ^= 1;
        let log_file = path.join("town.mcap");
        let log_bytes = fs::read(&log_file).unwrap();
        let changes: [Change<'_>; 4] = [
            (
                "pcd",
                Box::new(|| fs::write(&shrunk, &whole[..whole.len() / 2]).unwrap()),
                &["000012.pcd", "changed since it was opened"],
            ),
            // As long as before, and another byte.
            ("pcd", Box::new(|| fs::write(&shrunk, &other).unwrap()), &["000012.pcd", "changed since"]),
            ("pcd", Box::new(|| fs::remove_file(&shrunk).unwrap()), &["000012.pcd", "no such file"]),
            (
                "town.mcap",
                Box::new(|| fs::write(&log_file, &log_bytes[..log_bytes.len() / 3]).unwrap()),
                &["town.mcap", "frame "],
            ),
        ];
        for (log, change, words) in changes {
            fs::write(&shrunk, &whole).unwrap();
            let meddler = Meddler { at, change, done: Mutex::new(false) };
            let log = open(&path.join(log));
            let report = evaluate(log.as_ref(), std::slice::from_ref(&run), &Config::default(), &meddler);
            let error = report.unwrap_err().to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
            assert!(*meddler.done.lock().unwrap());
        }
        fs::write(&shrunk, &whole).unwrap();
        write_mcap(&log_file, &scans);
    }
}
