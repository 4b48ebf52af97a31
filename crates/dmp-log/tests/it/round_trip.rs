use crate::common::{assert_says, open, read_all, scan, scans, write_mcap};
use dmp_log::{
    FolderFormat, FolderScanWriter, LogFormat, McapCompression, McapScanWriter, McapWriterOptions,
};
use dmp_sensor::Scan;
use std::fs;

const ALL: [McapCompression; 3] = [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None];

#[test]
fn mcap_gives_back_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for compression in ALL {
        for with_times in [false, true] {
            let mut written = scans(12, 300, with_times);
            written[5] = scan(5, 0, false);
            let path = folder.path().join("log.mcap");
            write_mcap(&path, &written, compression);
            let log = open(&path);
            assert!(read_all(&*log) == written, "{compression:?} {with_times}");
            let summary = log.summary();
            assert_eq!(summary.format, LogFormat::Mcap);
            assert_eq!(summary.topic.as_deref(), Some("/points"));
            assert_eq!(summary.frame_id.as_deref(), Some("lidar"));
            assert_eq!(summary.period_ns, Some(100_000_000));
            assert_eq!(summary.returns, 11 * 300);
            assert_eq!(summary.point_bytes, if with_times { 16 } else { 12 });
            assert_eq!(summary.topics[0].messages, 12);
            assert!(summary.damage.is_empty(), "{:?}", summary.damage);
            assert_eq!(summary.has_point_times(), with_times);
            if with_times {
                let words = summary.point_times.as_deref().unwrap();
                assert_says(words, &["field `t`", "nanoseconds after the scan's stamp", "spans 0.0987 s"]);
            }
            // Chunks of 10,000 bytes hold two or three of these scans.
            let groups = log.groups();
            assert!(groups.len() > 3 && groups.len() < 12, "{groups:?}");
            assert_eq!(groups.into_iter().flatten().collect::<Vec<_>>(), (0..12).collect::<Vec<_>>());
        }
    }
}

#[test]
fn frames_are_read_in_any_order_and_by_many_readers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let written = scans(20, 200, true);
    write_mcap(&path, &written, McapCompression::Zstd);
    let log = open(&path);
    std::thread::scope(|threads| {
        for start in 0..2 {
            let (log, written) = (&log, &written);
            threads.spawn(move || {
                let mut reader = log.reader().unwrap();
                let mut scan = Scan::default();
                for k in 0..20 {
                    let frame = (start + k * 7) % 20;
                    reader.read(frame, &mut scan).unwrap();
                    assert_eq!(scan, written[frame]);
                }
                let error = reader.read(20, &mut scan).unwrap_err().to_string();
                assert_says(&error, &["log.mcap", "frame 20", "20 scans"]);
            });
        }
    });
}

#[test]
fn the_same_scans_give_the_same_bytes_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    for compression in ALL {
        let (a, b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
        write_mcap(&a, &scans(10, 500, true), compression);
        write_mcap(&b, &scans(10, 500, true), compression);
        assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
        assert_eq!(open(&a).summary().fingerprint, open(&b).summary().fingerprint);
    }
    let before = fs::read(folder.path().join("a.mcap")).unwrap();
    let mut abandoned =
        McapScanWriter::create(&folder.path().join("a.mcap"), &McapWriterOptions::default()).unwrap();
    abandoned.write_scan(&scan(0, 10, false)).unwrap();
    drop(abandoned);
    assert_eq!(fs::read(folder.path().join("a.mcap")).unwrap(), before);
    let mut names: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["a.mcap", "b.mcap"]);
}

#[test]
fn times_before_the_stamp_are_written_where_they_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let ends = |least: i64, most: i64| Scan { time_offsets_ns: vec![least, 0, most], ..scan(0, 3, true) };
    let fits = ends(-99_000_000, 1_000_000);
    let options = McapWriterOptions { signed_times: true, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path, &options).unwrap();
    writer.write_scan(&fits).unwrap();
    for beyond in [ends(i64::from(i32::MIN) - 1, 0), ends(0, i64::from(i32::MAX) + 1)] {
        let error = writer.write_scan(&beyond).unwrap_err().to_string();
        assert_says(&error, &["ns after the stamp is beyond 32 bits"]);
    }
    writer.finish().unwrap();
    let log = open(&path);
    assert_eq!(read_all(&*log), [fits]);
}

#[test]
fn what_mcap_cannot_say_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let cases: [(Scan, &str); 6] = [
        (Scan { stamp_ns: None, ..scan(1, 3, false) }, "needs a stamp"),
        (Scan { stamp_ns: Some(i64::MAX), ..scan(1, 3, false) }, "9223372036854775807 ns"),
        (Scan { time_offsets_ns: vec![1], ..scan(1, 3, false) }, "3 points and 1 times"),
        (Scan { time_offsets_ns: vec![0, -1, 2], ..scan(1, 3, false) }, "-1 ns after"),
        (Scan { time_offsets_ns: vec![0, 1, 1 << 32], ..scan(1, 3, false) }, "4294967296 ns after"),
        (scan(1, 3, true), "3 times for 3 points, unlike"),
    ];
    for (refused, why) in cases {
        let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default()).unwrap();
        writer.write_scan(&scan(0, 3, false)).unwrap();
        let error = writer.write_scan(&refused).unwrap_err().to_string();
        assert_says(&error, &["log.mcap", "frame 1", why]);
        // The writer goes on.
        writer.write_scan(&scan(2, 3, false)).unwrap();
        writer.finish().unwrap();
        assert_eq!(open(&path).frames().len(), 2);
    }
    let nowhere = McapScanWriter::create(&folder.path().join("no/log.mcap"), &McapWriterOptions::default());
    assert_says(&nowhere.unwrap_err().to_string(), &["no/log.mcap: cannot write"]);
}

