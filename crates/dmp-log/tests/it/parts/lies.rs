//! Indexes that do not say what is there.

use super::{bits, scans_of};
use crate::common::{STAMP_NS, assert_says, chunks, scans, write_mcap};
use dmp_log::{LogOptions, McapCompression, ScanLog, open_log, outline_log};
use std::fs;

/// The record of the message index behind the chunk that ends at `end`: channel, claimed length, entries of time
/// and place.
struct Index {
    at: usize,
    entries: Vec<(u64, u64)>,
}

impl Index {
    fn behind(bytes: &[u8], end: usize) -> Self {
        assert_eq!(bytes[end], mcap::records::op::MESSAGE_INDEX);
        let length = u32::from_le_bytes(bytes[end + 11..end + 15].try_into().unwrap()) as usize;
        let word = |word: &[u8]| u64::from_le_bytes(word.try_into().unwrap());
        let entries = bytes[end + 15..end + 15 + length].chunks(16);
        Self { at: end, entries: entries.map(|entry| (word(&entry[..8]), word(&entry[8..]))).collect() }
    }

    fn write(&self, bytes: &mut [u8]) {
        for (k, (time, place)) in self.entries.iter().enumerate() {
            let at = self.at + 15 + 16 * k;
            bytes[at..at + 8].copy_from_slice(&time.to_le_bytes());
            bytes[at + 8..at + 16].copy_from_slice(&place.to_le_bytes());
        }
    }
}

/// A change of a file's bytes at an index of one of its chunks.
type Lie<'a> = &'a dyn Fn(&mut Vec<u8>, Index);

#[test]
fn an_index_that_lies_is_found_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let written = scans(150, 300, true);
    write_mcap(&path, &written, McapCompression::Zstd);
    let good = fs::read(&path).unwrap();
    let whole = open_log(&path, &LogOptions::default()).unwrap();
    let (chunk, group) = (20, whole.groups()[20].clone());
    let end = chunks(&good)[chunk].end;
    let first = group.start;
    let open = |change: Lie<'_>| {
        let mut bytes = good.clone();
        change(&mut bytes, Index::behind(&good, end));
        fs::write(&path, &bytes).unwrap();
        let outline = outline_log(&path, &LogOptions::default()).unwrap();
        let numbers: Vec<usize> = (0..outline.scans().len()).collect();
        let part = outline.open(&numbers).unwrap();
        // Whatever it says, no scan is a wrong one.
        for (frame, scan) in scans_of(&*part).iter().enumerate() {
            let number = ((scan.stamp_ns.unwrap() - STAMP_NS) / 100_000_000) as usize;
            assert!(bits(scan) == bits(&written[number]), "frame {frame}");
        }
        (outline, part)
    };
    let said = |part: &dyn ScanLog| {
        part.summary()
            .damage
            .iter()
            .map(|lost| format!("{}: {}", lost.place, lost.what))
            .collect::<Vec<_>>()
            .join("; ")
    };

    // Times: the scans have the stamps that they have, and the index is said to be wrong.
    for time in [0, u64::MAX, 12] {
        let (outline, part) = open(&|bytes, mut index| {
            index.entries[0].0 = time;
            index.write(bytes);
        });
        assert_eq!(part.frames(), whole.frames());
        assert_says(&said(&*part), &["message ", "the index has another time for it"]);
        assert!(outline.stamp_error_ns() < 1_000_000);
    }
    // Places within the chunk and beyond it where no scan begins.
    for place in [1, 77, 1 << 20, 1 << 28] {
        let (_, part) = open(&|bytes, mut index| {
            index.entries[0].1 = place;
            index.write(bytes);
        });
        assert_eq!(part.frames().len(), 149);
        let said = said(&*part);
        assert_says(
            &said,
            &["the index names a scan where there is none", "1 scans that the index does not name"],
        );
        assert!(said.starts_with("message "), "{said}");
    }
    // What cannot be an index is not used: the chunk is read.
    let cases: [Lie<'_>; 5] = [
        &|bytes, mut index| {
            index.entries[1].1 = index.entries[0].1;
            index.write(bytes);
        },
        &|bytes, mut index| {
            index.entries[0].1 = u64::MAX;
            index.write(bytes);
        },
        &|bytes, index| bytes[index.at + 11..index.at + 15].copy_from_slice(&u32::MAX.to_le_bytes()),
        &|bytes, index| bytes[index.at + 11..index.at + 15].copy_from_slice(&17_u32.to_le_bytes()),
        // Of another type, so that the chunk has none.
        &|bytes, index| bytes[index.at] = 0x80,
    ];
    for (number, case) in cases.into_iter().enumerate() {
        let (outline, part) = open(case);
        assert_eq!((part.frames(), said(&*part).as_str()), (whole.frames(), ""), "case {number}");
        assert_says(&outline.notes().join("; "), &["1 chunks have no message index"]);
    }
    // It names none, or fewer than there are.
    let (outline, part) = open(&|bytes, index| bytes[index.at + 11..index.at + 15].copy_from_slice(&[0; 4]));
    assert_eq!(part.frames().len(), 150 - group.len());
    let said_of_it = format!("{} messages that the summary counts are in no index", group.len());
    assert_says(&outline.notes().join("; "), &[&said_of_it]);
    let (_, part) =
        open(&|bytes, index| bytes[index.at + 11..index.at + 15].copy_from_slice(&16_u32.to_le_bytes()));
    assert_eq!(part.frames().len(), 150 - group.len() + 1);
    assert_says(&said(&*part), &["scans that the index does not name are skipped"]);
    // A channel that is nowhere described.
    let (outline, part) = open(&|bytes, index| bytes[index.at + 9..index.at + 11].copy_from_slice(&[9, 9]));
    assert_eq!(outline.scans().len(), 150 - group.len());
    assert_says(&said(&*part), &["channel 2313", "messages of a channel that is not described"]);
    // A scan of it by itself.
    let part = outline.open(&[first]).unwrap();
    assert_eq!(part.frames()[0].stamp_ns, Some(STAMP_NS + group.end as i64 * 100_000_000));
}
