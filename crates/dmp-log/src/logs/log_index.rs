//! Where the scans of a log lie: enough to open it again, anywhere, without reading it.

use super::bag_log::BagScans;
use crate::file::END_BYTES;
use crate::{LogOptions, LogSummary, shown_path};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;

/// Where the scans of a log lie that was opened whole, and what was found in it. Written down, it opens the log again in
/// another process or on another machine: a bag without reading more than its ends, and of a scan what it is packed in;
/// other formats as they always are.
///
/// ```
/// use dmp_log::{LogIndex, LogOptions, McapScanWriter, McapWriterOptions, open_log};
/// use dmp_sensor::Scan;
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("town.mcap");
/// let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default())?;
/// let points_in_sensor_m = vec![[4.0, 3.0, 0.5], [8.0, -2.0, 1.5]];
/// writer.write_scan(&Scan { stamp_ns: Some(5), points_in_sensor_m, time_offsets_ns: vec![] })?;
/// writer.finish()?;
///
/// let text = serde_json::to_string(&open_log(&path, &LogOptions::default())?.index()?)?;
/// let index: Option<LogIndex> = serde_json::from_str(&text)?;
/// let again = index.ok_or("no index")?.open(&path)?;
/// let mut scan = Scan::default();
/// again.reader()?.read(0, &mut scan)?;
/// assert_eq!(scan.points_in_sensor_m[1], [8.0, -2.0, 1.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogIndex {
    pub(crate) summary: LogSummary,
    pub(crate) scans: IndexedScans,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum IndexedScans {
    Bag(Box<BagScans>),
    /// It is opened as it was.
    Whole(Box<LogOptions>),
}

/// A file of a log, and which of its bytes are read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FileRanges {
    /// Seen from the path of the log; empty where that is the file.
    pub name: PathBuf,
    /// Bytes of the file.
    pub bytes: u64,
    /// What is read of it: ascending, and apart from each other.
    pub ranges: Vec<Range<u64>>,
}

impl LogIndex {
    pub(crate) fn of_bag(summary: &LogSummary, scans: BagScans) -> Self {
        Self { summary: moved(summary), scans: IndexedScans::Bag(Box::new(scans)) }
    }

    pub(crate) fn whole(summary: &LogSummary, options: &LogOptions) -> Self {
        Self { summary: moved(summary), scans: IndexedScans::Whole(Box::new(options.clone())) }
    }

    /// What was found in the log.
    pub fn summary(&self) -> &LogSummary {
        &self.summary
    }

    /// Whether scans are found without reading the log.
    pub fn is_by_scan(&self) -> bool {
        matches!(self.scans, IndexedScans::Bag(_))
    }

    /// What is read to open the log and some of its scans; `None` where that is not known beforehand: all of it.
    pub fn ranges(&self, frames: impl IntoIterator<Item = usize>) -> Option<Vec<FileRanges>> {
        let IndexedScans::Bag(scans) = &self.scans else { return None };
        let files = scans.ranges(frames).into_iter().map(|(name, bytes, mut ranges)| {
            // What identifies a file.
            ranges.extend([0..bytes.min(END_BYTES), bytes.saturating_sub(END_BYTES)..bytes]);
            FileRanges { name, bytes, ranges: joined(ranges) }
        });
        Some(files.collect())
    }
}

/// What was found in a log, wherever it lies: an index is the same for every copy.
fn moved(summary: &LogSummary) -> LogSummary {
    LogSummary { path: shown_path(&summary.path).into(), ..summary.clone() }
}

/// Ascending, and those that touch as one.
fn joined(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    ranges.sort_unstable_by_key(|range| range.start);
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use crate::{LogOptions, McapScanWriter, McapWriterOptions, open_log};
    use dmp_sensor::Scan;

    #[test]
    fn copies_of_a_log_have_one_index() {
        let index = || {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("town.mcap");
            let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default()).unwrap();
            let points_in_sensor_m = vec![[4.0, 3.0, 0.5]];
            writer
                .write_scan(&Scan { stamp_ns: Some(5), points_in_sensor_m, time_offsets_ns: vec![] })
                .unwrap();
            writer.finish().unwrap();
            let log = open_log(&path, &LogOptions::default()).unwrap();
            serde_json::to_string(&log.index().unwrap()).unwrap()
        };
        assert_eq!(index(), index());
    }
}
