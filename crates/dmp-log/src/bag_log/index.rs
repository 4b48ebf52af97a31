//! Where the scans of a bag lie, written down and taken up again.

use super::log::BagLog;
use super::topic::{Entry, TopicIndex};
use crate::bag::{Bag, IndexedBag, IndexedPlace};
use crate::points::TimeChoice;
use crate::ros::ScanCoding;
use crate::{FrameInfo, LogError, LogSummary, PlaceInFile, ScanLog as _};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where the scans of one topic of a bag lie, and how they are read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct BagScans {
    bag: IndexedBag,
    time: Option<TimeChoice>,
    codings: Vec<ScanCoding>,
    scans: Vec<IndexedScan>,
}

/// A scan: stamp, returns, its place among the codings, the number of its message, and where that lies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct IndexedScan(i64, u64, u32, u64, IndexedPlace);

impl BagScans {
    /// Those of a bag that was opened whole.
    ///
    /// # Errors
    /// When a file of the bag is gone.
    pub(super) fn of(log: &BagLog) -> Result<Self, LogError> {
        let mut codings: Vec<ScanCoding> = Vec::new();
        let mut scans = Vec::with_capacity(log.topic.entries.len());
        for entry in &log.topic.entries {
            let known = codings.iter().position(|coding| *coding == entry.coding);
            let coding = known.unwrap_or(codings.len());
            if known.is_none() {
                codings.push(entry.coding);
            }
            let place = IndexedPlace::of(&entry.location);
            scans.push(IndexedScan(entry.stamp_ns, entry.returns, coding as u32, entry.message, place));
        }
        Ok(Self { bag: IndexedBag::of(&log.bag)?, time: log.time.clone(), codings, scans })
    }

    /// The log at `path`, of which `summary` was told.
    ///
    /// # Errors
    /// When it is another one.
    pub(crate) fn open(&self, path: &Path, summary: &LogSummary) -> Result<BagLog, LogError> {
        let bag = self.bag.open(path)?;
        let found = bag.fingerprint()?;
        if found != summary.fingerprint {
            let problem = format!("it is {found}, and the log that was indexed is {}", summary.fingerprint);
            return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
        }
        self.log(bag, summary)
    }

    /// The log of which no file is there: its scans are known and cannot be read.
    ///
    /// # Errors
    /// When the index is none.
    pub(crate) fn unopened(&self, summary: &LogSummary) -> Result<BagLog, LogError> {
        self.log(self.bag.at(&summary.path), summary)
    }

    fn log(&self, bag: Bag, summary: &LogSummary) -> Result<BagLog, LogError> {
        let entry = |scan: &IndexedScan| {
            let IndexedScan(stamp_ns, returns, coding, message, place) = *scan;
            let coding = *self.codings.get(coding as usize)?;
            let location = self.bag.location(place)?;
            Some(Entry { location, coding, stamp_ns, returns, layout: 0, message })
        };
        let entries: Option<Vec<Entry>> = self.scans.iter().map(entry).collect();
        let entries = entries.ok_or_else(|| {
            let problem = "its index names a file or a coding that it has not";
            LogError::malformed(bag.path(), PlaceInFile::WholeFile, problem)
        })?;
        let info = |entry: &Entry| FrameInfo { stamp_ns: Some(entry.stamp_ns), returns: entry.returns };
        let frames = entries.iter().map(info).collect();
        let topic = TopicIndex { entries, ..TopicIndex::default() };
        let (time, summary) = (self.time.clone(), summary.clone());
        Ok(BagLog { bag, frames, topic, time, summary, static_frames: Arc::default(), part_of: None })
    }

    /// See [`LogIndex::ranges`](crate::LogIndex::ranges).
    pub(crate) fn ranges(
        &self,
        frames: impl IntoIterator<Item = usize>,
    ) -> Vec<(PathBuf, u64, Vec<Range<u64>>)> {
        let places = frames.into_iter().filter_map(|frame| self.scans.get(frame)).map(|scan| scan.4);
        self.bag.ranges(places)
    }
}

impl BagLog {
    /// Where its scans lie; `None` where it is only a part of a log.
    pub(super) fn scans(&self) -> Result<Option<BagScans>, LogError> {
        if self.scans_in_log() > self.frames.len() {
            return Ok(None);
        }
        BagScans::of(self).map(Some)
    }
}
