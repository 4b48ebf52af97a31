//! What is known of the scans of a log before they are read, and what follows from their stamps.

use crate::{LogError, PlaceInFile};
use std::ops::Range;
use std::path::Path;

/// What is known of a scan before it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameInfo {
    /// The instant the scan's times count from, nanoseconds; `None` where the log has no stamps.
    pub stamp_ns: Option<i64>,
    /// Rows of the scan: every return, whether it will be used or not.
    pub returns: u64,
}

/// Smallest and largest stamp of the frames.
pub(crate) fn span_ns(frames: &[FrameInfo]) -> Option<(i64, i64)> {
    let stamps = || frames.iter().filter_map(|frame| frame.stamp_ns);
    Some((stamps().min()?, stamps().max()?))
}

/// Median of the positive differences of successive stamps: the time from scan to scan, whatever
/// pauses, repetitions and steps back the log has. Where it has no order to speak of, those in order of time count.
pub(crate) fn period_ns(frames: &[FrameInfo]) -> Option<i64> {
    median_step_ns(frames.iter().filter_map(|frame| frame.stamp_ns).collect())
}

/// The same of stamps in the order of a log.
pub(crate) fn median_step_ns(mut stamps_ns: Vec<i64>) -> Option<i64> {
    let back = stamps_ns.windows(2).filter(|pair| pair[1] < pair[0]).count();
    if 4 * back > stamps_ns.len() {
        stamps_ns.sort_unstable();
    }
    let steps = stamps_ns.windows(2).filter_map(|pair| pair[1].checked_sub(pair[0]));
    let mut steps: Vec<i64> = steps.filter(|&step| step > 0).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied()
}

/// What is held for a frame of the log at `path`.
pub(crate) fn of_frame<'a, T>(held: &'a [T], frame: usize, path: &Path) -> Result<&'a T, LogError> {
    held.get(frame).ok_or_else(|| {
        let problem = format!("the log has {} scans", held.len());
        LogError::malformed(path, PlaceInFile::Frame(frame as u64), problem)
    })
}

/// Runs of at most eight frames.
pub(crate) fn runs_of_eight(frames: usize) -> Vec<Range<usize>> {
    (0..frames).step_by(8).map(|start| start..(start + 8).min(frames)).collect()
}

/// A scan as a log's index lists it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutlinedScan {
    /// Its stamp, nanoseconds, as near as the index has it: in a bag the time the scan was recorded, plus the
    /// usual distance of a scan's own stamp from that, see [`LogOutline::stamp_error_ns`](crate::LogOutline::stamp_error_ns). `None` where the
    /// log has no stamps, or the index no time.
    pub stamp_ns: Option<i64>,
    /// Scans with the same number are packed together: reading one reads them all. From 0, ascending.
    pub group: u32,
    /// Bytes that reading the group takes once: the same for all scans of a group.
    pub bytes: u64,
}
