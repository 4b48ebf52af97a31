//! Folders of scans in formats with a head: PCD, PLY, LAS.

use crate::common::{STAMP_NS, assert_says, open, open_error, read_all};
use dmp_log::{LogFormat, LogOptions, PointTime, TimeUnit, open_log};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A point of the test scans: x as a double, a byte in between, y and z, nanoseconds.
pub(crate) type Row = (f64, u8, f32, f32, u32);

/// Ten points over 0.09 s.
pub(crate) fn rows() -> Vec<Row> {
    (0..10).map(|k| (f64::from(k) + 0.25, k as u8, -1.5, k as f32 * 0.5, k * 10_000_000)).collect()
}

fn bytes(rows: &[Row], big_endian: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    for &(x, ring, y, z, t) in rows {
        if big_endian {
            bytes.extend(
                [&x.to_be_bytes()[..], &[ring], &y.to_be_bytes(), &z.to_be_bytes(), &t.to_be_bytes()]
                    .concat(),
            );
        } else {
            bytes.extend(
                [&x.to_le_bytes()[..], &[ring], &y.to_le_bytes(), &z.to_le_bytes(), &t.to_le_bytes()]
                    .concat(),
            );
        }
    }
    bytes
}

fn lines(rows: &[Row]) -> String {
    rows.iter().fold(String::new(), |mut text, (x, ring, y, z, t)| {
        writeln!(text, "{x} {ring} {y} {z} {t}").unwrap();
        text
    })
}

/// A PCD file, `data` being `ascii`, `binary` or `binary_compressed`.
pub(crate) fn pcd(rows: &[Row], data: &str) -> Vec<u8> {
    let points = rows.len();
    let mut file = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x ring y z t\nSIZE 8 1 4 4 4\nTYPE F U F F U\nCOUNT 1 1 1 1 1\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
    .into_bytes();
    match data {
        "ascii" => file.extend(lines(rows).bytes()),
        "binary" => file.extend(bytes(rows, false)),
        _ => {
            let mut columns: Vec<u8> = rows.iter().flat_map(|row| row.0.to_le_bytes()).collect();
            columns.extend(rows.iter().map(|row| row.1));
            columns.extend(rows.iter().flat_map(|row| row.2.to_le_bytes()));
            columns.extend(rows.iter().flat_map(|row| row.3.to_le_bytes()));
            columns.extend(rows.iter().flat_map(|row| row.4.to_le_bytes()));
            // LZF that only copies: runs of up to 32 bytes as they are.
            let packed: Vec<u8> =
                columns.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
            file.extend((packed.len() as u32).to_le_bytes());
            file.extend((columns.len() as u32).to_le_bytes());
            file.extend(packed);
        }
    }
    file
}

/// A PLY file, `format` being one of the three, with an element in front of the vertices.
pub(crate) fn ply(rows: &[Row], format: &str) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat {format} 1.0\nelement camera 2\nproperty float f\nelement vertex {}\nproperty double x\n\
         property uchar ring\nproperty float y\nproperty float z\nproperty uint t\nend_header\n",
        rows.len()
    )
    .into_bytes();
    match format {
        "ascii" => file.extend(format!("7\n8\n{}", lines(rows)).bytes()),
        _ => file.extend([vec![7; 8], bytes(rows, format == "binary_big_endian")].concat()),
    }
    file
}

pub(crate) const PCD: [&str; 3] = ["ascii", "binary", "binary_compressed"];
pub(crate) const PLY: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// The test scan in every way it can be written, with the extension.
pub(crate) fn files(rows: &[Row]) -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let pcd = PCD.map(|data| ("pcd", data, pcd(rows, data)));
    let ply = PLY.map(|format| ("ply", format, ply(rows, format)));
    pcd.into_iter().chain(ply).collect()
}

