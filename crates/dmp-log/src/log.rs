use crate::{CameraNumbers, LogError, MadeWith, PointTime, StampAt, StaticFrames};
use dmp_sensor::{PinholeCamera, Scan};
use std::fmt::Debug;
use std::ops::Range;
use std::path::PathBuf;

/// How a log is to be read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogOptions {
    /// The topic with the scans; `None` where the log has only one.
    pub topic: Option<String>,
    /// What the times of the points mean.
    pub point_time: PointTime,
    /// Which instant of a scan its stamp is.
    pub stamp_at: StampAt,
    /// What a file in world coordinates was made with; without it such a file is no log.
    pub made_with: Option<MadeWith>,
    /// The camera of a log of depth images; `None` for what a file beside them says, or what is usual.
    pub camera: Option<CameraNumbers>,
    /// Units of depth a metre, likewise.
    pub depth_units_per_m: Option<f64>,
}

impl LogOptions {
    /// As little as can be asked of a log: its scans, each an instant.
    pub(crate) fn without_times() -> Self {
        Self { point_time: PointTime::Ignore, ..Self::default() }
    }
}

/// What is known of a scan before it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameInfo {
    /// The instant the scan's times count from, nanoseconds; `None` where the log has no stamps.
    pub stamp_ns: Option<i64>,
    /// Rows of the scan: every return, whether it will be used or not.
    pub returns: u64,
}

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

    /// Consecutive frames that are cheapest to read together, in order, all of them.
    fn groups(&self) -> Vec<Range<usize>>;
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

/// The formats of scan logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LogFormat {
    /// An MCAP file with ROS messages.
    Mcap,
    /// A rosbag2 folder with MCAP files.
    Rosbag2Mcap,
    /// A rosbag2 `SQLite` file, or a folder with them.
    Rosbag2Sqlite,
    /// A folder of files with float32 x, y, z, intensity.
    BinFolder,
    /// A folder of PCD files.
    PcdFolder,
    /// A folder of PLY files.
    PlyFolder,
    /// A folder of LAS or LAZ files.
    LasFolder,
    /// One LAS or LAZ file in world coordinates.
    Las,
    /// A folder of depth images with stamps, as TUM RGB-D has them.
    TumRgbd,
    /// A folder of depth images that are numbered and stamped by their numbers, as ICL-NUIM has them.
    IclNuim,
    /// A folder of depth images without stamps, as Redwood and Augmented ICL-NUIM have them.
    DepthFolder,
}

impl LogFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mcap => "MCAP",
            Self::Rosbag2Mcap => "rosbag2 (MCAP)",
            Self::Rosbag2Sqlite => "rosbag2 (SQLite)",
            Self::BinFolder => "folder of KITTI .bin scans",
            Self::PcdFolder => "folder of PCD scans",
            Self::PlyFolder => "folder of PLY scans",
            Self::LasFolder => "folder of LAS scans",
            Self::Las => "LAS in world coordinates",
            Self::TumRgbd => "folder of depth images (TUM RGB-D)",
            Self::IclNuim => "folder of depth images (ICL-NUIM)",
            Self::DepthFolder => "folder of depth images",
        }
    }
}

/// A topic of a log, whether it can be read or not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicInfo {
    /// The topic's name.
    pub name: String,
    /// The type of its messages and their encoding, as `sensor_msgs/msg/PointCloud2 (cdr)`.
    pub message_type: String,
    /// How many messages were found.
    pub messages: u64,
    /// When the first and the last of them were recorded, nanoseconds.
    pub span_ns: Option<(u64, u64)>,
}

/// A field of a point as the log stores it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldInfo {
    /// Its name.
    pub name: String,
    /// Its type, as `float32`.
    pub kind: &'static str,
    /// Its place in the point's record.
    pub offset_bytes: u32,
    /// What it is taken for.
    pub meaning: FieldMeaning,
}

/// What a field of a point is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldMeaning {
    /// A coordinate in the sensor's frame, metres.
    Coordinate,
    /// The time of the point.
    Time,
    /// It is not used.
    NotUsed,
}

impl FieldMeaning {
    /// Its name in machine output: `coordinate`, `time`, `not_used`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coordinate => "coordinate",
            Self::Time => "time",
            Self::NotUsed => "not_used",
        }
    }
}

/// Something that is lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where, as `byte 4711` or `scans/000007.bin, byte 160`.
    pub place: String,
    /// What is wrong there and what is lost by it.
    pub what: String,
    /// How many places it stands for: one, or those beyond the first hundred that are counted by kind.
    pub places: u64,
}

impl Damage {
    /// Damage in one place.
    pub(crate) fn new(place: impl Into<String>, what: impl Into<String>) -> Self {
        Self { place: place.into(), what: what.into(), places: 1 }
    }
}

/// What was found in a log on opening it.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSummary {
    /// The file or the folder with the scans.
    pub path: PathBuf,
    /// The log's format.
    pub format: LogFormat,
    /// The topic that is read.
    pub topic: Option<String>,
    /// The name of the sensor's frame, as the log has it.
    pub frame_id: Option<String>,
    /// The fields of a point.
    pub fields: Vec<FieldInfo>,
    /// Bytes from one point to the next.
    pub point_bytes: u32,
    /// Rows of all scans together.
    pub returns: u64,
    /// Smallest and largest stamp, nanoseconds.
    pub span_ns: Option<(i64, i64)>,
    /// Median of the differences of successive stamps, nanoseconds.
    pub period_ns: Option<i64>,
    /// How the times of the points are understood, in words; `None` where there are none.
    pub point_times: Option<String>,
    /// From a scan's stamp to the middle of its returns, nanoseconds, from a few scans; 0 where they have no times.
    pub middle_ns: i64,
    /// The camera whose depth images the scans are; `None` for other sensors.
    pub camera: Option<PinholeCamera>,
    /// Units of depth a metre in such images.
    pub depth_units_per_m: Option<f64>,
    /// What was guessed or left aside.
    pub notes: Vec<String>,
    /// What is lost.
    pub damage: Vec<Damage>,
    /// Identifies the file cheaply, as `crc32:1a2b3c4d`: length and ends, not every byte.
    pub fingerprint: String,
    /// Bytes of the log.
    pub bytes: u64,
    /// Every topic.
    pub topics: Vec<TopicInfo>,
}

impl LogSummary {
    /// Whether the log gives its points times of their own.
    pub fn has_point_times(&self) -> bool {
        self.point_times.is_some()
    }
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

/// Runs of at most eight frames.
pub(crate) fn runs_of_eight(frames: usize) -> Vec<Range<usize>> {
    (0..frames).step_by(8).map(|start| start..(start + 8).min(frames)).collect()
}
