//! Bags that are not whole: several sensors on one topic, databases cut short or with a log beside them, files that are gone.

use crate::common::{Message, POINTS, STAMP_NS, assert_says, open, open_error, read_all, write_messages};
use dmp_log::{LogOptions, open_log, outline_log, survey_log};
use rusqlite::Connection;
use std::fs;
use std::path::{Path, PathBuf};

/// A scan that names this frame, of five letters.
fn scan(k: i64, frame: &str, points: usize) -> Vec<u8> {
    let message =
        Message { stamp_ns: STAMP_NS + k * 100_000_000, ..Message::of(&vec![[1.0, 2.0, k as f32]; points]) };
    let mut bytes = message.encode();
    let at = bytes.windows(5).position(|five| five == b"lidar").unwrap();
    bytes[at..at + 5].copy_from_slice(frame.as_bytes());
    bytes
}

fn log_of(folder: &Path, frames: &[&str]) -> PathBuf {
    let path = folder.join("log.mcap");
    let scans: Vec<_> = frames.iter().enumerate().map(|(k, frame)| (0, scan(k as i64, frame, 4))).collect();
    write_messages(&path, &[POINTS], &scans);
    path
}

#[test]
fn of_several_sensors_on_a_topic_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let with = |frame: &str| LogOptions { topic: Some(format!(":{frame}")), ..LogOptions::default() };
    for frames in [
        ["front", "back0"].repeat(15),
        [["front"; 14].as_slice(), &["back0"; 16]].concat(),
        ["front", "back0", "left0"].repeat(10),
        ["front", "front", "front", "back0"].repeat(8),
        [["front"; 28].as_slice(), &["back0"; 2]].concat(),
    ] {
        let path = log_of(folder.path(), &frames);
        let error = open_error(&path, &LogOptions::default());
        assert_says(
            &error,
            &["log.mcap: topic /points has scans of several sensors", "`front` (", "`back0` ("],
        );
        assert_says(&error, &["a place of its own", "name it with `topic` /points:front"]);
        assert_eq!(outline_log(&path, &LogOptions::default()).unwrap_err().to_string(), error);
        let survey = survey_log(&path, &LogOptions::default()).unwrap();
        assert_says(&survey.streams[0].problem.as_ref().unwrap().to_string(), &["several sensors"]);
        for frame in ["front", "/back0"] {
            let count = frames.iter().filter(|name| **name == frame.trim_start_matches('/')).count();
            let log = open_log(&path, &with(frame)).unwrap();
            assert_eq!((log.frames().len(), read_all(&*log).len()), (count, count));
            assert_eq!(log.summary().frame_id.as_deref(), Some(frame.trim_start_matches('/')));
            assert_says(&log.summary().notes.join("; "), &["scans of other frames are left out"]);
            let all: Vec<usize> = (0..frames.len()).collect();
            let part = outline_log(&path, &with(frame)).unwrap().open(&all).unwrap();
            assert_eq!(read_all(&*part), read_all(&*log));
        }
        let error = open_log(&path, &with("none0")).unwrap_err();
        assert!(error.is_usage());
        assert_says(&error.to_string(), &["`topic` /points:none0 was given, but the topic has", "`front` ("]);
    }
}

#[test]
fn a_stray_frame_is_a_damaged_scan() {
    let folder = tempfile::tempdir().unwrap();
    let mut frames = ["front"; 30];
    frames[0] = "xront";
    let log = open(&log_of(folder.path(), &frames));
    assert_eq!((log.frames().len(), log.summary().frame_id.as_deref()), (29, Some("front")));
    assert_says(&log.summary().damage[0].what, &["its frame is `xront`", "the scan is skipped"]);
    // A stroke in front is no other frame.
    let frames = ["lidar"; 3];
    assert!(open(&log_of(folder.path(), &frames)).summary().damage.is_empty());
}

/// A database as rosbag2 writes it, of pages of this many bytes.
fn database(path: &Path, page_bytes: u32, scans: i64) -> Connection {
    let connection = Connection::open(path).unwrap();
    let tables = format!(
        "PRAGMA page_size = {page_bytes};
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
             data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);
         INSERT INTO topics VALUES(1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr', '');"
    );
    connection.execute_batch(&tables).unwrap();
    insert(&connection, 0..scans);
    connection
}

fn insert(connection: &Connection, scans: std::ops::Range<i64>) {
    for k in scans {
        let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?1, ?2)";
        connection.execute(insert, (STAMP_NS + k, scan(k, "lidar", 400))).unwrap();
    }
}

#[test]
fn what_is_whole_of_a_cut_database_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for (page_bytes, scans) in [(512, 40), (4096, 40), (4096, 120), (8192, 120), (4096, 300)] {
        let path = folder.path().join(format!("{page_bytes}_{scans}.db3"));
        database(&path, page_bytes, scans).close().unwrap();
        let whole = fs::read(&path).unwrap();
        let all = read_all(&*open(&path));
        assert_eq!(all.len() as i64, scans);
        for tenths in [9, 7, 5] {
            let cut = folder.path().join("cut.db3");
            let bytes = whole.len() * tenths / 10;
            let bytes = bytes - bytes % page_bytes as usize;
            // Of a page that is cut nobody knows what is whole.
            fs::write(&cut, &whole[..bytes + 100]).unwrap();
            let truncate = format!("`truncate -s {bytes} FILE.db3`");
            assert_says(&open_error(&cut, &LogOptions::default()), &["cut short within a page", &truncate]);
            fs::write(&cut, &whole[..bytes]).unwrap();
            let log = open(&cut);
            let found = read_all(&*log);
            // Every message but those at the cut; and pages of the index stand among them.
            let least = (scans as usize * tenths / 10)
                .saturating_sub(3 + scans as usize / 20 + page_bytes as usize / 4900);
            assert!((least..scans as usize).contains(&found.len()), "{page_bytes} {tenths}: {}", found.len());
            assert!(found.iter().all(|scan| all.contains(scan)), "{page_bytes} {tenths}");
            let damage: Vec<String> =
                log.summary().damage.iter().map(|lost| format!("{}: {}", lost.place, lost.what)).collect();
            assert_says(&damage[0], &["the file is cut short", "bytes of it are missing"]);
            assert!(damage.len() < 6, "{damage:?}");
        }
    }
}