pub(crate) fn folder_of(scans: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in scans {
        write(&folder.path().join(name), bytes);
    }
    folder
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn every_way_of_writing_gives_the_same_scan() {
    for (extension, way, bytes) in files(&rows()) {
        let (a, b) = (format!("scans/0.{extension}"), format!("scans/1.{extension}"));
        let folder = folder_of(&[(&a, &bytes), (&b, &bytes), ("times.txt", b"5\n5.1\n")]);
        let log = open(folder.path());
        let summary = log.summary();
        let format = if extension == "pcd" { LogFormat::PcdFolder } else { LogFormat::PlyFolder };
        assert_eq!((summary.format, summary.returns, &summary.damage), (format, 20, &vec![]), "{way}");
        assert_says(summary.point_times.as_deref().unwrap(), &["field `t`", "nanoseconds after"]);
        assert_eq!(
            summary.fields.iter().map(|field| field.kind).collect::<Vec<_>>(),
            ["float64", "uint8", "float32", "float32", "uint32"]
        );
        for (k, scan) in read_all(&*log).iter().enumerate() {
            assert_eq!(scan.stamp_ns, Some(5_000_000_000 + k as i64 * 100_000_000));
            let expected: Vec<_> = rows().iter().map(|row| [row.0 as f32, row.2, row.3]).collect();
            assert_eq!(scan.points_in_sensor_m, expected, "{way}");
            assert_eq!(scan.time_offsets_ns, rows().iter().map(|row| i64::from(row.4)).collect::<Vec<_>>());
        }
    }
}

#[test]
fn las_scans_have_times_where_the_format_has() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format) in [("a.las", 0), ("b.laz", 1), ("c.LAZ", 6)] {
        crate::cloud::write_las_scan(&folder.path().join(name), 100, format);
    }
    let log = open(folder.path());
    assert_eq!((log.summary().format, log.summary().returns), (LogFormat::LasFolder, 300));
    for scan in read_all(&*log) {
        assert_eq!(scan.points_in_sensor_m[8], [2.0, 0.5, 1.0]);
    }
    let first =
        LogOptions { point_time: PointTime::FromFirst(TimeUnit::Milliseconds), ..LogOptions::default() };
    // The first scan decides, and it has no times.
    assert_says(&open_error(folder.path(), &first), &["[x, y, z]", "times/"]);
    fs::remove_file(folder.path().join("a.las")).unwrap();
    // From 0 to 99 s: as seconds, no scan of a turning sensor.
    assert_says(
        &open_error(folder.path(), &LogOptions::default()),
        &["`gps_time`", "LAS has seconds", "`point_time`"],
    );
    let log = open_log(folder.path(), &first).unwrap();
    assert_eq!(read_all(&*log)[1].time_offsets_ns[..3], [0, 1_000_000, 2_000_000]);
}

#[test]
fn stamps_come_from_dates_or_names() {
    let scan = pcd(&rows(), "binary");
    let stamps = |folder: &tempfile::TempDir| {
        let log = open(folder.path());
        let notes = log.summary().notes.join("; ");
        (log.frames().iter().map(|frame| frame.stamp_ns).collect::<Vec<_>>(), notes)
    };
    let dates = b"2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.067685000\n";
    let folder = folder_of(&[
        ("velodyne_points/data/0000000000.pcd", &scan),
        ("velodyne_points/data/0000000001.pcd", &scan),
        ("velodyne_points/timestamps.txt", dates),
    ]);
    let (found, notes) = stamps(&folder);
    assert_eq!(found, [Some(1_317_042_145_964_389_445), Some(1_317_042_146_067_685_000)]);
    assert_says(&notes, &["timestamps.txt", "UTC"]);
    write(&folder.path().join("velodyne_points/timestamps.txt"), "5.5\n5.6\n");
    assert_eq!(stamps(&folder).0, [Some(5_500_000_000), Some(5_600_000_000)]);
    write(
        &folder.path().join("velodyne_points/timestamps.txt"),
        "2011-09-26 13:02:25\n2011-09-26 25:00:00\n",
    );
    assert_says(
        &open_error(folder.path(), &LogOptions::default()),
        &["timestamps.txt", "line 2", "25:00:00"],
    );

    for (names, unit) in [
        (["1690309709.385305500", "1690309709.285305500"], "seconds"),
        (["1690309709385305500", "1690309709285305500"], "nanoseconds"),
    ] {
        let names = names.map(|name| format!("{name}.pcd"));
        let folder = folder_of(&[(&names[0], &scan), (&names[1], &scan)]);
        let (found, notes) = stamps(&folder);
        assert_eq!(found, [Some(STAMP_NS), Some(STAMP_NS + 100_000_000)]);
        assert_says(&notes, &["file names", unit]);
        write(&folder.path().join("times.txt"), "1\n1.1\n");
        assert_eq!(stamps(&folder).0, [Some(1_000_000_000), Some(1_100_000_000)]);
    }
    let folder = folder_of(&[("1000000.pcd", &scan), ("2.pcd", &scan)]);
    assert_eq!(stamps(&folder).0, [None, None]);
}

