//! Places and times are those that the crate `laz` decodes, to the bit.

use super::ahead::pool;
use super::files::{Made, Random, check, decode, decode_by_laz, wanted};
use crate::geometry::laz::reader::LazReader;
use laz::LazItemRecordBuilder;
use laz::las::{Point0, Point1, Point2, Point3, Point6, Point7, Point8};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Compares both decoders, and with what was written.
fn compare(made: &Made, what: &str) {
    let file = made.file();
    let ours = decode(&file).unwrap_or_else(|problem| panic!("{what}: {problem}"));
    assert_eq!(ours.len(), made.records.len(), "{what}");
    let record_bytes = made.record_bytes.into();
    let theirs = decode_by_laz(&file);
    let all =
        ours.chunks(record_bytes).zip(theirs.chunks(record_bytes)).zip(made.records.chunks(record_bytes));
    for (k, ((ours, theirs), written)) in all.enumerate() {
        let [ours, theirs, written] = [ours, theirs, written].map(|record| wanted(made.format, record));
        assert_eq!(ours, theirs, "{what}: point {k}");
        assert_eq!(ours, written, "{what}: point {k}");
    }
}

#[test]
fn random_points_of_every_format_are_decoded() {
    for format in 0..=8 {
        for (extra, points) in [(0, 1), (0, 2), (5, 1001), (0, 12_345)] {
            let mut made = Made::new(format, extra, points, 1 + u64::from(format) * 31 + points as u64);
            compare(&made, &format!("format {format}, {extra} extra bytes, {points} points"));
            made.chunk = None;
            compare(&made, &format!("format {format}, chunks of different lengths"));
            made.chunk = Some(50_000);
            compare(&made, &format!("format {format}, one chunk"));
        }
    }
}

#[test]
fn other_versions_are_decoded() {
    let items = [
        (0, LazItemRecordBuilder::version_1_of::<Point0>(0)),
        (1, LazItemRecordBuilder::version_1_of::<Point1>(0)),
        (2, LazItemRecordBuilder::version_1_of::<Point2>(0)),
        (3, LazItemRecordBuilder::version_1_of::<Point3>(0)),
        (6, LazItemRecordBuilder::version_4_of::<Point6>(0)),
        (7, LazItemRecordBuilder::version_4_of::<Point7>(0)),
        (8, LazItemRecordBuilder::version_4_of::<Point8>(0)),
    ];
    for (format, items) in items {
        let mut made = Made { items, ..Made::new(format, 0, 12_345, 99) };
        // The encoder of version 1 cannot have two coordinates 2^31 apart.
        for record in made.records.chunks_mut(made.record_bytes.into()) {
            for coordinate in record[..12].chunks_mut(4) {
                let step = i32::from_le_bytes(coordinate.try_into().unwrap()) >> 1;
                coordinate.copy_from_slice(&step.to_le_bytes());
            }
            // Nor the upper byte of blue: it takes green's model for it, and its decoder does not.
            if let Some(upper_blue) =
                [None, None, Some(25), Some(33)].get(usize::from(format)).copied().flatten()
            {
                record[upper_blue] = 0;
            }
        }
        compare(&made, &format!("format {format} in another version"));
    }
}

/// The oldest files have no chunks and no table: one stream from the first point on.
#[test]
fn points_without_chunks_are_decoded() {
    let made = Made { chunk: Some(50_000), ..Made::new(3, 0, 4000, 5) };
    let file = made.file();
    let data_at = check(&file).unwrap().data_at as usize;
    let table_at = u64::from_le_bytes(file[data_at..data_at + 8].try_into().unwrap()) as usize;
    let mut whole = file[..data_at].to_vec();
    whole[375 + 54..375 + 56].copy_from_slice(&1_u16.to_le_bytes());
    whole.extend(&file[data_at + 8..table_at]);
    let (ours, theirs) = (decode(&whole).unwrap(), decode_by_laz(&file));
    for (ours, theirs) in ours.chunks(34).zip(theirs.chunks(34)) {
        assert_eq!(wanted(3, ours), wanted(3, theirs));
    }
}