/// How far a scan may come back from how it was written: coordinates in metres, times in nanoseconds.
fn tolerance(format: FolderFormat) -> (f32, i64) {
    match format {
        // Seconds as float32 keep 4 ns of 0.1 s.
        FolderFormat::Bin => (0.0, 4),
        FolderFormat::Laz => (6e-5, 0),
        _ => (0.0, 0),
    }
}

#[test]
fn a_folder_gives_back_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let formats = [FolderFormat::Bin, FolderFormat::Pcd, FolderFormat::Ply, FolderFormat::Laz];
    let cases = [("a", true, true), ("b", true, false), ("c", false, true), ("d", false, false)];
    for (format, (name, stamped, timed)) in
        formats.into_iter().flat_map(|format| cases.map(|case| (format, case)))
    {
        let path = folder.path().join(format!("{name}-{}", format.extension()));
        let mut writer = FolderScanWriter::create(&path, format).unwrap();
        let mut written = scans(10, 50, timed);
        written[0] = scan(0, 0, false);
        for scan in &mut written {
            if !stamped {
                scan.stamp_ns = None;
            }
            writer.write_scan(scan).unwrap();
        }
        writer.finish().unwrap();
        let log = open(&path);
        let read = read_all(&*log);
        assert_eq!(log.groups(), [0..8, 8..10]);
        let (tolerance_m, tolerance_ns) = tolerance(format);
        for (read, written) in read.iter().zip(&written) {
            let near_m = |(a, b): (&f32, &f32)| (a - b).abs() <= tolerance_m;
            let places = |scan: &Scan| scan.points_in_sensor_m.as_flattened().to_vec();
            assert!(places(read).iter().zip(&places(written)).all(near_m), "{format:?}");
            assert_eq!(read.len(), written.len());
            assert_eq!(read.stamp_ns, written.stamp_ns);
            assert_eq!(read.time_offsets_ns.len(), written.time_offsets_ns.len(), "{format:?} {name}");
            let near_ns = |(a, b): (&i64, &i64)| (a - b).abs() <= tolerance_ns;
            assert!(read.time_offsets_ns.iter().zip(&written.time_offsets_ns).all(near_ns), "{format:?}");
        }
        assert_eq!(log.summary().has_point_times(), timed);
        assert_eq!(log.summary().damage, []);
        let again = FolderScanWriter::create(&path, format).unwrap_err();
        assert!(again.is_usage());
        assert_says(&again.to_string(), &[path.to_str().unwrap(), "not overwritten"]);
    }
    let refused =
        FolderScanWriter::create(&folder.path().join("e"), FolderFormat::Bin).and_then(|mut writer| {
            writer.write_scan(&scan(0, 3, true))?;
            writer.write_scan(&scan(1, 3, false))
        });
    assert_says(&refused.unwrap_err().to_string(), &["frame 1", "0 times for 3 points"]);
    assert!(!folder.path().join("e").exists());
}

#[test]
fn what_a_folder_cannot_say_is_refused_or_is_no_return() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |format, scan: Scan| {
        let mut writer = FolderScanWriter::create(&folder.path().join("f"), format).unwrap();
        writer.write_scan(&scan).unwrap_err().to_string()
    };
    for format in [FolderFormat::Pcd, FolderFormat::Ply] {
        for beyond in [-1, 1 << 32] {
            let scan = Scan { time_offsets_ns: vec![0, beyond, 2], ..scan(1, 3, false) };
            assert_says(&refusal(format, scan), &["frame 0", &format!("{beyond} ns after")]);
        }
    }
    let far = Scan { points_in_sensor_m: vec![[0.0, 3e5, 0.0]], ..scan(1, 0, false) };
    assert_says(&refusal(FolderFormat::Laz, far), &["frame 0", "300000 m"]);
    let path = folder.path().join("holes");
    let mut writer = FolderScanWriter::create(&path, FolderFormat::Laz).unwrap();
    let holes = vec![[f32::NAN, 1.0, 2.0], [1.0, 2.0, 3.0], [0.0, f32::INFINITY, 0.0]];
    writer.write_scan(&Scan { points_in_sensor_m: holes, ..scan(1, 0, false) }).unwrap();
    writer.finish().unwrap();
    assert_eq!(read_all(&*open(&path))[0].points_in_sensor_m, [[0.0; 3], [1.0, 2.0, 3.0], [0.0; 3]]);
}