#[test]
fn a_log_beside_a_database_is_read_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let connection = database(&path, 4096, 5);
    connection.execute_batch("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0;").unwrap();
    insert(&connection, 5..20);
    // As it lies there after the power was lost.
    let lost = folder.path().join("lost");
    fs::create_dir(&lost).unwrap();
    for name in ["a.db3", "a.db3-wal"] {
        fs::copy(folder.path().join(name), lost.join(name)).unwrap();
    }
    drop(connection);
    let names = || {
        let mut names: Vec<_> =
            fs::read_dir(&lost).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        let bytes: Vec<Vec<u8>> = names.iter().map(|name| fs::read(lost.join(name)).unwrap()).collect();
        (names, bytes)
    };
    let before = names();
    for _ in 0..2 {
        let log = open(&lost.join("a.db3"));
        assert_eq!((log.frames().len(), read_all(&*log).len()), (20, 20));
        let outline = outline_log(&lost.join("a.db3"), &LogOptions::default()).unwrap();
        assert_eq!(outline.open(&[3, 19]).unwrap().frames().len(), 2);
    }
    assert!(names() == before, "{:?}", names().0);
}

#[test]
fn files_that_are_gone_are_named() {
    let folder = tempfile::tempdir().unwrap();
    write_messages(
        &folder.path().join("r_0.mcap"),
        &[POINTS],
        &[(0, scan(0, "lidar", 4)), (0, scan(1, "lidar", 4))],
    );
    for (names, is_read) in [
        ("r_0.mcap, r_1.mcap", true),
        ("gone.mcap, r_0.mcap", true),
        ("bag/r_0.mcap, bag/r_1.mcap", true),
        ("r_0.mcap, ../r_1.mcap", false),
        ("r_1.mcap, r_2.mcap", false),
    ] {
        let list = format!("rosbag2_bagfile_information:\n  relative_file_paths: [{names}]\n");
        fs::write(folder.path().join("metadata.yaml"), list).unwrap();
        if is_read {
            let log = open(folder.path());
            assert_eq!(log.frames().len(), 2);
            assert_says(&log.summary().notes.join("; "), &["names files that are not there", ".mcap`"]);
            let outline = outline_log(folder.path(), &LogOptions::default()).unwrap();
            assert_says(&outline.notes().join("; "), &["names files that are not there"]);
        } else {
            assert_says(&open_error(folder.path(), &LogOptions::default()), &["that it names is not there"]);
        }
    }
}

/// Files that rosbag2 packed, unpacked beside its metadata or not, and packed ones alone.
#[test]
fn packed_bags_are_read_where_they_are_unpacked_else_refused_with_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_messages(&at("a.mcap"), &[POINTS], &[(0, scan(0, "lidar", 4))]);
    write_messages(&at("b.mcap"), &[POINTS], &[(0, scan(1, "lidar", 4))]);
    database(&at("c.db3"), 4096, 1).close().unwrap();
    let packed = |name: &str| zstd::encode_all(&fs::read(at(name)).unwrap()[..], 3).unwrap();
    for (k, (mode, files, scans)) in [
        ("FILE", "a.mcap.zstd", Ok(1)),
        ("file", "a.mcap.zstd, b.mcap.zstd", Ok(2)),
        ("FILE", "bag/a.mcap.zstd, b.mcap", Ok(2)),
        ("FILE", "c.db3.zstd", Ok(1)),
        ("FILE", "a.mcap.zstd, gone.mcap.zstd", Err("`zstd -d gone.mcap.zstd`")),
        ("FILE", "gone.mcap.zstd, a.mcap.zstd", Err("`zstd -d gone.mcap.zstd`")),
        ("FILE", "../a.mcap.zstd, ../../gone.mcap.zstd", Err("`ros2 bag convert`")),
        ("MESSAGE", "a.mcap", Err("compression_mode MESSAGE): unpack it with `ros2 bag convert`")),
    ]
    .into_iter()
    .enumerate()
    {
        let bag = at(&format!("bag{k}"));
        fs::create_dir(&bag).unwrap();
        for name in ["a.mcap", "b.mcap", "c.db3"] {
            fs::copy(at(name), bag.join(name)).unwrap();
        }
        let metadata = format!(
            "rosbag2_bagfile_information:\n  compression_format: zstd\n  compression_mode: {mode}\n  \
             relative_file_paths: [{files}]\n"
        );
        fs::write(bag.join("metadata.yaml"), metadata).unwrap();
        match scans {
            Ok(scans) => assert_eq!(read_all(&*open(&bag)).len(), scans, "{mode} {files}"),
            Err(words) => assert_says(&open_error(&bag, &LogOptions::default()), &[words]),
        }
    }
    for name in ["a.mcap", "c.db3"] {
        let alone = at(&format!("{name}.zstd"));
        fs::write(&alone, packed(name)).unwrap();
        assert_says(&open_error(&alone, &LogOptions::default()), &["packed with zstd", "`zstd -d FILE`"]);
    }
}