/// A writer that could not go back leaves the offset to the table at the end of the file.
#[test]
fn the_table_is_found_from_the_end_and_is_missed_where_there_is_none() {
    let mut file = Made::new(6, 0, 4000, 5).file();
    let expected = decode(&file).unwrap();
    let data_at = check(&file).unwrap().data_at as usize;
    let offset: [u8; 8] = file[data_at..data_at + 8].try_into().unwrap();
    file[data_at..data_at + 8].fill(0xff);
    file.extend(offset);
    assert_eq!(decode(&file).unwrap(), expected);
    let end = file.len() - 8;
    file[end..].fill(0xff);
    assert!(decode(&file).unwrap_err().contains("is the file cut?"));
}

#[test]
fn points_are_found_in_any_order() {
    for (format, chunk) in [(1, Some(1000)), (6, Some(1000)), (3, None), (7, None)] {
        let made = Made { chunk, ..Made::new(format, 0, 10_000, 8) };
        let file = made.file();
        let expected = decode(&file).unwrap();
        let layout = check(&file).unwrap().laz.unwrap();
        let record_bytes = usize::from(made.record_bytes);
        for is_ahead in [false, true] {
            pool(2).install(|| {
                let mut reader = LazReader::new(Cursor::new(&file), layout.clone());
                if is_ahead {
                    reader.go_ahead();
                }
                let mut random = Random(4);
                for _ in 0..300 {
                    let first = random.below(10_000) as usize;
                    let count = (random.below(1500) as usize + 1).min(10_000 - first);
                    let mut records = vec![0; count * record_bytes];
                    reader.seek(first as u64);
                    reader.read(&mut records).unwrap();
                    assert_eq!(records[..], expected[first * record_bytes..(first + count) * record_bytes]);
                }
                reader.seek(10_000);
                let beyond = reader.read(&mut vec![0; record_bytes]).unwrap_err().to_string();
                assert!(beyond.contains("no point 10000"), "{beyond}");
            });
        }
    }
}

/// What is not read is refused in words.
#[test]
fn extra_bytes_of_version_1_are_refused() {
    let mut file = Made::new(1, 3, 100, 5).file();
    let last_version = 375 + 54 + 34 + 2 * 6 + 4;
    file[last_version..last_version + 2].copy_from_slice(&1_u16.to_le_bytes());
    let problem = decode(&file).unwrap_err();
    assert!(problem.contains("type 0 in version 1 is not read: rewrite the file with las2las"), "{problem}");
}

fn laz_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|extension| extension == "laz")).collect();
    files.sort();
    files
}

/// Files written by other software, and with `DMP_DATA` recordings.
#[test]
fn real_files_are_decoded() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = laz_files(&package.join("../../tests/conformance/clouds"));
    files.extend(laz_files(&package.join("tests/data")));
    assert!(files.len() > 10);
    match std::env::var_os("DMP_DATA") {
        Some(folder) => files.extend(laz_files(&package.join("../..").join(folder).join("las_maps"))),
        None => println!("skipped las_maps: DMP_DATA does not say where the recordings are"),
    }
    for path in files {
        let file = std::fs::read(&path).unwrap();
        let header = check(&file).unwrap();
        let record_bytes = header.record_bytes.into();
        let (ours, theirs) = (decode(&file).unwrap(), decode_by_laz(&file));
        assert_eq!(ours.len(), theirs.len());
        for (ours, theirs) in ours.chunks(record_bytes).zip(theirs.chunks(record_bytes)) {
            assert_eq!(wanted(header.format, ours), wanted(header.format, theirs), "{}", path.display());
        }
        println!("{}: format {}, {} points", path.display(), header.format, header.points);
    }
}
