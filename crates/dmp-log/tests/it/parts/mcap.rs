//! Parts of MCAP files.

use super::{assert_parts, scans_of};
use crate::common::{
    Message, POINTS, Random, STAMP_NS, assert_says, scan, scans, write_mcap, write_messages, write_timed,
};
use crate::topics::{TF_STATIC, transforms};
use dmp_log::{
    LogOptions, McapCompression, McapScanWriter, McapWriterOptions, PointTime, StampAt, open_log, outline_log,
};
use dmp_sensor::{Isometry3, Scan, Vector3};
use std::fs;
use std::path::Path;

const PERIOD_NS: i64 = 100_000_000;

fn write_chunks(path: &Path, scans: impl Iterator<Item = Scan>, chunk_bytes: u64) {
    let compression = McapCompression::None;
    let options = McapWriterOptions { compression, chunk_bytes, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(path, &options).unwrap();
    scans.for_each(|scan| writer.write_scan(&scan).unwrap());
    writer.finish().unwrap();
}

/// A cloud of four points.
fn message(stamp_ns: i64) -> Vec<u8> {
    Message { stamp_ns, ..Message::of(&[[1.0, 2.0, 3.0]; 4]) }.encode()
}

fn plain() -> mcap::WriteOptions {
    mcap::WriteOptions::new().chunk_size(Some(2000))
}

#[test]
fn parts_are_the_same_scans() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    for compression in [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None] {
        for (count, with_times) in [(1, true), (2, false), (3, true), (5, true), (40, true), (131, false)] {
            let mut written = scans(count, 150, with_times);
            if count > 20 {
                written[17] = scan(17, 0, false);
            }
            write_mcap(&path, &written, compression);
            let outline = assert_parts(&path, &LogOptions::default());
            assert_eq!(outline.stamp_error_ns(), 0);
        }
    }
    for stamp_at in [StampAt::Start, StampAt::Mid, StampAt::End] {
        write_mcap(&path, &scans(60, 100, true), McapCompression::Lz4);
        assert_parts(&path, &LogOptions { stamp_at, ..LogOptions::default() });
    }
    assert_parts(&path, &LogOptions { point_time: PointTime::Ignore, ..LogOptions::default() });
}

/// Of a file of 100 MB 5 % of the scans: what is read of it.
#[test]
fn a_part_is_read_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    write_chunks(&path, (0..1000).map(|k| scan(k, 8000, false)), 200_000);
    let file_bytes = fs::metadata(&path).unwrap().len();
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    assert_eq!(outline.bytes(), file_bytes);
    let to_outline = outline.bytes_read().unwrap();
    assert!(to_outline < file_bytes / 20, "{to_outline} of {file_bytes}");

    let wanted: Vec<usize> = (300..325).chain(700..725).collect();
    let groups: std::collections::BTreeMap<u32, u64> =
        wanted.iter().map(|&number| (outline.scans()[number].group, outline.scans()[number].bytes)).collect();
    let in_groups: u64 = groups.values().sum();
    let part = outline.open(&wanted).unwrap();
    let to_open = part.bytes_read().unwrap() - to_outline;
    // A buffer for each chunk beside it.
    assert!((in_groups..in_groups + 8192 * groups.len() as u64).contains(&to_open), "{to_open} {in_groups}");
    assert!(to_outline + to_open < file_bytes / 10, "{to_outline} {to_open} of {file_bytes}");
    scans_of(&*part);
    let to_read = part.bytes_read().unwrap() - to_open - to_outline;
    assert!((in_groups..in_groups + 8192 * groups.len() as u64).contains(&to_read), "{to_read} {in_groups}");
    assert_eq!(outline.bytes_read(), part.bytes_read());

    let whole = open_log(&path, &LogOptions::default()).unwrap();
    let to_open = whole.bytes_read().unwrap();
    assert!((file_bytes..file_bytes + file_bytes / 50).contains(&to_open), "{to_open} of {file_bytes}");
}

