use crate::common::{assert_says, open, open_error, read_all};
use dmp_log::{LogOptions, PointTime, TimeUnit, open_log};
use std::fs;
use std::path::Path;

fn bin(points: usize) -> Vec<u8> {
    (0..points * 4).flat_map(|k| (k as f32).to_le_bytes()).collect()
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn scans_are_found_where_people_keep_them() {
    for place in ["", "scans", "velodyne", "velodyne_points/data"] {
        let folder = tempfile::tempdir().unwrap();
        for (name, points) in [("000000.bin", 2), ("000001.bin", 0), ("000002.bin", 1)] {
            write(&folder.path().join(place).join(name), bin(points));
        }
        write(&folder.path().join(place).join("notes.txt"), "");
        let log = open(folder.path());
        let read = read_all(&*log);
        assert_eq!(read[0].points_in_sensor_m, [[0.0, 1.0, 2.0], [4.0, 5.0, 6.0]]);
        assert_eq!(read.iter().map(dmp_sensor::Scan::len).collect::<Vec<_>>(), [2, 0, 1]);
        assert!(read.iter().all(|scan| scan.stamp_ns.is_none() && scan.time_offsets_ns.is_empty()));
        assert_eq!((log.summary().returns, log.summary().bytes), (3, 48));
    }
}

#[test]
fn numbers_are_put_in_order_as_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for k in [0, 1, 2, 10, 11, 100] {
        write(&folder.path().join(format!("{k}.bin")), bin(k + 1));
    }
    let returns: Vec<u64> = open(folder.path()).frames().iter().map(|frame| frame.returns).collect();
    assert_eq!(returns, [1, 2, 3, 11, 12, 101]);
}

#[test]
fn a_cut_file_keeps_its_whole_points() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("scans/000000.bin"), bin(3));
    write(&folder.path().join("scans/000001.bin"), &bin(3)[..41]);
    write(&folder.path().join("times/000000.f32"), &bin(3)[..12]);
    write(&folder.path().join("times/000001.f32"), &bin(3)[..12]);
    let log = open(folder.path());
    assert_eq!(read_all(&*log)[1].points_in_sensor_m.len(), 2);
    assert_eq!(read_all(&*log)[1].time_offsets_ns, [0, 1_000_000_000]);
    let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
    assert_says(&damage.place, &["000001.bin", "byte 32"]);
    assert_says(&damage.what, &["byte 41", "point 2"]);
}

#[test]
fn companions_are_read_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for k in 0..3 {
        write(&root.join(format!("velodyne/{k:06}.bin")), bin(2));
    }
    write(&root.join("times.txt"), "0.000000000e+00\r\n1.036e-01\r\n2.0731e-01\r\n");
    let log = open(root);
    let stamps: Vec<_> = log.frames().iter().map(|frame| frame.stamp_ns.unwrap()).collect();
    assert_eq!(stamps, [0, 103_600_000, 207_310_000]);
    assert_eq!(log.summary().period_ns, Some(103_710_000));
    assert_says(&log.summary().notes.join("; "), &["times.txt"]);
    // The folder itself may be named as well.
    assert_eq!(open(&root.join("velodyne")).frames(), log.frames());

    write(&root.join("times.txt"), "0\n1\n");
    let error = open_error(root, &LogOptions::default());
    assert_says(&error, &["times.txt: 2 stamps", "velodyne has 3"]);
    write(&root.join("times.txt"), "0\n1\nx\n");
    assert_says(&open_error(root, &LogOptions::default()), &["times.txt", "line 3", "`x`"]);
    write(&root.join("times.txt"), "0\n1\n2 3\n");
    assert_says(&open_error(root, &LogOptions::default()), &["times.txt", "line 3", "2 columns"]);
    fs::remove_file(root.join("times.txt")).unwrap();

    for k in 0..3 {
        write(&root.join(format!("times/{k:06}.f32")), [0.0_f32, 0.05].map(f32::to_le_bytes).concat());
    }
    let log = open(root);
    assert_eq!(read_all(&*log)[2].time_offsets_ns, [0, 50_000_001]);
    assert_says(log.summary().point_times.as_deref().unwrap(), &["times/", "seconds after"]);
    let with = |point_time| LogOptions { point_time, ..LogOptions::default() };
    let ignored = open_log(root, &with(PointTime::Ignore)).unwrap();
    assert!(!ignored.summary().has_point_times());
    let absolute = open_error(root, &with(PointTime::Absolute(TimeUnit::Seconds)));
    assert_says(&absolute, &["velodyne", "needs stamps"]);

    write(&root.join("times/000001.f32"), [0; 12]);
    let error = open_error(root, &LogOptions::default());
    assert_says(&error, &["000001.f32: 3 times", "000001.bin has 2"]);
    fs::remove_file(root.join("times/000001.f32")).unwrap();
    assert_says(&open_error(root, &LogOptions::default()), &["times/000001.f32", "no such file"]);
}

