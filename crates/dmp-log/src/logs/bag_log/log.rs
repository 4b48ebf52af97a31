//! The scans of one topic of a bag as a log.

use super::topic::TopicIndex;
use crate::messages::{Bag, BagReader, Cloud};
use crate::points::{TimeChoice, TimeField, TimeRule};
use crate::scans::runs_of_eight;
use crate::{FrameInfo, LogError, LogIndex, LogSummary, ScanLog, ScanReader, StaticFrames};
use dmp_sensor::Scan;
use std::ops::Range;
use std::sync::Arc;

/// A bag with one topic of scans chosen: all of them, or a part.
#[derive(Debug)]
pub(crate) struct BagLog {
    pub(super) bag: Bag,
    pub(super) frames: Vec<FrameInfo>,
    pub(super) topic: TopicIndex,
    pub(super) time: Option<TimeChoice>,
    pub(super) summary: LogSummary,
    pub(super) static_frames: Arc<StaticFrames>,
    /// Scans of the whole log where only a part was opened.
    pub(super) part_of: Option<usize>,
}

impl ScanLog for BagLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn static_frames(&self) -> &StaticFrames {
        &self.static_frames
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn number_in_log(&self, frame: usize) -> usize {
        let entry = self.topic.entries.get(frame).filter(|_| self.part_of.is_some());
        entry.map_or(frame, |entry| entry.message as usize)
    }

    fn scans_in_log(&self) -> usize {
        self.part_of.unwrap_or(self.frames.len())
    }

    fn bytes_read(&self) -> Option<u64> {
        self.bag.bytes_read()
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(BagScanReader { log: self, bag: self.bag.reader() }))
    }

    fn index(&self) -> Result<Option<LogIndex>, LogError> {
        Ok(self.scans()?.map(|scans| LogIndex::of_bag(&self.summary, scans)))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        let entries = &self.topic.entries;
        if !entries.iter().any(|entry| entry.location.is_in_chunk()) {
            return runs_of_eight(entries.len());
        }
        let mut start = 0;
        let chunks = entries.chunk_by(|a, b| a.location.shares_chunk(&b.location));
        chunks
            .map(|chunk| {
                let group = start..start + chunk.len();
                start = group.end;
                group
            })
            .collect()
    }
}

#[derive(Debug)]
struct BagScanReader<'a> {
    log: &'a BagLog,
    bag: BagReader<'a>,
}

impl BagLog {
    pub(super) fn with_cloud(
        &self,
        bag: &mut BagReader<'_>,
        frame: usize,
        use_it: impl FnOnce(&Cloud<'_>),
    ) -> Result<(), LogError> {
        let number = self.number_in_log(frame);
        let malformed = |problem: String| self.bag.fault(self.bag.path(), number, problem);
        let entries = &self.topic.entries;
        let Some(entry) = entries.get(frame) else {
            return Err(malformed(format!("the log has {} scans", entries.len())));
        };
        let message = bag.message(&entry.location, number)?;
        let cloud = entry.coding.parse(message).map_err(malformed)?;
        if cloud.returns() != entry.returns || cloud.stamp_ns != entry.stamp_ns {
            return Err(malformed("the file has changed since it was opened".into()));
        }
        use_it(&cloud);
        Ok(())
    }
}

impl ScanReader for BagScanReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clear();
        let time = self.log.time.as_ref();
        self.log.with_cloud(&mut self.bag, frame, |cloud| take_scan(cloud, time, scan))
    }
}

/// Fills an empty scan with what a message holds, its times understood as `time` says.
pub(super) fn take_scan(cloud: &Cloud<'_>, time: Option<&TimeChoice>, scan: &mut Scan) {
    let of_field = |choice: &TimeChoice| -> Option<(TimeField, TimeRule)> {
        Some((cloud.layout.time_field(&choice.field)?, choice.rule))
    };
    scan.stamp_ns = Some(cloud.stamp_ns);
    cloud.rows().append_to(time.and_then(of_field), scan);
}
