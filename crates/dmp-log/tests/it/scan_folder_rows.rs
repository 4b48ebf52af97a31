//! Rows of the list of bad inputs, for folders of scans.

use crate::common::{assert_says, open, open_error, read_all};
use crate::scan_folder::{Row, files, folder_of, pcd, ply, rows};
use dmp_log::LogOptions;
use std::fs;

/// The only damage of a folder of two scans, the second of which is `bytes`.
fn damage(extension: &str, good: &[u8], bad: &[u8]) -> (String, String, usize) {
    let (a, b) = (format!("0.{extension}"), format!("1.{extension}"));
    let folder = folder_of(&[(&a, good), (&b, bad)]);
    let log = open(folder.path());
    let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
    assert_says(&damage.place, &[&b]);
    assert_eq!(read_all(&*log)[0].len(), 10);
    (damage.place.clone(), damage.what.clone(), log.frames().len())
}

/// Replaces the first occurrence, which must be there.
fn replaced(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = file.windows(from.len()).position(|window| window == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("`{from}` is not in the file"));
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

#[test]
fn row_03_lying_headers_promise_nothing() {
    for (data, huge) in
        [("ascii", 10_u64), ("binary", 10), ("ascii", u64::MAX), ("binary", u64::MAX), ("binary", 1 << 40)]
    {
        let good = pcd(&rows(), data);
        let claimed = if huge == 10 { 1_000_000 } else { huge };
        let bad = replaced(
            &replaced(&good, "POINTS 10", &format!("POINTS {claimed}")),
            "WIDTH 10",
            &format!("WIDTH {claimed}"),
        );
        let (_, what, scans) = damage("pcd", &good, &bad);
        // All that is there is there.
        assert_says(&what.replace(',', ""), &["the file ends", &format!("of {claimed}")]);
        assert_eq!(scans, 2);
    }
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let good = ply(&rows(), format);
        let bad = replaced(&good, "vertex 10", "vertex 18446744073709551615");
        assert_says(&damage("ply", &good, &bad).1, &["the file ends", "of 18,446,744,073,709,551,615"]);
        let bad = replaced(&good, "camera 2", "camera 18446744073709551615");
        let (_, what, scans) = damage("ply", &good, &bad);
        assert!(what.contains("larger than any file") || what.contains("the 0 before it are kept"), "{what}");
        assert_eq!(scans, if format == "ascii" { 2 } else { 1 });
    }
    let good = pcd(&rows(), "binary_compressed");
    let sizes_at = good.len() - 210 - 210_usize.div_ceil(32) - 8;
    let with = |at: usize, value: u32| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&value.to_le_bytes());
        damage("pcd", &good, &bad).1
    };
    assert_says(&with(sizes_at, u32::MAX), &["4,294,967,295 compressed bytes are claimed", "skipped"]);
    assert_says(&with(sizes_at + 4, u32::MAX), &["cannot hold 4,294,967,295", "skipped"]);
    assert_says(&with(sizes_at + 4, 211), &["211 bytes unpacked", "skipped"]);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.laz");
    crate::cloud::write_las_scan(&folder.path().join("0.laz"), 10, 6);
    crate::cloud::write_las_scan(&path, 10, 6);
    let mut bad = fs::read(&path).unwrap();
    bad[107..111].fill(0);
    bad[247..255].fill(0xff);
    fs::write(&path, bad).unwrap();
    let options = LogOptions { point_time: dmp_log::PointTime::Ignore, ..LogOptions::default() };
    let log = dmp_log::open_log(folder.path(), &options).unwrap();
    assert_says(&log.summary().damage[0].what, &["18,446,744,073,709,551,615 points", "skipped"]);
}

#[test]
fn row_08_points_that_are_not_finite_are_handed_on() {
    let mut holes = rows();
    holes[3] = (f64::NAN, 0, 1.0, 2.0, 30_000_000);
    holes[7].2 = f32::INFINITY;
    for (extension, way, bytes) in files(&holes) {
        let name = format!("0.{extension}");
        let log = folder_of(&[(&name, &bytes)]);
        let scan = &read_all(&*open(log.path()))[0];
        assert_eq!((scan.len(), scan.time_offsets_ns.len()), (10, 10), "{way}");
        let finite =
            scan.points_in_sensor_m.iter().filter(|point| point.iter().all(|c| c.is_finite())).count();
        assert_eq!(finite, 8, "{way}");
        assert_eq!(scan.time_offsets_ns[8], 80_000_000);
    }
}

