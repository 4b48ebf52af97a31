//! Times of points in files of their own beside the scans: `times/NAME.f32`, a float32 for each point.

use super::entry::Entry;
use super::stamps::beside;
use crate::file::{ReadCount, fill, is_folder};
use crate::points::{
    ENOUGH, FieldExtremes, Origin, PointTime, RawTime, TimeChoice, TimeRule, TimeUnit, USUAL_PERIOD_NS,
    counts_from_stamp, frames_to_look_at, place_stamp,
};
use crate::{LogError, LogOptions, LogSetting, shown_path};
use dmp_sensor::Scan;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const TIME_BYTES: u64 = 4;
/// What the times are called where a field would be named.
const NAME: &str = "times/*.f32";

/// The folder with times of the scans in `folder`.
pub(super) fn folder_beside(folder: &Path) -> Result<Option<PathBuf>, LogError> {
    for path in beside(folder, "times") {
        if is_folder(&path)? {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

/// What the times in a folder with a file for each scan mean; `None` where they are not wanted. Compares the counts.
pub(super) fn choose(
    folder: &Path,
    entries: &[Entry],
    options: &LogOptions,
    count: &ReadCount,
    (period_ns, notes): (Option<i64>, &mut Vec<String>),
) -> Result<Option<TimeChoice>, LogError> {
    if options.point_time == PointTime::Ignore {
        notes.push(format!("{}: not used, as was asked", shown_path(folder)));
        return Ok(None);
    }
    if let Some(asked) = &options.point_time_field {
        let problem = format!("was given, but the times of points are in {}", shown_path(folder));
        return Err(LogError::setting(folder, LogSetting::PointTimeField, asked, problem));
    }
    let given = TimeRule::given(options.point_time);
    let rule = given.unwrap_or(TimeRule::new(TimeUnit::Seconds, Origin::Stamp));
    for entry in entries {
        let path = file_of(folder, entry);
        let length = fs::metadata(&path).map_err(|e| LogError::io(&path, "open", e))?.len();
        let times = length / TIME_BYTES;
        // A cut scan has fewer points than times; the first ones belong together.
        if times != entry.points && !(entry.is_cut && times > entry.points) {
            let (other, other_count) = (entry.file.path.clone(), entry.points);
            return Err(LogError::CountMismatch { path, count: times, what: "times", other, other_count });
        }
    }
    let mut seen = extremes(folder, entries, count)?;
    let odd_frame = if given.is_none() { odd_frame(&seen, rule.unit, period_ns) } else { None };
    seen.retain(|scan| Some(scan.frame) != odd_frame);
    let evidence = if given.is_some() { "as given" } else { "as such files have them" };
    let choice = place_stamp(folder, NAME, rule, options.stamp_at, &seen, evidence)?;
    notes.push(format!("a time for each point from {}", shown_path(folder)));
    Ok(Some(TimeChoice { odd_frame, ..choice }))
}

fn file_of(folder: &Path, entry: &Entry) -> PathBuf {
    // Not `with_extension`: names of stamps have a full stop in them.
    let stem = entry.file.path.file_stem().unwrap_or_default();
    let mut name = stem.to_owned();
    name.push(".f32");
    folder.join(name)
}

/// Reads the times of a scan's points.
fn times_of(folder: &Path, entry: &Entry, count: &ReadCount, bytes: &mut Vec<u8>) -> Result<(), LogError> {
    let path = file_of(folder, entry);
    let mut file = count.open(&path).map_err(|e| LogError::io(&path, "open", e))?;
    fill(&path, &mut file, 0, entry.points * TIME_BYTES, bytes)
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f32> {
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|word| f32::from_le_bytes(*word))
}

fn seconds(bytes: &[u8]) -> impl Iterator<Item = f64> {
    floats(bytes).map(f64::from)
}

fn extremes(folder: &Path, entries: &[Entry], count: &ReadCount) -> Result<Vec<FieldExtremes>, LogError> {
    let (mut seen, mut bytes) = (Vec::new(), Vec::new());
    for frame in frames_to_look_at(entries.iter().map(|entry| entry.points)) {
        let Some(entry) = entries.get(frame) else { continue };
        times_of(folder, entry, count, &mut bytes)?;
        let finite = || seconds(&bytes).filter(|time| time.is_finite());
        if let (Some(smallest), Some(largest)) = (finite().reduce(f64::min), finite().reduce(f64::max)) {
            let stamp_ns = entry.stamp_ns.unwrap_or(0);
            seen.push(FieldExtremes { frame, stamp_ns, smallest, largest });
        }
    }
    Ok(seen)
}

/// The one scan whose times do not count from its stamp, where those of the others do, and which are far beyond theirs.
fn odd_frame(seen: &[FieldExtremes], unit: TimeUnit, period_ns: Option<i64>) -> Option<usize> {
    let period_ns = period_ns.unwrap_or(USUAL_PERIOD_NS);
    let scans: BTreeMap<usize, &FieldExtremes> = seen.iter().map(|scan| (scan.frame, scan)).collect();
    let mut odd = scans.values().filter(|scan| !counts_from_stamp(scan, unit, period_ns));
    let (Some(odd), None) = (odd.next(), odd.next()) else { return None };
    let extent = |scan: &FieldExtremes| scan.largest.abs().max(scan.smallest.abs());
    let others = scans.values().filter(|scan| scan.frame != odd.frame).map(|scan| extent(scan));
    let far = extent(odd) > 2.0 * others.fold(0.0, f64::max);
    (scans.len() >= ENOUGH && far).then_some(odd.frame)
}

/// Adds the times of its points to a scan.
pub(super) fn read_times(
    folder: &Path,
    rule: TimeRule,
    entry: &Entry,
    count: &ReadCount,
    bytes: &mut Vec<u8>,
    scan: &mut Scan,
) -> Result<(), LogError> {
    times_of(folder, entry, count, bytes)?;
    if let Some(ns_of) = rule.of_f32() {
        append(floats(bytes).map(ns_of), scan);
        return Ok(());
    }
    let first = || seconds(bytes).filter(|time| time.is_finite()).reduce(f64::min).map(RawTime::Float);
    // Only rules that count from the scan's first point need to know it.
    let first = if rule.needs_first() { first() } else { None };
    let stamp_ns = entry.stamp_ns.unwrap_or(0);
    append(seconds(bytes).map(|time| rule.offset_ns(RawTime::Float(time), stamp_ns, first)), scan);
    Ok(())
}

/// Adds times to a scan; what has none has no place either.
fn append(offsets_ns: impl Iterator<Item = Option<i64>>, scan: &mut Scan) {
    let places = scan.points_in_sensor_m.iter_mut();
    scan.time_offsets_ns.extend(offsets_ns.zip(places).map(|(offset_ns, place)| {
        if offset_ns.is_none() {
            *place = [f32::NAN; 3];
        }
        offset_ns.unwrap_or(0)
    }));
}