/// The time a scan was recorded is not its stamp: later by what it takes to come, more or less.
#[test]
fn stamps_are_found_from_the_times_of_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut random = Random(7);
    let late_ns: Vec<i64> = (0..200).map(|_| 123_000_000 + (random.next() % 2_000_001) as i64).collect();
    let stamp_ns = |k: i64| STAMP_NS + k * PERIOD_NS + if k >= 90 { 60_000_000_000 } else { 0 };
    let messages: Vec<_> = (0..200).map(|k| message(stamp_ns(k))).collect();
    let timed: Vec<_> =
        (0..200).map(|k| (0, (stamp_ns(k as i64) + late_ns[k]) as u64, messages[k].as_slice())).collect();
    write_timed(&path, plain(), &[POINTS], &timed);
    let outline = assert_parts(&path, &LogOptions::default());
    assert!((1..=2_000_000).contains(&outline.stamp_error_ns()), "{}", outline.stamp_error_ns());
    for (k, scan) in outline.scans().iter().enumerate() {
        assert!(scan.stamp_ns.unwrap().abs_diff(stamp_ns(k as i64)) <= 2_000_000, "{k}");
    }
    // Ten scans far apart are still of a log at 10 Hz.
    let part = outline.open(&[0, 20, 40, 60, 80, 100, 120, 140, 160, 180]).unwrap();
    let period_ns = part.summary().period_ns.unwrap();
    assert!(period_ns.abs_diff(PERIOD_NS) < 500_000, "{period_ns}");
    assert_eq!(outline.period_ns(), Some(period_ns));
}

/// Recorded at times that mean nothing, scans have the stamps and the times of points that they have.
#[test]
fn times_of_recording_that_mean_nothing_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let of = |k: i64| {
        let mut message = Message::of(&[[1.0, 2.0, 3.0]; 3]);
        message.fields.push(("t", 12, crate::common::U32));
        message.point_step = 16;
        message.row_step = 48;
        message.stamp_ns = STAMP_NS + k * PERIOD_NS;
        let rows = [0_u32, 50_000_000, 99_000_000].map(|ns| {
            let place: Vec<u8> = [1.0_f32, 2.0, 3.0].iter().flat_map(|c| c.to_le_bytes()).collect();
            [place, ns.to_le_bytes().to_vec()].concat()
        });
        message.data = rows.concat();
        message.encode()
    };
    for log_time_ns in [0, u64::MAX, 1 << 60] {
        let messages: Vec<_> = (0..120).map(of).collect();
        let timed: Vec<_> = messages.iter().map(|data| (0, log_time_ns, data.as_slice())).collect();
        write_timed(&path, plain(), &[POINTS], &timed);
        let outline = assert_parts(&path, &LogOptions::default());
        assert_eq!(outline.period_ns(), Some(PERIOD_NS));
        assert!(outline.stamp_error_ns() > 1_000_000_000 || log_time_ns == u64::MAX);
    }
}

/// Without a summary, without a checksum of it, without chunks, without message indexes, with and without
/// other topics between.
#[test]
fn files_are_written_in_many_ways() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let imu = ("/imu", "sensor_msgs/msg/Imu", "cdr");
    let clouds: Vec<_> = (0..90).map(|k| message(STAMP_NS + k * PERIOD_NS)).collect();
    let other = vec![7; 700];
    let mut timed = Vec::new();
    for (k, cloud) in clouds.iter().enumerate() {
        let time_ns = (STAMP_NS + k as i64 * PERIOD_NS) as u64;
        timed.extend([(0, time_ns, cloud.as_slice()), (1, time_ns, &other), (1, time_ns + 1, &other)]);
    }
    let no_index = "90 chunks have no message index";
    let cases = [
        (plain(), ""),
        (plain().emit_summary_records(false).emit_summary_offsets(false), "1 chunks were read to learn"),
        (plain().calculate_summary_section_crc(false), "1 chunks were read to learn"),
        (plain().calculate_chunk_crcs(false), ""),
        (plain().repeat_channels(false).repeat_schemas(false), ""),
        (plain().emit_chunk_indexes(false), ""),
        (plain().compression(None), ""),
        (plain().emit_message_indexes(false), no_index),
        (plain().use_chunks(false), "lie outside chunks"),
        (plain().use_chunks(false).emit_summary_records(false), "lie outside chunks"),
    ];
    for (number, (options, note)) in cases.into_iter().enumerate() {
        write_timed(&path, options, &[POINTS, imu], &timed);
        let outline = assert_parts(&path, &LogOptions::default());
        let notes = outline.notes().join("; ");
        if note == no_index {
            assert_says(&notes, &["chunks have no message index and were read", "mcap recover"]);
        } else {
            assert!(
                !notes.contains("no message index") && !notes.contains("in no index"),
                "case {number}: {notes}"
            );
            assert_says(&notes, &[note]);
        }
    }
}

