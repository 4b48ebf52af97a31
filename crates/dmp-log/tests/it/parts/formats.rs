//! Parts of logs of every format.

use super::{assert_parts, bits, scans_of, sorted};
use crate::common::{Message, POINTS, STAMP_NS, assert_says, chunks, scan, scans, write_messages};
use crate::las_log::{Drive, WorldFile, seconds};
use dmp_log::{
    FolderFormat, FolderScanWriter, LogFormat, LogOptions, PointTime, open_log, outline_log, survey_log,
};
use std::fs;
use std::path::{Path, PathBuf};

/// Files and folders of other software that can be opened as logs.
fn of_other_software() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance");
    let entries = ["mcap", "rosbag2"].map(|name| fs::read_dir(folder.join(name)).unwrap());
    let paths = entries.into_iter().flatten().map(|entry| entry.unwrap().path());
    let is_log = |path: &PathBuf| {
        path.is_dir() && path.join("metadata.yaml").is_file() || path.extension().is_some_and(|e| e == "mcap")
    };
    let mut paths: Vec<_> = paths.filter(is_log).collect();
    paths.sort();
    paths
}

#[test]
fn parts_of_bags_of_other_software() {
    let mut compared = 0;
    for path in of_other_software() {
        let Ok(survey) = survey_log(&path, &LogOptions::default()) else {
            // Packed by rosbag2: refused in the same words.
            let errors = [
                open_log(&path, &LogOptions::default()).unwrap_err().to_string(),
                outline_log(&path, &LogOptions::default()).unwrap_err().to_string(),
            ];
            assert_eq!(errors[0], errors[1]);
            continue;
        };
        for stream in survey.streams {
            for point_time in [PointTime::Auto, PointTime::Ignore] {
                let options = LogOptions { topic: stream.topic.clone(), point_time, ..LogOptions::default() };
                if stream.problem.is_some() && point_time == PointTime::Auto {
                    continue;
                }
                let outline = assert_parts(&path, &options);
                assert_eq!(outline.bytes_read().is_none(), survey.format == LogFormat::Rosbag2Sqlite);
                compared += 1;
            }
        }
    }
    assert!(compared > 40, "{compared}");
}

#[test]
fn parts_of_the_sample() {
    let town = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data-samples/town.mcap");
    let outline = assert_parts(&town, &LogOptions::default());
    assert_eq!(outline.notes().len(), 2, "{:?}", outline.notes());
}

/// Rows that hold no message, and messages that are no scans: the others keep their numbers.
#[test]
fn a_sqlite_bag_is_read_row_by_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.db3");
    let bag = rusqlite::Connection::open(&path).unwrap();
    bag.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
         INSERT INTO topics VALUES(1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr');
         INSERT INTO topics VALUES(2, '/imu', 'sensor_msgs/msg/Imu', 'cdr');",
    )
    .unwrap();
    let mut insert =
        bag.prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)").unwrap();
    for k in 0..60 {
        let stamp_ns = STAMP_NS + k * 100_000_000;
        let message = Message { stamp_ns, ..Message::of(&[[k as f32, 2.0, 3.0]; 500]) }.encode();
        insert.execute((2, stamp_ns, [7_u8; 40])).unwrap();
        match k {
            20 => insert.execute((1, stamp_ns, "no bytes")).unwrap(),
            30 => insert.execute((1, stamp_ns + 50, &message[..900])).unwrap(),
            _ => insert.execute((1, stamp_ns + 50, message)).unwrap(),
        };
    }
    drop(insert);
    bag.close().unwrap();
    let whole = open_log(&path, &LogOptions::default()).unwrap();
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    // The row without bytes is none; the broken message shows only when it is read.
    assert_eq!((whole.frames().len(), outline.scans().len()), (58, 59));
    assert!(outline.scans().iter().all(|scan| scan.bytes < 7000));
    assert_eq!(outline.scans()[29].stamp_ns, Some(STAMP_NS + 3_000_000_000));
    let part = outline.open(&(0..59).collect::<Vec<_>>()).unwrap();
    assert_eq!((part.frames(), part.scans_in_log()), (whole.frames(), 59));
    assert_eq!((part.number_in_log(28), part.number_in_log(29)), (28, 30));
    assert_eq!(part.summary().topics, whole.summary().topics);
    let damage = sorted(&whole.summary().damage).join("; ");
    assert_says(&damage, &["row 42: a row that is no topic, time and bytes is lost", "(row 62)", "skipped"]);
    assert_eq!(sorted(&part.summary().damage).len(), 2);
    let part = outline.open(&[40, 41, 58]).unwrap();
    let x: Vec<f32> = scans_of(&*part).iter().map(|scan| scan.points_in_sensor_m[0][0]).collect();
    assert_eq!(x, [41.0, 42.0, 59.0]);
    // A row that is gone since.
    let bag = rusqlite::Connection::open(&path).unwrap();
    bag.execute("DELETE FROM messages WHERE id = 84", []).unwrap();
    bag.close().unwrap();
    let part = outline.open(&[40, 41]).unwrap();
    assert_eq!((part.frames().len(), part.number_in_log(0)), (1, 41));
    assert_says(&sorted(&part.summary().damage).join("; "), &["row 84", "is not found by its number"]);
}

