use crate::common::{
    F32, F64, Message, POINTS, U32, assert_says, open, open_error, read_all, write_messages, write_with,
};
use dmp_log::{LogOptions, open_log, survey_log};
use std::path::PathBuf;

const POINTS_M: [[f32; 3]; 4] = [[1.5, -2.25, 0.125], [f32::NAN, 0.0, 1.0], [0.0; 3], [80.0, 3.0, -1.0]];

fn same(a: &[[f32; 3]], b: &[[f32; 3]]) -> bool {
    a.len() == b.len() && a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits())
}

fn log_of(folder: &tempfile::TempDir, messages: &[Message]) -> PathBuf {
    let path = folder.path().join("log.mcap");
    let messages: Vec<_> = messages.iter().map(|message| (0, message.encode())).collect();
    write_messages(&path, &[POINTS], &messages);
    path
}

#[test]
fn every_layout_gives_the_same_points() {
    let folder = tempfile::tempdir().unwrap();
    let plain = Message::of(&POINTS_M);
    let big_cdr = Message { big_endian_cdr: true, ..plain.clone() };
    let big_data = Message {
        big_endian_data: true,
        data: POINTS_M.iter().flatten().flat_map(|c| c.to_be_bytes()).collect(),
        ..plain.clone()
    };
    // Two rows of two points of 20 bytes, and 5 bytes of padding behind each row.
    let mut organised = Message {
        height: 2,
        width: 2,
        fields: vec![("z", 12, F32), ("ring", 0, 4), ("y", 8, F32), ("x", 4, F32), ("odd", 16, 99)],
        point_step: 20,
        row_step: 45,
        data: Vec::new(),
        ..plain.clone()
    };
    for row in POINTS_M.chunks(2) {
        for [x, y, z] in row {
            organised.data.extend([7, 7, 0, 0]);
            organised.data.extend([*x, *y, *z].iter().flat_map(|c| c.to_le_bytes()));
            organised.data.extend([9; 4]);
        }
        organised.data.extend([0xee; 5]);
    }
    // The padding behind the last row may be missing.
    organised.data.truncate(organised.data.len() - 5);
    let doubles = Message {
        fields: vec![("x", 0, F64), ("y", 8, F64), ("z", 16, F64)],
        point_step: 24,
        row_step: 0,
        data: POINTS_M.iter().flatten().flat_map(|&c| f64::from(c).to_le_bytes()).collect(),
        ..plain.clone()
    };
    let all = [plain, big_cdr, big_data, organised, doubles];
    for message in &all {
        let log = open(&log_of(&folder, std::slice::from_ref(message)));
        assert!(same(&read_all(&*log)[0].points_in_sensor_m, &POINTS_M), "{message:?}");
        assert_eq!(log.summary().damage, []);
    }
    // And all in one log.
    let log = open(&log_of(&folder, &all));
    assert!(read_all(&*log).iter().all(|scan| same(&scan.points_in_sensor_m, &POINTS_M)));
}

#[test]
fn broken_messages_are_skipped_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let good = Message::of(&POINTS_M);
    let with = |change: &dyn Fn(&mut Message)| {
        let mut message = good.clone();
        change(&mut message);
        message.encode()
    };
    let mut cut = good.encode();
    cut.truncate(cut.len() - 10);
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (with(&|m| m.point_step = 0), "point_step is 0"),
        (with(&|m| m.point_step = 8), "field `z` ends at byte 12 of a point of 8 bytes"),
        (with(&|m| m.width = u32::MAX), "1 rows of 4,294,967,295 points of 12 bytes do not fit in 48 bytes"),
        (
            with(&|m| (m.width, m.height) = (u32::MAX, u32::MAX)),
            "row_step is 48, less than 4,294,967,295 points",
        ),
        (with(&|m| (m.height, m.row_step) = (u32::MAX, u32::MAX)), "4,294,967,295 rows of 4 points"),
        (with(&|m| m.fields[2].0 = "w"), "no field `z` among [x, y, w]"),
        (with(&|m| m.fields[0].2 = U32), "field `x` is uint32, not float32"),
        (with(&|m| m.fields[0].2 = 42), "field `x` has the unknown type 42"),
        (with(&|m| m.fields[1].1 = u32::MAX), "field `y` ends at byte 4294967299"),
        (cut, "data takes 48 bytes, the message has"),
        (vec![], "starts with []"),
        (vec![0, 9, 0, 0, 1], "starts with [00, 09, 00, 00]"),
    ];
    for (broken, why) in cases {
        let path = folder.path().join("log.mcap");
        write_messages(&path, &[POINTS], &[(0, good.encode()), (0, broken), (0, good.encode())]);
        let log = open(&path);
        assert_eq!(log.frames().len(), 2, "{why}");
        assert!(read_all(&*log).iter().all(|scan| same(&scan.points_in_sensor_m, &POINTS_M)));
        let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
        assert_says(&damage.place, &["message 1", "byte"]);
        assert_says(&damage.what, &[why, "skipped"]);
    }
}

