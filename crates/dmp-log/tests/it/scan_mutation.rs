//! Thousands of damaged files of each format with one scan, and of the world's LAS: whatever comes of them, it is
//! an answer and no panic, and the file beside them is read.

use crate::common::{Random, scans};
use crate::las_log::WorldFile;
use crate::mutation::mutate;
use crate::scan_folder::{PCD, PLY, pcd, ply, rows};
use dmp_log::{FolderFormat, FolderScanWriter, LogOptions, MadeWith, PointTime, open_log};
use dmp_sensor::{Isometry3, Point3, Scan, Trajectory};
use std::fs;
use std::path::Path;

const RUNS: u64 = 2000;

/// Reads a folder of two files, the second of which is damaged in many ways. `is_packed`: whether damage may
/// show only when a scan is read.
fn damage_second(folder: &Path, extension: &str, good: &[u8], seed: u64, is_packed: bool) {
    let mut random = Random(seed);
    fs::write(folder.join(format!("0.{extension}")), good).unwrap();
    let path = folder.join(format!("1.{extension}"));
    let (mut read, mut lost) = (0, 0);
    for run in 0..RUNS {
        fs::write(&path, mutate(good, &mut random)).unwrap();
        // Damaged times may leave open what the field means.
        let point_time = if run % 2 == 0 { PointTime::Auto } else { PointTime::Ignore };
        let Ok(log) = open_log(folder, &LogOptions { point_time, ..LogOptions::default() }) else {
            assert!(point_time == PointTime::Auto, "{extension}: the file beside it was to be read");
            continue;
        };
        let mut reader = log.reader().unwrap();
        let mut scan = Scan::default();
        for frame in 0..log.frames().len() {
            match reader.read(frame, &mut scan) {
                Ok(()) => {
                    assert_eq!(scan.len() as u64, log.frames()[frame].returns);
                    assert!(scan.time_offsets_ns.is_empty() || scan.time_offsets_ns.len() == scan.len());
                    read += 1;
                }
                // What was found whole on opening is whole.
                Err(error) => assert!(is_packed && frame == 1, "{extension}: {error}"),
            }
        }
        lost += usize::from(!log.summary().damage.is_empty());
    }
    println!("{extension}: {read} scans read, {lost} folders with damage");
    assert!(read > RUNS as usize / 2 && lost > 0);
}

#[test]
fn bin() {
    let folder = tempfile::tempdir().unwrap();
    let good: Vec<u8> = (0..400).flat_map(|k| (k as f32).to_le_bytes()).collect();
    damage_second(folder.path(), "bin", &good, 100, false);
}

#[test]
fn pcd_in_every_encoding() {
    for (seed, data) in (110..).zip(PCD) {
        let folder = tempfile::tempdir().unwrap();
        damage_second(folder.path(), "pcd", &pcd(&rows(), data), seed, data == "binary_compressed");
    }
}

#[test]
fn ply_in_every_encoding() {
    for (seed, format) in (120..).zip(PLY) {
        let folder = tempfile::tempdir().unwrap();
        damage_second(folder.path(), "ply", &ply(&rows(), format), seed, false);
    }
}

#[test]
fn las_and_laz() {
    let source = tempfile::tempdir().unwrap();
    for (seed, (name, format)) in (130..).zip([("a.las", 1), ("b.laz", 1), ("c.laz", 6)]) {
        let path = source.path().join(name);
        crate::cloud::write_las(&path, 500, format);
        let folder = tempfile::tempdir().unwrap();
        damage_second(folder.path(), &name[2..], &fs::read(&path).unwrap(), seed, true);
    }
    // As it is written here.
    let path = source.path().join("own");
    let mut writer = FolderScanWriter::create(&path, FolderFormat::Laz).unwrap();
    writer.write_scan(&scans(1, 300, true)[0]).unwrap();
    writer.finish().unwrap();
    let folder = tempfile::tempdir().unwrap();
    damage_second(folder.path(), "laz", &fs::read(path.join("scans/000000.laz")).unwrap(), 140, true);
}

#[test]
fn one_file_in_world_coordinates() {
    let pose = |s: i64| (s * 1_000_000_000, Isometry3::translation(s as f64, 0.0, 0.0));
    let run = Trajectory::stamped((0..=20).map(pose).collect()).unwrap().trajectory;
    let point = |k: i64| (k as f64 * 0.01, Point3::new(500_000.0 + k as f64, 4_000_000.0, 1.0));
    let points: Vec<_> = (0..2000).map(point).collect();
    let folder = tempfile::tempdir().unwrap();
    let options = LogOptions { made_with: Some(MadeWith::new(run)), ..LogOptions::default() };
    for (seed, (name, format)) in (150..).zip([("a.las", 1), ("b.laz", 1), ("c.laz", 6)]) {
        let path = folder.path().join(name);
        WorldFile { format, standard_time: false, unit_m: 1.0, points: &points }.write(&path);
        let good = fs::read(&path).unwrap();
        let mut random = Random(seed);
        let mut read = 0_u64;
        for _ in 0..RUNS {
            fs::write(&path, mutate(&good, &mut random)).unwrap();
            let Ok(log) = open_log(&path, &options) else { continue };
            let mut reader = log.reader().unwrap();
            let mut scan = Scan::default();
            for (frame, info) in log.frames().iter().enumerate() {
                match reader.read(frame, &mut scan) {
                    Ok(()) => {
                        assert_eq!((scan.len() as u64, scan.stamp_ns), (info.returns, info.stamp_ns));
                        read += 1;
                    }
                    // Opening goes through the chunks one after the other, reading by the table of chunks.
                    Err(error) => assert!(name != "a.las", "{name}: {error}"),
                }
            }
        }
        println!("{name}: {read} scans read");
        assert!(read > 10_000);
    }
}
