//! The stamps of a folder's scans: from a list beside them, or from their names.

use super::{calendar, names};
use crate::file::{first_file, lines, read_text, seconds_to_ns};
use crate::{LogError, ParseError, shown_path};
use dmp_lengths::thousands;
use std::path::{Path, PathBuf};

/// Largest list of stamps that is read: ten million lines.
pub(crate) const MAX_STAMPS_BYTES: u64 = 1 << 29;

/// The lists of stamps that are looked for.
pub(crate) const LISTS: [&str; 2] = ["times.txt", "timestamps.txt"];

/// Stamps of the scans, nanoseconds, in the order of their files: from a `times.txt` or `timestamps.txt`
/// beside them, with a line for each, or from their names. `None` where there are none.
pub(super) fn find(
    folder: &Path,
    files: &[PathBuf],
    notes: &mut Vec<String>,
) -> Result<Option<Vec<i64>>, LogError> {
    let beside_them = LISTS.into_iter().flat_map(|name| beside(folder, name));
    let Some(path) = first_file(beside_them)? else {
        if let Some((stamps_ns, unit)) = names::stamps_ns(files) {
            notes.push(format!("stamps from the file names, as {unit}"));
            return Ok(Some(stamps_ns));
        }
        notes.push("no times.txt: the scans have no stamps".into());
        return Ok(None);
    };
    let bytes = read_text(&path, "list of stamps", MAX_STAMPS_BYTES)?;
    let (stamps_ns, dated) = parse_dated(&bytes).map_err(|e| e.in_file(&path))?;
    let of_names = || names::stamps_ns(files);
    if let (true, Some((of_names, unit))) = (stamps_ns.len() != files.len(), of_names()) {
        notes.push(format!(
            "{}: {} stamps for {} scans, not used; stamps from the file names, as {unit}",
            shown_path(&path),
            thousands(stamps_ns.len()),
            thousands(files.len())
        ));
        return Ok(Some(of_names));
    }
    if stamps_ns.len() != files.len() {
        return Err(LogError::CountMismatch {
            path,
            count: stamps_ns.len() as u64,
            what: "stamps",
            other: folder.into(),
            other_count: files.len() as u64,
        });
    }
    let utc = if dated { ", its dates taken as UTC" } else { "" };
    notes.push(format!("stamps from {}{utc}", shown_path(&path)));
    Ok(Some(stamps_ns))
}

/// Where a companion of the scans may be: in their folder, or beside it.
pub(super) fn beside(folder: &Path, name: &str) -> Vec<PathBuf> {
    // The parent of `.` is not nothing.
    let absolute = std::path::absolute(folder).ok();
    let parent = absolute.as_deref().and_then(Path::parent).map(|parent| parent.join(name));
    std::iter::once(folder.join(name)).chain(parent).collect()
}

/// Stamps in nanoseconds from lines with one number of seconds each.
pub(crate) fn parse_times(bytes: &[u8]) -> Result<Vec<i64>, ParseError> {
    let mut stamps_ns = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let [seconds] = columns.as_slice() else {
            let problem = format!("{} columns, expected one number of seconds", columns.len());
            return Err(ParseError::new(place, problem));
        };
        stamps_ns.push(seconds_to_ns(seconds).map_err(|problem| ParseError::new(place, problem))?);
    }
    Ok(stamps_ns)
}

/// The same, or with a date and a time of day in each line; which of the two.
fn parse_dated(bytes: &[u8]) -> Result<(Vec<i64>, bool), ParseError> {
    let dated = match lines(bytes).next() {
        Some(Ok((_, columns))) => columns.len() == 2 && columns.iter().all(|column| !is_seconds(column)),
        _ => false,
    };
    if !dated {
        return parse_times(bytes).map(|stamps_ns| (stamps_ns, false));
    }
    let mut stamps_ns = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let [date, time] = columns.as_slice() else {
            let problem = format!("{} columns, expected a date and a time", columns.len());
            return Err(ParseError::new(place, problem));
        };
        stamps_ns.push(calendar::stamp_ns(date, time).map_err(|problem| ParseError::new(place, problem))?);
    }
    Ok((stamps_ns, true))
}

fn is_seconds(text: &str) -> bool {
    seconds_to_ns(text).is_ok()
}
