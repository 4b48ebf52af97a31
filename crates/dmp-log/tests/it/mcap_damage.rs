use crate::common::{
    Message, POINTS, assert_says, open, open_error, read_all, scans, write_mcap, write_with,
};
use dmp_log::{LogOptions, McapCompression};
use std::fs;
use std::path::PathBuf;

const ALL: [McapCompression; 3] = [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None];

/// Where the chunks of a file are: start of the record, and its end.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 9 <= bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == mcap::records::op::CHUNK {
            found.push((at, at + 9 + length));
        }
        if bytes[at] == mcap::records::op::DATA_END {
            break;
        }
        at += 9 + length;
    }
    found
}

fn file(
    folder: &tempfile::TempDir,
    compression: McapCompression,
) -> (PathBuf, Vec<u8>, Vec<dmp_sensor::Scan>) {
    let path = folder.path().join("log.mcap");
    let written = scans(16, 300, true);
    write_mcap(&path, &written, compression);
    let bytes = fs::read(&path).unwrap();
    (path, bytes, written)
}

#[test]
fn a_file_cut_anywhere_keeps_the_whole_chunks_before_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    for compression in ALL {
        let (path, bytes, written) = file(&folder, compression);
        let whole = open(&path);
        let groups = whole.groups();
        let ends: Vec<usize> = chunks(&bytes).iter().map(|chunk| chunk.1).collect();
        assert_eq!(groups.len(), ends.len());
        let last = *ends.last().unwrap();
        let cuts =
            [ends[0], ends[0] + 1, ends[2] + 20, bytes.len() / 2, ends[3] - 1, last - 1, last, last + 5];
        for cut in cuts {
            fs::write(&path, &bytes[..cut]).unwrap();
            let kept = groups[ends.iter().filter(|&&end| end <= cut).count() - 1].end;
            let log = open(&path);
            assert!(read_all(&*log) == written[..kept], "{compression:?} cut at {cut}");
            let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
            assert_says(&damage.place, &["byte "]);
            assert_says(&damage.what, &[&format!("ends at byte {cut}"), "lost"]);
        }
        // Cut in the summary, no scan is lost, but the file is not whole.
        fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        let log = open(&path);
        assert!(read_all(&*log) == written);
        assert_says(&log.summary().damage[0].what, &["inside its summary", "no scan is lost"]);
        // Cut before the first whole chunk, there is nothing.
        fs::write(&path, &bytes[..ends[0] - 1]).unwrap();
        assert_says(&open_error(&path, &LogOptions::default()), &["log.mcap", "no scan can be read", "byte"]);
    }
}

#[test]
fn one_flipped_byte_costs_one_chunk() {
    let folder = tempfile::tempdir().unwrap();
    for compression in ALL {
        let (path, bytes, written) = file(&folder, compression);
        let groups = open(&path).groups();
        for (index, &(start, end)) in chunks(&bytes).iter().enumerate() {
            for at in [
                start + 9 + 16,
                start + 9 + 24,
                start + 9 + 32,
                start + 80,
                usize::midpoint(start, end),
                end - 20,
            ] {
                let mut flipped = bytes.clone();
                flipped[at] ^= 0x10;
                fs::write(&path, &flipped).unwrap();
                let log = open(&path);
                let mut expected = written.clone();
                expected.drain(groups[index].clone());
                assert!(read_all(&*log) == expected, "{compression:?} chunk {index} byte {at}");
                let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
                assert_eq!(damage.place, format!("byte {start}"));
                assert_says(&damage.what, &["chunk", "skipped"]);
            }
        }
    }
}

#[test]
fn a_broken_length_is_got_over_with_the_summary() {
    let folder = tempfile::tempdir().unwrap();
    let (path, bytes, written) = file(&folder, McapCompression::Zstd);
    let groups = open(&path).groups();
    let (start, _) = chunks(&bytes)[2];
    for length in [u64::MAX, 1 << 40, 30_000, 0] {
        let mut broken = bytes.clone();
        broken[start + 1..start + 9].copy_from_slice(&length.to_le_bytes());
        fs::write(&path, &broken).unwrap();
        let log = open(&path);
        let mut expected = written.clone();
        expected.drain(groups[2].clone());
        assert!(read_all(&*log) == expected, "{length}");
        assert_says(&log.summary().damage[0].place, &[&format!("byte {start}")]);
        // Without the summary the tail is lost, and said to be.
        broken.truncate(broken.len() - 8);
        fs::write(&path, &broken).unwrap();
        if length > bytes.len() as u64 {
            let log = open(&path);
            assert_eq!(read_all(&*log), written[..groups[1].end]);
            let what = log.summary().damage[0].what.replace(',', "");
            assert_says(&what, &[&length.to_string(), "the tail is lost"]);
        }
    }
}

#[test]
fn messages_outside_chunks_are_read_and_checked_by_the_data_crc() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let message = Message::of(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).encode();
    let messages: Vec<_> = (0..10).map(|_| (0, message.clone())).collect();
    write_with(&path, mcap::WriteOptions::new().use_chunks(false), &[POINTS], &messages);
    let log = open(&path);
    assert_eq!(read_all(&*log).len(), 10);
    assert_eq!(log.summary().damage, []);
    assert_eq!(log.groups(), [0..8, 8..10]);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.windows(4).position(|w| w == 5_f32.to_le_bytes()).unwrap();
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    let log = open(&path);
    assert_eq!(log.frames().len(), 10);
    assert_says(&log.summary().damage[0].what, &["CRC of the data"]);
}

#[test]
fn a_file_that_changes_after_opening_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mut bytes, _) = file(&folder, McapCompression::Zstd);
    let log = open(&path);
    let (start, end) = chunks(&bytes)[1];
    bytes[usize::midpoint(start, end)] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let frame = log.groups()[1].start;
    let error = log.reader().unwrap().read(frame, &mut dmp_sensor::Scan::default()).unwrap_err().to_string();
    assert_says(&error, &["log.mcap", &format!("frame {frame}"), &format!("byte {start}")]);
    fs::write(&path, &bytes[..100]).unwrap();
    let error = log.reader().unwrap().read(frame, &mut dmp_sensor::Scan::default()).unwrap_err().to_string();
    assert_says(&error, &["log.mcap", &format!("frame {frame}"), "shorter than it was"]);
}