#[test]
fn row_09_returns_of_no_range_stay_what_they_are() {
    let nothing: Vec<Row> = rows().into_iter().map(|row| (0.0, row.1, 0.0, 0.0, 0)).collect();
    let mut mixed = rows();
    mixed[0] = (0.0, 0, 0.0, 0.0, 0);
    for (zero, some) in files(&nothing).into_iter().zip(files(&mixed)) {
        let (a, b) = (format!("0.{}", zero.0), format!("1.{}", zero.0));
        let folder = folder_of(&[(&a, &zero.2), (&b, &some.2)]);
        let log = open(folder.path());
        // Rows without a place say nothing of the times of points.
        assert_says(log.summary().point_times.as_deref().unwrap(), &["nanoseconds"]);
        let scans = read_all(&*log);
        assert_eq!(scans[0].points_in_sensor_m, [[0.0; 3]; 10]);
        assert_eq!(scans[1].points_in_sensor_m[0], [0.0; 3]);
    }
}

#[test]
fn row_10_empty_scans_are_scans() {
    for (extension, way, bytes) in files(&[]) {
        let name = format!("0.{extension}");
        let folder = folder_of(&[(&name, &bytes)]);
        let log = open(folder.path());
        assert_eq!((log.summary().returns, &log.summary().damage), (0, &vec![]), "{way}");
        assert!(read_all(&*log)[0].is_empty());
    }
    // A file of no bytes is an empty scan as .bin, and none of the others.
    assert_eq!(open(folder_of(&[("0.bin", b"")]).path()).frames().len(), 1);
    for name in ["0.pcd", "0.ply", "0.las", "0.laz"] {
        let folder = folder_of(&[(name, b"")]);
        assert_says(&open_error(folder.path(), &LogOptions::default()), &["no scan can be read", name]);
    }
}

#[test]
fn row_10_fields_that_make_no_sense_are_named() {
    let cases = [
        ("FIELDS x ring y", "FIELDS q ring y", "no field `x` among [q, ring, y, z, t]"),
        ("TYPE F U F F U", "TYPE F U I F U", "field `y` is int32, not float32 or float64"),
        ("SIZE 8 1 4 4 4", "SIZE 8 1 3 4 4", "`y` has the unknown type F of 3 bytes"),
        ("SIZE 8 1 4 4 4", "SIZE 8 1 4 4", "5 FIELDS, but 4 entries in SIZE"),
        ("COUNT 1 1 1 1 1", "COUNT 1 1 2 1 1", "no field `y`"),
        ("HEIGHT 1\n", "HEIGHT 2\n", "10 POINTS, but WIDTH times HEIGHT is 20"),
        ("HEIGHT 1\n", "HEIGHT 18446744073709551615\n", "is too large"),
        ("DATA ", "DATA zip", "data kept as `zip"),
    ];
    for data in ["ascii", "binary", "binary_compressed"] {
        let good = pcd(&rows(), data);
        for (from, to, problem) in cases {
            let (_, what, scans) = damage("pcd", &good, &replaced(&good, from, to));
            // Compressed, the size does not fit first.
            let size = data == "binary_compressed" && what.contains("bytes unpacked");
            assert!(what.contains(problem) || size, "{data}: {what}");
            assert_eq!(scans, 1);
        }
    }
    let cases = [
        ("property double x", "property double q", "lack x, y or z"),
        ("property float y", "property int y", "`y` is int, not float or double"),
        ("property float y", "property fluff y", "unknown type `fluff`"),
        ("property float y", "property list uchar int y", "lists are read neither"),
        ("element vertex", "element corner", "no element `vertex`"),
        ("format ", "format binary_", "unknown format"),
    ];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let good = ply(&rows(), format);
        for (from, to, problem) in cases {
            assert_says(&damage("ply", &good, &replaced(&good, from, to)).1, &[problem, "skipped"]);
        }
    }
    // A scan without the field with the times is given up.
    let good = pcd(&rows(), "binary");
    let (_, what, scans) = damage("pcd", &good, &replaced(&good, "z t\n", "z u\n"));
    assert_says(&what, &["no field `t`", "skipped"]);
    assert_eq!(scans, 1);
}