#[test]
fn frames_that_do_not_move_are_found_for_every_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let frame = |child: &str| {
        let pose = Isometry3::new(Vector3::new(0.3, 0.0, 1.0), Vector3::new(0.0, 0.1, 0.0));
        transforms(&[(0, "base_link", child, pose)])
    };
    let mut messages = vec![(1, frame("lidar"))];
    messages.extend((0..60).map(|k| (0, message(STAMP_NS + k * PERIOD_NS))));
    messages.insert(40, (1, frame("imu")));
    write_messages(&path, &[POINTS, TF_STATIC], &messages);
    let outline = assert_parts(&path, &LogOptions::default());
    let part = outline.open(&[5]).unwrap();
    assert_eq!(part.static_frames().beside("lidar"), ["base_link", "imu"]);
    assert_eq!(part.summary().topics[1].messages, 2);

    // Sent again and again, they are not worth reading a log for.
    let many: Vec<_> =
        (0..2000).flat_map(|k| [(0, message(STAMP_NS + k * PERIOD_NS)), (1, frame("lidar"))]).collect();
    write_messages(&path, &[POINTS, TF_STATIC], &many);
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    assert_says(&outline.notes().join("; "), &["/tf_static: the first ", " of 2,000 messages are read"]);
    assert_eq!(outline.open(&[1999]).unwrap().static_frames().beside("lidar"), ["base_link"]);
}

/// What is wrong with a log or with what is asked of it is said in the same words.
#[test]
fn errors_are_those_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let left = ("/left", POINTS.1, "cdr");
    let imu = ("/imu", "sensor_msgs/msg/Imu", "cdr");
    let same = |options: &LogOptions, parts: &[&str]| {
        let whole = open_log(&path, options).unwrap_err();
        let outline = outline_log(&path, options).unwrap_err();
        assert_eq!((outline.to_string(), outline.is_usage()), (whole.to_string(), whole.is_usage()));
        assert_says(&outline.to_string(), parts);
    };
    let named = |topic: &str| LogOptions { topic: Some(topic.into()), ..LogOptions::default() };
    let two = [(0, message(STAMP_NS)), (1, message(STAMP_NS)), (1, message(STAMP_NS)), (2, vec![1])];
    write_messages(&path, &[POINTS, left, imu], &two);
    same(&LogOptions::default(), &["several topics", "/left", "2 messages"]);
    same(&named("/right"), &["`/right`", "/imu"]);
    same(&named("/imu"), &["`/imu`"]);
    write_messages(&path, &[imu], &[(0, vec![1])]);
    same(&LogOptions::default(), &["no topic with", "/imu"]);
    write_messages(&path, &[POINTS], &[]);
    same(&LogOptions::default(), &["/points has no scan"]);
    write_messages(&path, &[POINTS], &[(0, vec![9; 100])]);
    same(&LogOptions::default(), &["/points has no scan", "message 0"]);
    fs::write(&path, mcap::MAGIC).unwrap();
    same(&LogOptions::default(), &["no scan can be read", "byte 8"]);
    fs::write(&path, "no log").unwrap();
    same(&LogOptions::default(), &["not a format known here"]);
    fs::remove_file(&path).unwrap();
    same(&LogOptions::default(), &["no such file"]);
}

#[test]
fn what_is_no_part_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    write_mcap(&path, &scans(30, 50, false), McapCompression::Zstd);
    let outline = outline_log(&path, &LogOptions::default()).unwrap();
    let cases: [(&[usize], &str); 4] = [
        (&[], "no scan was asked for"),
        (&[3, 3], "scan 3 was asked for behind scan 3"),
        (&[3, 2], "scan 2 was asked for behind scan 3"),
        (&[3, 30], "scan 30 was asked for, the log has 30"),
    ];
    for (wanted, problem) in cases {
        assert_says(&outline.open(wanted).unwrap_err().to_string(), &["log.mcap", problem]);
    }
    let part = outline.open(&[3, 9]).unwrap();
    let error = part.reader().unwrap().read(2, &mut Scan::default()).unwrap_err();
    assert_says(&error.to_string(), &["log.mcap", "frame 2"]);
    // Another file under the same name.
    write_mcap(&path, &scans(31, 50, false), McapCompression::Zstd);
    assert_says(&outline.open(&[3]).unwrap_err().to_string(), &["log.mcap", "has changed", "bytes then"]);
}