#[test]
fn a_message_of_zeros_in_the_nanoseconds_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let mut message = Message::of(&POINTS_M).encode();
    message[8..12].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
    let path = folder.path().join("log.mcap");
    write_messages(&path, &[POINTS], &[(0, message)]);
    let error = open_error(&path, &LogOptions::default());
    assert_says(&error, &["log.mcap", "/points", "no scan", "message 0", "1000000000 nanoseconds"]);
}

#[test]
fn empty_clouds_need_no_layout() {
    let folder = tempfile::tempdir().unwrap();
    let empty = Message { fields: vec![], point_step: 0, row_step: 0, ..Message::of(&[]) };
    let flat = Message { height: 0, width: 1000, ..Message::of(&[]) };
    let log = open(&log_of(&folder, &[empty, flat, Message::of(&POINTS_M)]));
    let read = read_all(&*log);
    assert_eq!(read.iter().map(dmp_sensor::Scan::len).collect::<Vec<_>>(), [0, 0, 4]);
    assert_eq!(log.summary().point_bytes, 12);
    assert_eq!(log.summary().damage, []);
}

#[test]
fn topics_are_chosen_or_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let cloud = Message::of(&POINTS_M).encode();
    let left = ("/left", POINTS.1, "cdr");
    let imu = ("/imu", "sensor_msgs/msg/Imu", "cdr");
    let other = ("/other", "sensor_msgs/PointCloud2", "json");
    let two = [(0, cloud.clone()), (1, cloud.clone()), (1, cloud.clone()), (2, vec![1]), (3, cloud.clone())];
    write_messages(&path, &[POINTS, left, imu, other], &two);

    let error = open_log(&path, &LogOptions::default()).unwrap_err();
    assert!(error.is_usage());
    let text = error.to_string();
    assert_says(
        &text,
        &["log.mcap", "`topic`", "/left [sensor_msgs/msg/PointCloud2 (cdr), 2 messages]", "/points"],
    );
    assert!(!text.contains("/imu") && !text.contains("/other"), "{text}");

    let options = |topic: &str| LogOptions { topic: Some(topic.into()), ..LogOptions::default() };
    assert_eq!(open_log(&path, &options("/left")).unwrap().frames().len(), 2);
    for missing in ["/right", "/imu", "/other"] {
        let error = open_log(&path, &options(missing)).unwrap_err();
        assert!(error.is_usage());
        assert_says(
            &error.to_string(),
            &["log.mcap", &format!("`{missing}`"), "/imu [sensor_msgs/msg/Imu (cdr)", "(json)"],
        );
    }

    write_messages(&path, &[imu], &[(0, vec![1])]);
    let error = open_log(&path, &LogOptions::default()).unwrap_err();
    assert!(!error.is_usage());
    assert_says(
        &error.to_string(),
        &["log.mcap", "PointCloud2", "/imu [sensor_msgs/msg/Imu (cdr), 1 messages]"],
    );

    write_messages(&path, &[POINTS, imu], &[(0, cloud), (1, vec![])]);
    let log = open(&path);
    assert_says(&log.summary().notes.join("; "), &["/points", "only one"]);
    assert_eq!(log.summary().topics.len(), 2);
}

/// As many topics as a file has room for: its chunks are unpacked twice, whatever their number.
#[test]
fn thousands_of_topics_are_listed_in_one_pass() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let names: Vec<String> = (0..3_000).map(|k| format!("/lidar_{k:04}/points")).collect();
    let channels: Vec<_> = names.iter().map(|name| (name.as_str(), POINTS.1, POINTS.2)).collect();
    let mut message = Message::of(&POINTS_M);
    message.fields = vec![("x", 0, F32), ("y", 4, F32), ("t", 8, U32), ("z", 8, F32)];
    let body = message.encode();
    // Each topic has scans from one end of the file to the other.
    let messages: Vec<_> = (0..4).flat_map(|_| (0..names.len()).map(|topic| (topic, body.clone()))).collect();
    write_with(&path, mcap::WriteOptions::new().chunk_size(Some(1 << 16)), &channels, &messages);
    let survey = survey_log(&path, &LogOptions::default()).unwrap();
    assert_eq!((survey.topics.len(), survey.streams.len()), (3_000, 3_000));
    for stream in &survey.streams {
        let log = stream.log.as_ref().unwrap();
        assert_eq!((log.frames().len(), log.summary().topics.len()), (4, 3_000));
    }
    let bytes_read = survey.streams[0].log.as_ref().unwrap().bytes_read().unwrap();
    assert!(bytes_read < 3 * survey.bytes, "{bytes_read} of {}", survey.bytes);
}