#[test]
fn a_bag_of_several_files_is_one_log_and_damage_is_named_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let message = |k: i64| {
        let stamp_ns = STAMP_NS + k * 100_000_000;
        (0, Message { stamp_ns, ..Message::of(&[[k as f32, 2.0, 3.0]; 300]) }.encode())
    };
    for (name, of_file) in [("a_0.mcap", 0..40), ("a_1.mcap", 40..41), ("a_2.mcap", 41..100)] {
        let messages: Vec<_> = of_file.map(message).collect();
        write_messages(&folder.path().join(name), &[POINTS], &messages);
    }
    let list = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a_0.mcap\n    - a_1.mcap\n    - a_2.mcap\n";
    fs::write(folder.path().join("metadata.yaml"), list).unwrap();
    let outline = assert_parts(folder.path(), &LogOptions::default());
    let part = outline.open(&[39, 40, 41]).unwrap();
    let x: Vec<f32> = scans_of(&*part).iter().map(|scan| scan.points_in_sensor_m[0][0]).collect();
    assert_eq!((x, part.groups().len()), (vec![39.0, 40.0, 41.0], 3));

    let path = folder.path().join("a_2.mcap");
    let mut bytes = fs::read(&path).unwrap();
    let chunk = chunks(&bytes)[10].clone();
    bytes[chunk.end - 10] ^= 1;
    fs::write(&path, bytes).unwrap();
    let whole = open_log(folder.path(), &LogOptions::default()).unwrap();
    let outline = outline_log(folder.path(), &LogOptions::default()).unwrap();
    let part = outline.open(&(0..100).collect::<Vec<_>>()).unwrap();
    assert_eq!((part.frames(), &part.summary().damage), (whole.frames(), &whole.summary().damage));
    assert_eq!(part.summary().damage[0].place, format!("a_2.mcap, byte {}", chunk.start));
}

#[test]
fn parts_of_folders() {
    let folder = tempfile::tempdir().unwrap();
    for format in
        [FolderFormat::Bin, FolderFormat::Pcd, FolderFormat::Ply, FolderFormat::Las, FolderFormat::Laz]
    {
        for (name, is_stamped, with_times) in [("a", true, true), ("b", false, false)] {
            let path = folder.path().join(format!("{name}-{format:?}"));
            let mut writer = FolderScanWriter::create(&path, format).unwrap();
            for k in 0..45 {
                let mut scan = if k == 9 { scan(k, 0, false) } else { scan(k, 100, with_times) };
                if !is_stamped {
                    scan.stamp_ns = None;
                }
                writer.write_scan(&scan).unwrap();
            }
            writer.finish().unwrap();
            let outline = assert_parts(&path, &LogOptions::default());
            assert_eq!(outline.stamp_error_ns(), 0);
            assert_eq!(outline.scans()[12].stamp_ns.is_some(), is_stamped);
            assert!(outline.bytes_read().is_some_and(|bytes| bytes < 70 * outline.bytes()));
        }
    }
}

/// The heads of a folder's files are read, and the scans that are wanted.
#[test]
fn of_a_folder_only_the_part_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans");
    let mut writer = FolderScanWriter::create(&path, FolderFormat::Pcd).unwrap();
    scans(200, 5000, false).iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    let to_outline = outline.bytes_read().unwrap();
    assert!(to_outline < outline.bytes() / 5, "{to_outline}");
    let part = outline.open(&[50, 51, 52, 53, 54, 55, 56, 57, 58, 59]).unwrap();
    assert_eq!(part.bytes_read(), Some(to_outline));
    scans_of(&*part);
    let to_read = part.bytes_read().unwrap() - to_outline;
    let in_files: u64 = outline.scans()[50..60].iter().map(|scan| scan.bytes).sum();
    assert!((in_files..in_files + in_files / 5).contains(&to_read), "{to_read} of {in_files}");
}

#[test]
fn one_las_file_has_no_index_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let drive = Drive::new(12);
    for extension in ["las", "laz"] {
        let path = folder.path().join(format!("drive.{extension}"));
        let points = seconds(&drive.in_world(), 0);
        WorldFile { format: 6, standard_time: true, unit_m: 1.0, points: &points }.write(&path);
        let options = LogOptions { made_with: Some(drive.made_with()), ..LogOptions::default() };
        let outline = assert_parts(&path, &options);
        assert_says(&outline.notes().join("; "), &["has no index of its scans", "bytes were read"]);
        let part = outline.open(&[1, 4]).unwrap();
        assert_eq!((part.frames().len(), part.number_in_log(1)), (2, 4));
        let whole = open_log(&path, &options).unwrap();
        assert!(bits(&scans_of(&*part)[1]) == bits(&scans_of(&*whole)[4]));
    }
}
