//! What identifies a log or a trajectory cheaply.

use super::reads::ReadCount;
use dmp_sensor::Scan;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes looked at on each end of a file.
pub(crate) const END_BYTES: u64 = 64 * 1024;

/// Identifies a file by its length and its two ends: cheap on a log of a hundred gigabytes. It
/// distinguishes files, it does not prove them whole.
pub(crate) fn of_file(path: &Path, count: &ReadCount) -> io::Result<String> {
    let mut file = count.open(path)?;
    let length = file.metadata()?.len();
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&length.to_le_bytes());
    let mut end = Vec::new();
    (&mut file).take(END_BYTES).read_to_end(&mut end)?;
    hasher.update(&end);
    end.clear();
    file.seek(SeekFrom::Start(length.saturating_sub(END_BYTES)))?;
    file.take(END_BYTES).read_to_end(&mut end)?;
    hasher.update(&end);
    Ok(text(hasher))
}

/// Identifies a folder by the names and lengths of its files.
pub(crate) fn of_names<'a>(files: impl Iterator<Item = (&'a str, u64)>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for (name, length) in files {
        hasher.update(name.as_bytes());
        hasher.update(&[0]);
        hasher.update(&length.to_le_bytes());
    }
    text(hasher)
}

/// Identifies scans in memory by all that they hold.
pub(crate) fn of_scans(scans: &[Scan]) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for Scan { stamp_ns, points_in_sensor_m, time_offsets_ns } in scans {
        let head = [i64::from(stamp_ns.is_some()), stamp_ns.unwrap_or(0), points_in_sensor_m.len() as i64];
        head.iter().chain(time_offsets_ns).for_each(|number| hasher.update(&number.to_le_bytes()));
        points_in_sensor_m.iter().for_each(|point| hasher.update(point.map(f32::to_le_bytes).as_flattened()));
    }
    text(hasher)
}

fn text(hasher: crc32fast::Hasher) -> String {
    format!("crc32:{:08x}", hasher.finalize())
}
