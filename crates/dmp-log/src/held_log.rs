//! Some scans of a log, held in memory.

use crate::{FrameInfo, LogError, LogSummary, Place, ScanLog, ScanReader, StaticFrames};
use dmp_sensor::Scan;
use std::ops::Range;

/// Scans of a log that were read once and are held in memory: see [`LogOutline::load`](crate::LogOutline::load).
#[derive(Debug)]
pub struct HeldLog {
    /// For each frame its number in the log, ascending, and the scan.
    scans: Vec<(usize, Scan)>,
    frames: Vec<FrameInfo>,
    summary: LogSummary,
    static_frames: StaticFrames,
    scans_in_log: usize,
}

impl HeldLog {
    /// The frames of `log`, as `take` gives them by their number in it, once each.
    pub(crate) fn new(log: &dyn ScanLog, take: &mut dyn FnMut(usize) -> Option<Scan>) -> Self {
        let numbers =
            (0..log.frames().len()).map(|frame| (log.number_in_log(frame), log.frames().get(frame)));
        let held = numbers.filter_map(|(number, frame)| Some(((number, take(number)?), *frame?)));
        let (scans, frames) = held.unzip();
        Self {
            scans,
            frames,
            summary: log.summary().clone(),
            static_frames: log.static_frames().clone(),
            scans_in_log: log.scans_in_log(),
        }
    }

    /// Reads all frames of a log.
    pub(crate) fn of(log: &dyn ScanLog) -> Result<Self, LogError> {
        let (mut reader, mut scans) = (log.reader()?, Vec::with_capacity(log.frames().len()));
        for frame in 0..log.frames().len() {
            let mut scan = Scan::default();
            reader.read(frame, &mut scan)?;
            scans.push(scan);
        }
        let mut scans = scans.into_iter();
        Ok(Self::new(log, &mut |_| scans.next()))
    }
}

impl ScanLog for HeldLog {
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
        self.scans.get(frame).map_or(frame, |(number, _)| *number)
    }

    fn scans_in_log(&self) -> usize {
        self.scans_in_log
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(HeldReader(self)))
    }

    /// Each by itself: nothing is read any more.
    fn groups(&self) -> Vec<Range<usize>> {
        (0..self.scans.len()).map(|frame| frame..frame + 1).collect()
    }
}

/// Copies scans of a [`HeldLog`].
struct HeldReader<'a>(&'a HeldLog);

impl ScanReader for HeldReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        let Some((_, held)) = self.0.scans.get(frame) else {
            let problem = format!("the part of the log that was read has {} scans", self.0.scans.len());
            return Err(LogError::malformed(&self.0.summary.path, Place::Frame(frame as u64), problem));
        };
        scan.clone_from(held);
        Ok(())
    }
}
