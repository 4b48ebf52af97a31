//! What a scan log is to its users: the traits [`ScanLog`] and [`ScanReader`], and all that one file may hold.

use super::frame_info::runs_of_eight;
use crate::{Damage, FrameInfo, LogError, LogFormat, LogIndex, LogSummary, StaticFrames, TopicInfo};
use dmp_sensor::Scan;
use std::fmt::Debug;
use std::ops::Range;
use std::path::PathBuf;

/// A log of scans, opened. Shared by threads; each takes a reader of its own.
pub trait ScanLog: Send + Sync + Debug {
    /// What was found in the log.
    fn summary(&self) -> &LogSummary;

    /// Where sensors and bodies sit on one another, where the log says it.
    fn static_frames(&self) -> &StaticFrames {
        StaticFrames::NONE
    }

    /// Every scan that can be read, in the log's own order.
    fn frames(&self) -> &[FrameInfo];

    /// The number of a frame among all scans of the log, from 0, also where only a part of the log
    /// [was opened](crate::LogOutline::open).
    fn number_in_log(&self, frame: usize) -> usize {
        frame
    }

    /// Scans of the log, also of those parts of it that were not opened.
    fn scans_in_log(&self) -> usize {
        self.frames().len()
    }

    /// Bytes read from the log's files so far: on opening it and by all its readers, whatever is read twice
    /// counted twice. A part counts together with its [outline](crate::LogOutline) and the other parts opened
    /// from that. `None` where it is not known: a library reads `SQLite` files.
    fn bytes_read(&self) -> Option<u64> {
        None
    }

    /// A reader with its own file handle and buffers.
    ///
    /// # Errors
    /// When the file can no longer be opened.
    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError>;

    /// Where its scans lie, to open it again elsewhere; `None` for a part of a log, and for scans in memory.
    ///
    /// # Errors
    /// When a file of it is gone.
    fn index(&self) -> Result<Option<LogIndex>, LogError> {
        Ok(None)
    }

    /// Consecutive frames that are cheapest to read together, in order, all of them.
    fn groups(&self) -> Vec<Range<usize>> {
        runs_of_eight(self.frames().len())
    }
}

/// Reads scans of one log.
pub trait ScanReader: Send {
    /// Reads the scan `frame` into `scan`, whose buffers are reused.
    ///
    /// A return whose time is not a number has all its coordinates set to NaN: what was measured at no
    /// known instant has no place, and is counted with the returns that are not finite.
    ///
    /// # Errors
    /// When there is no such frame, or when its bytes are no longer what they were on opening.
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError>;
}

/// Everything that a log holds, also where it cannot be scored as it is.
#[derive(Debug)]
pub struct LogSurvey {
    /// The file or folder that was named.
    pub path: PathBuf,
    /// The log's format.
    pub format: LogFormat,
    /// Bytes of the log.
    pub bytes: u64,
    /// As [`LogSummary::fingerprint`].
    pub fingerprint: String,
    /// Every topic; none for a format without topics.
    pub topics: Vec<TopicInfo>,
    /// Every stream of scans: one a topic.
    pub streams: Vec<ScanStream>,
    /// Frames that hang on one another without moving.
    pub static_frames: StaticFrames,
    /// What is lost, but for single scans of a stream.
    pub damage: Vec<Damage>,
}

/// The scans of one topic, or of a log without topics.
#[derive(Debug)]
pub struct ScanStream {
    /// The topic.
    pub topic: Option<String>,
    /// Its scans, without times of their points where those are not understood; `None` where there is no scan
    /// that can be read.
    pub log: Option<Box<dyn ScanLog>>,
    /// Single scans of it that are lost.
    pub damage: Vec<Damage>,
    /// What keeps it from being opened as a log.
    pub problem: Option<LogError>,
}
