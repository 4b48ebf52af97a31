//! Damaged MCAP files in part.

use super::{bits, scans_of, sorted};
use crate::common::{Message, POINTS, STAMP_NS, assert_says, scan, write_mcap, write_messages};
use dmp_log::{LogOptions, McapCompression, PointTime, open_log, outline_log};
use dmp_sensor::Scan;
use std::fs;
use std::path::PathBuf;

const SCANS: usize = 150;

struct File {
    _folder: tempfile::TempDir,
    path: PathBuf,
    bytes: Vec<u8>,
    written: Vec<Scan>,
}

/// A file with two or three scans a chunk.
fn file(compression: McapCompression) -> File {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let written: Vec<Scan> = (0..SCANS).map(|k| scan(k, 300, true)).collect();
    write_mcap(&path, &written, compression);
    let bytes = fs::read(&path).unwrap();
    File { _folder: folder, path, bytes, written }
}

/// Where the chunks of a file are: start of the record and its end.
pub(super) fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 9 <= bytes.len() && bytes[at] != mcap::records::op::DATA_END {
        let end = at + 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == mcap::records::op::CHUNK {
            found.push((at, end));
        }
        at = end;
    }
    found
}

#[test]
fn a_damaged_chunk_costs_the_parts_that_need_it() {
    for compression in [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None] {
        let file = file(compression);
        let whole = open_log(&file.path, &LogOptions::default()).unwrap();
        let groups = whole.groups();
        let (chunk, lost) = (20, groups[20].clone());
        let (start, end) = chunks(&file.bytes)[chunk];
        let mut broken = file.bytes.clone();
        broken[usize::midpoint(start, end)] ^= 0x10;
        fs::write(&file.path, &broken).unwrap();

        let outline = outline_log(&file.path, &LogOptions::default()).unwrap();
        assert_eq!((outline.scans().len(), outline.damage()), (SCANS, [].as_slice()));
        let numbers = |part: &dyn dmp_log::ScanLog| -> Vec<usize> {
            (0..part.frames().len()).map(|frame| part.number_in_log(frame)).collect()
        };
        // Around it, with one of its scans, and with all scans.
        let outside = [lost.start - 1, lost.end, 100];
        let one = [3, lost.start, lost.end];
        for (wanted, is_damaged) in
            [(outside.to_vec(), false), (one.to_vec(), true), ((0..SCANS).collect::<Vec<_>>(), true)]
        {
            let part = outline.open(&wanted).unwrap();
            let kept: Vec<usize> = wanted.iter().copied().filter(|number| !lost.contains(number)).collect();
            assert_eq!(numbers(&*part), kept);
            assert_eq!(part.scans_in_log(), SCANS);
            let read = scans_of(&*part);
            assert!(read.iter().map(bits).eq(kept.iter().map(|&number| bits(&file.written[number]))));
            if is_damaged {
                let [damage] = part.summary().damage.as_slice() else {
                    panic!("{:?}", part.summary().damage)
                };
                assert_eq!(damage.place, format!("byte {start}"));
                assert_says(&damage.what, &["chunk", "skipped"]);
            } else {
                assert_eq!(part.summary().damage, []);
            }
        }
        // Nothing is left of a part in that chunk alone.
        let error = outline.open(&[lost.start]).unwrap_err().to_string();
        assert_says(&error, &["log.mcap", "no scan that can be read", &format!("byte {start}")]);
    }
}

