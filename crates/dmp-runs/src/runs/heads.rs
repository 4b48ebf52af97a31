//! The heads of a log's scans, known before they are read.

use dmp_log::{FrameInfo, LogOutline, LogSummary, ScanLog};

/// The heads of a log's scans, known before they are read.
#[derive(Debug, Clone, Copy)]
pub enum Heads<'a> {
    /// The log, or part of one, is open.
    Log(&'a dyn ScanLog),
    /// Only its index was read: stamps are as exact as the index, numbers of returns are unknown.
    Outline(&'a LogOutline),
}

impl<'a> Heads<'a> {
    /// What is known of the log as a whole.
    pub fn summary(self) -> &'a LogSummary {
        match self {
            Self::Log(log) => log.summary(),
            Self::Outline(outline) => outline.summary(),
        }
    }

    /// Number of readable scans, as far as known.
    pub fn readable(self) -> usize {
        match self {
            Self::Log(log) => log.frames().len(),
            Self::Outline(outline) => outline.scans().len(),
        }
    }

    /// Number of scans of the whole log.
    pub fn scans_in_log(self) -> usize {
        match self {
            Self::Log(log) => log.scans_in_log(),
            Self::Outline(outline) => outline.scans().len(),
        }
    }

    /// Each readable scan: its number in the whole log, its stamp and its number of returns.
    pub fn scans(self) -> Box<dyn Iterator<Item = (usize, FrameInfo)> + 'a> {
        match self {
            Self::Log(log) => {
                let numbered = |(frame, info): (usize, &FrameInfo)| (log.number_in_log(frame), *info);
                Box::new(log.frames().iter().enumerate().map(numbered))
            }
            Self::Outline(outline) => {
                let stamps = outline.scans().iter().map(|scan| scan.stamp_ns);
                Box::new(stamps.map(|stamp_ns| FrameInfo { stamp_ns, returns: 0 }).enumerate())
            }
        }
    }
}
