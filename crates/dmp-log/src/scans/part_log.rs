//! Some scans of a log that was opened whole.

use super::frame_info::{of_frame, span_ns};
use crate::{FrameInfo, LogError, LogSummary, ScanLog, ScanReader, StaticFrames};
use dmp_lengths::thousands;
use dmp_sensor::Scan;
use std::ops::Range;
use std::sync::Arc;

/// A log with some scans of another.
#[derive(Debug)]
pub(crate) struct PartLog {
    whole: Arc<dyn ScanLog>,
    /// For each frame its number in the whole, ascending.
    numbers: Vec<usize>,
    frames: Vec<FrameInfo>,
    summary: LogSummary,
}

impl PartLog {
    /// The scans with these numbers, ascending and there.
    pub(crate) fn of(whole: Arc<dyn ScanLog>, numbers: &[usize], notes: &[String]) -> Self {
        let numbers = numbers.to_vec();
        let frames: Vec<FrameInfo> =
            numbers.iter().filter_map(|&number| whole.frames().get(number)).copied().collect();
        let mut summary = whole.summary().clone();
        summary.returns = frames.iter().map(|frame| frame.returns).sum();
        summary.span_ns = span_ns(&frames);
        summary.notes.extend_from_slice(notes);
        let (opened, all) = (frames.len(), whole.frames().len());
        if opened < all {
            summary.notes.push(format!("{} of {} scans opened", thousands(opened), thousands(all)));
        }
        Self { whole, numbers, frames, summary }
    }
}

impl ScanLog for PartLog {
    fn summary(&self) -> &LogSummary {
        &self.summary
    }

    fn static_frames(&self) -> &StaticFrames {
        self.whole.static_frames()
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    fn number_in_log(&self, frame: usize) -> usize {
        self.numbers.get(frame).copied().unwrap_or(frame)
    }

    fn scans_in_log(&self) -> usize {
        self.whole.scans_in_log()
    }

    fn bytes_read(&self) -> Option<u64> {
        self.whole.bytes_read()
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(PartReader { log: self, whole: self.whole.reader()? }))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        let mut start = 0;
        let of_whole = self.whole.groups();
        let groups = of_whole.iter().map(|group| {
            let end = self.numbers.partition_point(|&number| number < group.end);
            std::mem::replace(&mut start, end)..end
        });
        groups.filter(|group| !group.is_empty()).collect()
    }
}

struct PartReader<'a> {
    log: &'a PartLog,
    whole: Box<dyn ScanReader + 'a>,
}

impl ScanReader for PartReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        let number = of_frame(&self.log.numbers, frame, &self.log.summary.path)?;
        self.whole.read(*number, scan)
    }
}