#[test]
fn a_file_cut_anywhere_is_outlined_as_far_as_it_goes() {
    let file = file(McapCompression::Zstd);
    let chunks = chunks(&file.bytes);
    let (_, end) = chunks[10];
    let last = chunks.last().unwrap().1;
    let middle = file.bytes.len() / 2;
    // In a chunk, at its end, in the index behind it, in the summary.
    for cut in [chunks[0].1, end - 1, end, end + 5, end + 12, end + 30, middle, last, last + 40, last + 200] {
        fs::write(&file.path, &file.bytes[..cut]).unwrap();
        let whole = open_log(&file.path, &LogOptions::default()).unwrap();
        let outline = outline_log(&file.path, &LogOptions::default()).unwrap();
        assert_eq!(outline.scans().len(), whole.frames().len(), "cut at {cut}");
        let part = outline.open(&(0..outline.scans().len()).collect::<Vec<_>>()).unwrap();
        assert!(scans_of(&*part).iter().map(bits).eq(scans_of(&*whole).iter().map(bits)), "cut at {cut}");
        assert_eq!(sorted(&part.summary().damage), sorted(&whole.summary().damage), "cut at {cut}");
        assert_says(&part.summary().damage[0].what, &[&format!("ends at byte {cut}")]);
        assert_eq!(part.summary().topics, whole.summary().topics);
    }
    fs::write(&file.path, &file.bytes[..chunks[0].1 - 1]).unwrap();
    let errors = [
        open_log(&file.path, &LogOptions::default()).unwrap_err().to_string(),
        outline_log(&file.path, &LogOptions::default()).unwrap_err().to_string(),
    ];
    assert_eq!(errors[0], errors[1]);
}

/// Behind a chunk lies an index for each of its channels; where one is missing the chunk is read.
#[test]
fn a_file_cut_between_the_indexes_of_a_chunk_keeps_its_scans() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let imu = ("/imu", "sensor_msgs/msg/Imu", "cdr");
    let messages: Vec<_> = (0..60)
        .flat_map(|k| {
            let stamp_ns = STAMP_NS + k * 100_000_000;
            let cloud = Message { stamp_ns, ..Message::of(&[[1.0, 2.0, 3.0]; 20]) };
            [(0, vec![7; 100]), (1, cloud.encode())]
        })
        .collect();
    write_messages(&path, &[imu, POINTS], &messages);
    let bytes = fs::read(&path).unwrap();
    let chunks = chunks(&bytes);
    for cut in (chunks[7].1 - 1..=chunks[8].0 + 20).chain(chunks.last().unwrap().1..bytes.len()) {
        fs::write(&path, &bytes[..cut]).unwrap();
        let whole = open_log(&path, &LogOptions::default()).unwrap();
        let outline = outline_log(&path, &LogOptions::default()).unwrap();
        assert_eq!(outline.scans().len(), whole.frames().len(), "cut at {cut}");
        let part = outline.open(&(0..outline.scans().len()).collect::<Vec<_>>()).unwrap();
        assert_eq!(part.frames(), whole.frames(), "cut at {cut}");
        assert_eq!(part.summary().topics, whole.summary().topics, "cut at {cut}");
        assert_eq!(sorted(&part.summary().damage), sorted(&whole.summary().damage), "cut at {cut}");
    }
}

/// Every byte of the framing changed in turn: what is opened is what the whole log has there, and where it is
/// less than that the damage says so.
#[test]
fn no_broken_byte_of_the_framing_gives_a_wrong_scan() {
    let file = file(McapCompression::Lz4);
    let chunks = chunks(&file.bytes);
    // From the end of a chunk's data to the beginning of the next one's, and the summary.
    let (from, to) = (chunks[20].1 - 3, chunks[21].0 + 70);
    let options = LogOptions { point_time: PointTime::Ignore, ..LogOptions::default() };
    for at in (from..to).chain((chunks.last().unwrap().1..file.bytes.len()).step_by(61)) {
        for flip in [0x01, 0x80, 0xff] {
            let mut broken = file.bytes.clone();
            broken[at] ^= flip;
            fs::write(&file.path, &broken).unwrap();
            let whole = scans_of(&*open_log(&file.path, &options).unwrap());
            let outline = outline_log(&file.path, &options).unwrap();
            let part = outline.open(&(0..outline.scans().len()).collect::<Vec<_>>()).unwrap();
            let read = scans_of(&*part);
            let all: Vec<_> = whole.iter().map(bits).collect();
            assert!(read.iter().all(|scan| all.contains(&bits(scan))), "byte {at}, {flip:#x}");
            let is_less = read.len() < whole.len();
            assert!(!is_less || !part.summary().damage.is_empty(), "byte {at}, {flip:#x}");
            assert!(whole.len() - read.len() < 5, "byte {at}, {flip:#x}: {} of {}", read.len(), whole.len());
        }
    }
}
