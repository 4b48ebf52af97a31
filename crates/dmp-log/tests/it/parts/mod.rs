//! Parts of a log, opened by its index, against the log opened whole.

mod formats;
mod lies;
mod mcap;

use crate::common::Random;
use dmp_log::{Damage, LogFormat, LogOptions, LogOutline, LogSummary, ScanLog, open_log, outline_log};
use dmp_sensor::Scan;
use std::path::Path;

/// A scan to the bit.
pub(crate) fn bits(scan: &Scan) -> (Option<i64>, Vec<u32>, &[i64]) {
    let places = scan.points_in_sensor_m.as_flattened().iter().map(|c| c.to_bits()).collect();
    (scan.stamp_ns, places, &scan.time_offsets_ns)
}

/// Every scan, compared with what the frames say.
pub(crate) fn scans_of(log: &dyn ScanLog) -> Vec<Scan> {
    let mut reader = log.reader().unwrap();
    let read = |frame| {
        let (mut scan, info) = (Scan::default(), log.frames()[frame]);
        reader.read(frame, &mut scan).unwrap();
        assert_eq!((scan.len() as u64, scan.stamp_ns), (info.returns, info.stamp_ns));
        scan
    };
    (0..log.frames().len()).map(read).collect()
}

pub(crate) fn sorted(damage: &[Damage]) -> Vec<String> {
    let mut lines: Vec<_> = damage.iter().map(|lost| format!("{}: {}", lost.place, lost.what)).collect();
    lines.sort();
    lines
}

/// The summary of a log but for notes and checksums, whatever the order of the damage.
fn without_notes(summary: &LogSummary) -> LogSummary {
    LogSummary { notes: Vec::new(), damage: Vec::new(), has_checksums: false, ..summary.clone() }
}

/// Numbers in order, at least one, of so many.
fn some_of(count: usize, random: &mut Random) -> Vec<usize> {
    let one_in = 1 + random.next() % 12;
    let mut numbers: Vec<usize> =
        (0..count).filter(|_| random.next().is_multiple_of(one_in) && count > 1).collect();
    if numbers.is_empty() {
        numbers.push((random.next() % count as u64) as usize);
    }
    numbers
}

/// Compares parts of a log, all of it and some, with the log opened whole, which has every scan that the
/// index names.
pub(crate) fn assert_parts(path: &Path, options: &LogOptions) -> LogOutline {
    let whole = open_log(path, options).unwrap();
    let written = scans_of(&*whole);
    let outline = outline_log(path, options).unwrap();
    let place = format!("{} {:?}", path.display(), options.topic);
    assert_eq!(outline.scans().len(), written.len(), "{place}");
    assert_eq!(outline.bytes(), whole.summary().bytes, "{place}");
    for (scan, frame) in outline.scans().iter().zip(whole.frames()) {
        let off_ns = scan.stamp_ns.unwrap_or(0).abs_diff(frame.stamp_ns.unwrap_or(0));
        assert!(off_ns <= outline.stamp_error_ns().unsigned_abs() || written.len() > 10, "{place}: {off_ns}");
    }
    let groups = outline.scans().chunk_by(|a, b| a.group == b.group);
    assert!(groups.map(|group| group[0].bytes).sum::<u64>() <= outline.bytes(), "{place}");

    // One checksum guards all messages outside chunks: only who reads the whole log compares it.
    let has_loose = outline.notes().iter().any(|note| note.contains("lie outside chunks"));
    let has_checksums = whole.summary().has_checksums && !has_loose;
    assert_eq!(outline.summary().has_checksums, has_checksums, "{place}");

    let known = LogSummary { returns: whole.summary().returns, ..without_notes(outline.summary()) };
    let by_index = |summary: LogSummary| LogSummary { span_ns: None, period_ns: None, ..summary };
    assert_eq!(by_index(known), by_index(without_notes(whole.summary())), "{place}");
    assert_eq!(outline.static_frames(), whole.static_frames(), "{place}");

    let all: Vec<usize> = (0..written.len()).collect();
    let part = outline.open(&all).unwrap();
    assert_eq!(part.summary().has_checksums, has_checksums, "{place}");
    assert_eq!(without_notes(part.summary()), without_notes(whole.summary()), "{place}");
    assert_eq!(sorted(&part.summary().damage), sorted(&whole.summary().damage), "{place}");
    assert_eq!((part.frames(), part.groups()), (whole.frames(), whole.groups()), "{place}");
    assert_eq!(part.static_frames(), whole.static_frames(), "{place}");
    assert!(scans_of(&*part).iter().map(bits).eq(written.iter().map(bits)), "{place}");

    let mut random = Random(written.len() as u64);
    for _ in 0..8 {
        let numbers = some_of(written.len(), &mut random);
        let read_by = |does: &dyn Fn()| {
            let before = outline.bytes_read();
            does();
            outline.bytes_read().zip(before).map(|(after, before)| after - before)
        };
        let opened_bytes = read_by(&|| drop(outline.open(&numbers).unwrap()));
        let held_bytes = read_by(&|| drop(outline.load(&numbers).unwrap()));
        let part = outline.open(&numbers).unwrap();
        // What a bag's scans are packed in is read once for both; files in a folder are known and read then.
        let in_files =
            ![LogFormat::Mcap, LogFormat::Rosbag2Mcap, LogFormat::Rosbag1].contains(&part.summary().format);
        assert!(in_files || held_bytes == opened_bytes, "{place}: {held_bytes:?} {opened_bytes:?}");
        assert_eq!(part.scans_in_log(), written.len(), "{place}");
        assert_eq!(part.static_frames(), whole.static_frames(), "{place}");
        let met: Vec<usize> = (0..part.frames().len()).map(|frame| part.number_in_log(frame)).collect();
        assert_eq!(met, numbers, "{place}");
        let read = scans_of(&*part);
        assert!(read.iter().map(bits).eq(numbers.iter().map(|&number| bits(&written[number]))), "{place}");
        let summary = part.summary();
        assert_eq!(summary.returns, read.iter().map(|scan| scan.len() as u64).sum::<u64>(), "{place}");
        assert_eq!(summary.point_times, whole.summary().point_times, "{place}");
        let held = outline.load(&numbers).unwrap();
        assert_eq!(held.summary(), summary, "{place}");
        assert_eq!((held.frames(), held.static_frames()), (part.frames(), part.static_frames()), "{place}");
        assert!((0..read.len()).all(|frame| held.number_in_log(frame) == numbers[frame]), "{place}");
        assert!(scans_of(&held).iter().map(bits).eq(read.iter().map(bits)), "{place}");
        let in_groups: Vec<usize> = part.groups().into_iter().flatten().collect();
        assert_eq!(in_groups, (0..read.len()).collect::<Vec<_>>(), "{place}");
    }
    outline
}
