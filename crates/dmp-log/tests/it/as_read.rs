//! Logs that are checked as they are read: what is found is the same, and what is damaged is never taken for a scan.

use crate::common::{Random, chunks, in_threads, read_all, scans};
use dmp_log::{
    FrameInfo, LogError, LogOptions, LogSummary, McapCompression, McapScanWriter, McapWriterOptions, ScanLog,
    open_log,
};
use dmp_sensor::Scan;
use std::fs;
use std::path::{Path, PathBuf};

const ALL: [McapCompression; 3] = [McapCompression::Zstd, McapCompression::Lz4, McapCompression::None];
/// Of 280 kB.
const POINTS: usize = 17_500;

fn write(folder: &Path, scans: &[Scan], compression: McapCompression, chunk_bytes: u64) -> PathBuf {
    let path = folder.join("log.mcap");
    let options = McapWriterOptions { compression, chunk_bytes, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path, &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    path
}

fn opened(path: &Path, is_checked_as_read: bool) -> Box<dyn ScanLog> {
    open_log(path, &LogOptions { is_checked_as_read, ..LogOptions::default() }).unwrap()
}

fn found(log: &dyn ScanLog) -> (LogSummary, Vec<FrameInfo>) {
    (log.summary().clone(), log.frames().to_vec())
}

#[test]
fn the_same_is_found_with_less_read() {
    let folder = tempfile::tempdir().unwrap();
    // One scan a chunk, of which a start is read; two; all in one, which is short.
    for (points, chunk_bytes, most) in [(60_000, 1, 0.7), (POINTS, 400_000, 1.3), (300, 1 << 20, 1.3)] {
        for compression in ALL {
            let written = scans(12, points, true);
            let path = write(folder.path(), &written, compression, chunk_bytes);
            let whole = opened(&path, false);
            let (most, whole) = (most * whole.bytes_read().unwrap() as f64, found(&*whole));
            in_threads(|| {
                let log = opened(&path, true);
                let read = log.bytes_read().unwrap() as f64;
                assert!(read < most, "{compression:?} {chunk_bytes}: {read} of {most}");
                assert_eq!(found(&*log), whole, "{compression:?} {chunk_bytes}");
                assert!(read_all(&*log) == written);
            });
        }
    }
}

#[test]
fn a_damaged_scan_is_missed_at_opening_or_refused_when_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut counts = [0; 2];
    for (compression, chunk_bytes) in ALL.into_iter().flat_map(|one| [(one, 1), (one, 400_000)]) {
        let written = scans(16, POINTS, true);
        let path = write(folder.path(), &written, compression, chunk_bytes);
        let bytes = fs::read(&path).unwrap();
        let in_chunks = chunks(&bytes);
        let mut random = Random(3);
        let ends = in_chunks.iter().step_by(2).map(|chunk| chunk.end - 40);
        let anywhere = (0..8).map(|_| random.next() as usize % bytes.len());
        for at in anywhere.chain(ends) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x20;
            fs::write(&path, damaged).unwrap();
            let Ok(whole) = open_log(&path, &LogOptions::default()) else { continue };
            let log = opened(&path, true);
            if found(&*log) == found(&*whole) {
                assert!(read_all(&*log) == read_all(&*whole), "byte {at}");
                counts[0] += 1;
                continue;
            }
            assert!(log.summary().damage.is_empty() && log.frames().len() == written.len());
            let mut reader = log.reader().unwrap();
            let mut scan = Scan::default();
            let mut is_whole = |frame: &usize| match reader.read(*frame, &mut scan) {
                Ok(()) => true,
                Err(LogError::Unchecked { .. }) => false,
                Err(other) => panic!("byte {at}: {other}"),
            };
            let read: Vec<FrameInfo> =
                (0..log.frames().len()).filter(&mut is_whole).map(|frame| log.frames()[frame]).collect();
            assert_eq!(read, whole.frames(), "byte {at}");
            counts[1] += 1;
        }
    }
    // Found at opening; found when read.
    assert!(counts.iter().all(|&count| count > 5), "{counts:?}");
}
