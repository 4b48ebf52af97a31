//! A bag of which it is written down where its scans lie.

use super::log::BagLog;
use super::scans::BagScans;
use super::topic::{Entry, TopicIndex};
use crate::messages::Bag;
use crate::{FrameInfo, LogError, LogSummary, PlaceInFile, ScanLog as _};
use std::path::Path;
use std::sync::Arc;

impl BagLog {
    /// Where its scans lie; `None` where it is only a part of a log.
    pub(super) fn scans(&self) -> Result<Option<BagScans>, LogError> {
        if self.scans_in_log() > self.frames.len() {
            return Ok(None);
        }
        BagScans::of(&self.bag, self.time.clone(), &self.topic.entries).map(Some)
    }

    /// The log at `path`, which has this `summary`.
    pub(crate) fn of_scans(scans: &BagScans, path: &Path, summary: &LogSummary) -> Result<Self, LogError> {
        let bag = scans.bag.open(path)?;
        let found = bag.fingerprint()?;
        if found != summary.fingerprint {
            let problem = format!("it is {found}, and the log that was indexed is {}", summary.fingerprint);
            return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
        }
        Self::of_bag(bag, scans, summary)
    }

    /// The log of which no file is there: its scans are known and cannot be read.
    pub(crate) fn unopened(scans: &BagScans, summary: &LogSummary) -> Result<Self, LogError> {
        Self::of_bag(scans.bag.at(&summary.path), scans, summary)
    }

    fn of_bag(bag: Bag, scans: &BagScans, summary: &LogSummary) -> Result<Self, LogError> {
        let entries = scans.entries(&bag)?;
        let info = |entry: &Entry| FrameInfo { stamp_ns: Some(entry.stamp_ns), returns: entry.returns };
        let frames = entries.iter().map(info).collect();
        let topic = TopicIndex { entries, ..TopicIndex::default() };
        let (time, summary) = (scans.time.clone(), summary.clone());
        Ok(Self { bag, frames, topic, time, summary, static_frames: Arc::default(), part_of: None })
    }
}
