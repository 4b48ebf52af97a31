//! What is opened or read in a pool of several threads is what is opened or read without one, damage and errors too.

use crate::common::{Message, POINTS, Random, read_all, scans, write_mcap, write_with};
use crate::las_log::WorldFile;
use dmp_log::{
    FolderFormat, FolderScanWriter, LogError, LogOptions, MadeWith, McapCompression, open_log, read_cloud,
};
use dmp_sensor::{Isometry3, Point3, Trajectory};
use std::path::{Path, PathBuf};

/// Does it without a pool and in pools of several sizes; all must come to the same.
#[track_caller]
fn same<R: Send + PartialEq + std::fmt::Debug>(work: impl Fn() -> R + Sync) -> R {
    let alone = work();
    for threads in [1, 2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(&work) == alone, "in {threads} threads");
    }
    alone
}

/// A log as far as it can be opened: what is told of it, and its scans.
fn told(path: &Path, options: &LogOptions) -> Result<String, String> {
    let log = open_log(path, options).map_err(|e| e.to_string())?;
    Ok(format!("{:?} {:?} {:?}", log.summary(), log.frames(), read_all(&*log)))
}

/// Points of a cloud and how reading ended.
fn cloud(path: &Path) -> (Vec<[f64; 3]>, Result<u64, String>) {
    let mut points_m = Vec::new();
    let read = read_cloud(path, None, |batch| {
        points_m.extend_from_slice(batch);
        Ok::<(), LogError>(())
    });
    (points_m, read.map(|summary| summary.points).map_err(|e| e.to_string()))
}

/// The files with scans of a folder that was written, in order.
fn scan_files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let mut files = entries(folder);
    let below: Vec<PathBuf> =
        files.iter().filter(|file| file.is_dir()).flat_map(|sub| entries(sub)).collect();
    files.extend(below);
    files.retain(|file| file.extension().is_some_and(|found| found == extension));
    files.sort();
    files
}

fn spoil(path: &Path, at: usize, count: usize) {
    let mut bytes = std::fs::read(path).unwrap();
    bytes[at..at + count].iter_mut().for_each(|byte| *byte ^= 0x5a);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn one_laz_file_as_a_log_and_as_a_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.laz");
    let poses = (0..40).map(|k| (1_000_000_000_000 + k * 1_000_000_000, Isometry3::identity())).collect();
    let made_with = MadeWith::new(Trajectory::stamped(poses).unwrap().trajectory);
    let options = LogOptions { made_with: Some(made_with), ..LogOptions::default() };
    for format in [1, 6] {
        let mut random = Random(3);
        let mut coordinate = || (random.next() % 100_000) as f64 / 1000.0;
        let mut point = |k| {
            let place = Point3::new(500_000.0 + coordinate(), 4_000_000.0 + coordinate(), coordinate());
            (1000.0 + f64::from(k) * 1e-4, place)
        };
        // Chunks of 50,000 points, the last of them short.
        let points: Vec<_> = (0..210_000).map(&mut point).collect();
        WorldFile { format, standard_time: true, unit_m: 1.0, points: &points }.write(&path);
        assert!(same(|| told(&path, &options)).is_ok());
        assert_eq!(same(|| cloud(&path)).1, Ok(210_000));

        let length = std::fs::metadata(&path).unwrap().len() as usize;
        spoil(&path, length / 2, 20_000);
        let damaged = same(|| told(&path, &options)).unwrap();
        assert!(damaged.contains("50,000 points are lost"));
        let (before, problem) = same(|| cloud(&path));
        assert_eq!(before.len(), 65_536);
        assert!(problem.unwrap_err().contains("cannot decode the points from here"));

        std::fs::write(&path, &std::fs::read(&path).unwrap()[..length / 2]).unwrap();
        assert!(same(|| told(&path, &options)).is_err());
        assert!(same(|| cloud(&path)).1.is_err());
    }
}

#[test]
fn folders_of_scans() {
    let kinds = [("laz", FolderFormat::Laz), ("las", FolderFormat::Las), ("pcd", FolderFormat::Pcd)];
    for (extension, kind) in kinds {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut writer = FolderScanWriter::create(&path, kind).unwrap();
        for scan in scans(40, 700, true) {
            writer.write_scan(&scan).unwrap();
        }
        writer.finish().unwrap();
        let all = same(|| told(&path, &LogOptions::default()));
        let files = scan_files(&path, extension);
        // Some are cut, some are damaged, one is of another kind.
        for cut in [3, 17, 18] {
            let bytes = std::fs::read(&files[cut]).unwrap();
            std::fs::write(&files[cut], &bytes[..bytes.len() / 3]).unwrap();
        }
        spoil(&files[20], 700, 100);
        std::fs::write(&files[30], "none").unwrap();
        assert!(same(|| told(&path, &LogOptions::default())) != all);
    }
}