#[test]
fn a_time_that_is_no_number_takes_the_point_out() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("scans/a.bin"), bin(2));
    write(&folder.path().join("times/a.f32"), [f32::NAN, 0.05].map(f32::to_le_bytes).concat());
    let scan = read_all(&*open(folder.path())).remove(0);
    assert!(scan.points_in_sensor_m[0].iter().all(|c| c.is_nan()));
    assert_eq!(scan.time_offsets_ns, [0, 50_000_001]);
}

#[test]
fn a_scan_with_times_unlike_those_of_the_others_is_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let times = |end_s: f32| [0.0, end_s].map(f32::to_le_bytes).concat();
    write(&root.join("times.txt"), "0\n0.1\n0.2\n0.3\n0.4\n0.5\n");
    for k in 0..6 {
        write(&root.join(format!("scans/{k}.bin")), bin(2));
        write(&root.join(format!("times/{k}.f32")), times(0.09));
    }
    assert!(open(root).summary().damage.is_empty());

    write(&root.join("times/1.f32"), times(3.0));
    let log = open(root);
    assert_eq!(log.frames().len(), 5);
    assert_says(&format!("{:?}", log.summary().damage[0]), &["1.bin", "`times/*.f32`", "skipped"]);
    assert_says(log.summary().point_times.as_deref().unwrap(), &["a scan spans 0.0900 s"]);
    // As was said, whatever they are.
    let said = LogOptions { point_time: PointTime::Relative(TimeUnit::Seconds), ..LogOptions::default() };
    assert_eq!(open_log(root, &said).unwrap().frames().len(), 6);
}

#[test]
fn what_is_no_log_is_said_to_be_none() {
    let folder = tempfile::tempdir().unwrap();
    let error = open_log(&folder.path().join("gone"), &LogOptions::default()).unwrap_err();
    assert!(error.is_usage());
    assert_says(&error.to_string(), &["gone", "no such file"]);
    assert_says(&open_error(folder.path(), &LogOptions::default()), &["MCAP", ".bin", "velodyne/"]);
    write(&folder.path().join("a.txt"), "hello");
    let error = open_error(&folder.path().join("a.txt"), &LogOptions::default());
    assert_says(&error, &["a.txt", "MCAP", "[68, 65, 6c, 6c, 6f]"]);
    write(&folder.path().join("scan.bin"), bin(1));
    let options = LogOptions { topic: Some("/points".into()), ..LogOptions::default() };
    assert_says(&open_error(folder.path(), &options), &["`topic` /points", "no topics"]);
    let options = LogOptions { point_time: PointTime::Relative(TimeUnit::Seconds), ..LogOptions::default() };
    assert_says(&open_error(folder.path(), &options), &["`point_time` s", "times/"]);
}

#[test]
fn a_scan_that_shrinks_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.bin");
    write(&path, bin(4));
    let log = open(folder.path());
    write(&path, bin(1));
    let error = log.reader().unwrap().read(0, &mut dmp_sensor::Scan::default()).unwrap_err().to_string();
    assert_says(&error, &["scan.bin", "changed since it was opened: 64 bytes then, 16 now"]);
}