#[test]
fn what_is_beside_scans_is_no_scan() {
    let (pcd, ply) = (pcd(&rows(), "binary"), ply(&rows(), "ascii"));
    let folder = folder_of(&[("0.pcd", &pcd), ("1.pcd", &pcd), ("0.ply", &ply), ("._2.pcd", b"junk")]);
    let error = open_log(folder.path(), &LogOptions::default()).unwrap_err();
    assert!(error.is_usage());
    assert_says(&error.to_string(), &["several formats", "2 .pcd", "1 .ply"]);
    write(&folder.path().join("2.pcd"), &pcd);
    let log = open(folder.path());
    assert_eq!(log.frames().len(), 3);
    assert_says(&log.summary().notes.join("; "), &["ignored, as they are no scans", "1 .ply"]);

    // A map beside the folder of scans, or beside a bag; alone it is a scan.
    let folder = folder_of(&[("map.ply", &ply), ("scans/0.pcd", &pcd), ("scans/1.pcd", &pcd)]);
    let log = open(folder.path());
    assert_eq!((log.summary().format, log.frames().len()), (LogFormat::PcdFolder, 2));
    fs::remove_dir_all(folder.path().join("scans")).unwrap();
    assert_eq!(open(folder.path()).summary().format, LogFormat::PlyFolder);
    let bag = crate::common::scans(2, 5, true);
    crate::common::write_mcap(&folder.path().join("log.mcap"), &bag, dmp_log::McapCompression::None);
    assert_eq!(open(folder.path()).frames().len(), 2);
}

#[test]
fn a_cut_file_keeps_its_whole_points() {
    for (extension, way, bytes) in files(&rows()) {
        let (a, b) = (format!("0.{extension}"), format!("1.{extension}"));
        // Within the last point.
        let folder = folder_of(&[(&a, &bytes), (&b, &bytes[..bytes.len() - 12])]);
        let log = open(folder.path());
        let [damage] = log.summary().damage.as_slice() else { panic!("{way}: {:?}", log.summary().damage) };
        assert_says(&damage.place, &[&b]);
        if way == "binary_compressed" {
            assert_says(&damage.what, &["compressed bytes are claimed", "skipped"]);
            assert_eq!(log.frames().len(), 1);
        } else {
            let place = if way == "ascii" { "line 2" } else { "byte " };
            assert_says(&damage.place, &[place]);
            let read = read_all(&*log);
            assert_eq!(read[1].points_in_sensor_m, read[0].points_in_sensor_m[..9], "{way}");
            assert_eq!(read[1].time_offsets_ns.len(), 9);
        }
        // In the head: nothing is left of it.
        write(&folder.path().join(&b), &bytes[..60]);
        let log = open(folder.path());
        assert_says(&log.summary().damage[0].what, &["skipped"]);
        assert_eq!(log.frames().len(), 1);
        write(&folder.path().join(&a), &bytes[..60]);
        assert_says(&open_error(folder.path(), &LogOptions::default()), &["no scan can be read", &a]);
    }
}

#[test]
fn a_word_that_is_no_number_ends_a_text() {
    let text = String::from_utf8(pcd(&rows(), "ascii")).unwrap();
    let folder = folder_of(&[
        ("0.pcd", text.as_bytes()),
        ("1.pcd", text.replace("\n4.25 4", "\n4.25 four").as_bytes()),
    ]);
    let log = open(folder.path());
    assert_eq!(read_all(&*log)[1].len(), 4);
    assert_says(&log.summary().damage[0].place, &["1.pcd", "line 16"]);
    assert_says(&log.summary().damage[0].what, &["`four` in column 2", "of 10 points the 4 before"]);
    // Blank lines, tabs and carriage returns are no damage, nor is a last line without an end.
    let messy = text.replace('\n', "\r\n").replace(" -1.5", "\t -1.5").replace("\n5.25", "\n\r\n5.25");
    write(&folder.path().join("1.pcd"), messy.trim_end());
    assert_eq!(open(folder.path()).summary().damage, []);
}