/// A bag that is whole, cut anywhere, or has a byte turned: chunks that are unpacked together tell the same, in the same order.
#[test]
fn an_mcap_file_whole_and_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut random = Random(11);
    let mut below = |most: usize| random.next() as usize % most;
    for compression in [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None] {
        write_mcap(&path, &scans(100, 300, true), compression);
        let bytes = std::fs::read(&path).unwrap();
        let whole = same(|| told(&path, &LogOptions::default())).unwrap();
        assert!(whole.contains("damage: []"), "{whole}");
        let mut harmed = 0;
        for try_number in 0..60 {
            let mut bytes = bytes.clone();
            for _ in 0..=try_number % 3 {
                let at = below(bytes.len());
                bytes[at] ^= 1 << below(8);
            }
            if try_number % 4 == 0 {
                bytes.truncate(below(bytes.len()));
            }
            std::fs::write(&path, bytes).unwrap();
            harmed += usize::from(same(|| told(&path, &LogOptions::default())) != Ok(whole.clone()));
        }
        assert!(harmed > 50, "{harmed} of 60");
    }
}

/// A log of messages of one channel, and its bytes.
fn bag(path: &Path, options: mcap::WriteOptions, messages: &[(usize, Vec<u8>)]) -> Vec<u8> {
    write_with(path, options, &[POINTS], messages);
    std::fs::read(path).unwrap()
}

fn clouds(count: i64, points: usize) -> Vec<(usize, Vec<u8>)> {
    let mut random = Random(5);
    let mut coordinate = || (random.next() % 100_000) as f32 / 1000.0;
    let mut message = |k: i64| {
        let points: Vec<[f32; 3]> = (0..points).map(|_| [coordinate(), coordinate(), coordinate()]).collect();
        Message { stamp_ns: 1_000_000_000 * (k + 1), ..Message::of(&points) }.encode()
    };
    (0..count).map(|k| (0, message(k))).collect()
}

/// The records of a file up to the end of its data: their types, and where they are.
fn records(bytes: &[u8]) -> Vec<(u8, std::ops::Range<usize>)> {
    let (mut at, mut found) = (8, Vec::new());
    while bytes[at] != mcap::records::op::DATA_END {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        found.push((bytes[at], at..at + 9 + length));
        at += 9 + length;
    }
    found
}

/// What lies between chunks is taken between them.
#[test]
fn an_mcap_file_with_messages_between_its_chunks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let all = clouds(40, 200);
    let chunked = bag(&path, mcap::WriteOptions::new().chunk_size(Some(4000)), &all[..37]);
    let whole = same(|| told(&path, &LogOptions::default())).unwrap();
    let loose = bag(&path, mcap::WriteOptions::new().use_chunks(false), &all[37..]);
    let between: Vec<&[u8]> = records(&loose)
        .into_iter()
        .filter(|(kind, _)| {
            [mcap::records::op::CHANNEL, mcap::records::op::SCHEMA, mcap::records::op::MESSAGE].contains(kind)
        })
        .map(|(_, place)| &loose[place])
        .collect();
    let mut bytes = chunked[..8].to_vec();
    let mut chunks = 0;
    for (kind, place) in records(&chunked) {
        bytes.extend_from_slice(&chunked[place.clone()]);
        if kind == mcap::records::op::CHUNK {
            chunks += 1;
            if chunks % 5 == 2 {
                between.iter().for_each(|record| bytes.extend_from_slice(record));
            }
        }
    }
    std::fs::write(&path, &bytes).unwrap();
    let found = same(|| told(&path, &LogOptions::default())).unwrap();
    assert!(chunks > 15 && found != whole, "{chunks} chunks");
    assert!(found.contains("the file ends at byte"), "without an end of data");
}

/// Chunks that take more than what waits for each thread.
#[test]
fn an_mcap_file_with_large_chunks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    // Two clouds a chunk.
    bag(&path, mcap::WriteOptions::new().chunk_size(Some(4_500_000)), &clouds(10, 200_000));
    let count = |path: &Path| {
        let log = open_log(path, &LogOptions::default()).map_err(|e| e.to_string())?;
        Ok::<_, String>((format!("{:?} {:?}", log.summary(), log.frames()), read_all(&*log)))
    };
    assert_eq!(same(|| count(&path)).unwrap().1.len(), 10);
    let length = std::fs::metadata(&path).unwrap().len() as usize;
    spoil(&path, length / 4, 1000);
    let (told, scans) = same(|| count(&path)).unwrap();
    assert!(told.contains("damaged and skipped") && scans.len() < 10, "{told}");
}
