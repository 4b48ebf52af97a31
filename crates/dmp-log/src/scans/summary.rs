//! What was found in a log on opening it: its format, topics, fields, times and damage.

use super::frame_info::{period_ns, span_ns};
use crate::points::TimeChoice;
use crate::{Damage, FieldInfo, FrameInfo};
use dmp_sensor::PinholeCamera;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What to know of files that no checksum guards, for people.
pub const NO_CHECKSUMS: &str =
    "no checksums: bytes that changed are found only where they break the form of the file";

/// The formats of scan logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum LogFormat {
    /// An MCAP file with ROS messages.
    Mcap,
    /// A rosbag2 folder with MCAP files.
    Rosbag2Mcap,
    /// A rosbag2 `SQLite` file, or a folder with them.
    Rosbag2Sqlite,
    /// A bag of ROS 1.
    Rosbag1,
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
    /// Scans in memory, of no file: [`MemoryLog`](crate::MemoryLog).
    Memory,
}

impl LogFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mcap => "MCAP",
            Self::Rosbag2Mcap => "rosbag2 (MCAP)",
            Self::Rosbag2Sqlite => "rosbag2 (SQLite)",
            Self::Rosbag1 => "ROS 1 bag",
            Self::BinFolder => "folder of KITTI .bin scans",
            Self::PcdFolder => "folder of PCD scans",
            Self::PlyFolder => "folder of PLY scans",
            Self::LasFolder => "folder of LAS scans",
            Self::Las => "LAS in world coordinates",
            Self::TumRgbd => "folder of depth images (TUM RGB-D)",
            Self::IclNuim => "folder of depth images (ICL-NUIM)",
            Self::DepthFolder => "folder of depth images",
            Self::Memory => "scans in memory",
        }
    }

    /// Whether files of the format have checksums over their points.
    pub(crate) fn has_checksums(self) -> bool {
        match self {
            Self::Mcap | Self::Rosbag2Mcap
            // Chunks of a PNG have them; what is in memory has not been on a disk.
            | Self::TumRgbd | Self::IclNuim | Self::DepthFolder | Self::Memory => true,
            Self::Rosbag2Sqlite | Self::Rosbag1 | Self::BinFolder | Self::PcdFolder | Self::PlyFolder | Self::LasFolder | Self::Las => false,
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

/// What was found in a log on opening it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
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
    #[serde(skip)]
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
    /// From a scan's stamp to the first and to the last of its returns, nanoseconds, likewise.
    pub sweep_ns: [i64; 2],
    /// The camera whose depth images the scans are; `None` for other sensors.
    pub camera: Option<PinholeCamera>,
    /// Units of depth a metre in such images.
    pub depth_units_per_m: Option<f64>,
    /// Whether these are only the usual ones of the layout.
    pub are_depth_units_guessed: bool,
    /// What was guessed or left aside.
    pub notes: Vec<String>,
    /// What is lost.
    pub damage: Vec<Damage>,
    /// Whether checksums guard all points, as far as was read. Without, bytes that changed are found only where they break
    /// the form of the log.
    pub has_checksums: bool,
    /// Identifies the file cheaply, as `crc32:1a2b3c4d`: length and ends, not every byte.
    pub fingerprint: String,
    /// Bytes of the log.
    pub bytes: u64,
    /// Every topic; shared by all that know of the log.
    #[serde(skip)]
    pub topics: Arc<[TopicInfo]>,
}

impl LogSummary {
    /// That of a log of which nothing else is known yet.
    pub(crate) fn of(path: &Path, format: LogFormat) -> Self {
        Self {
            path: path.into(),
            format,
            topic: None,
            frame_id: None,
            fields: Vec::new(),
            point_bytes: 0,
            returns: 0,
            span_ns: None,
            period_ns: None,
            point_times: None,
            middle_ns: 0,
            sweep_ns: [0; 2],
            camera: None,
            depth_units_per_m: None,
            are_depth_units_guessed: false,
            notes: Vec::new(),
            damage: Vec::new(),
            has_checksums: format.has_checksums(),
            fingerprint: String::new(),
            bytes: 0,
            topics: Arc::default(),
        }
    }

    /// Takes over what the times of points mean.
    pub(crate) fn take_time(&mut self, choice: &TimeChoice) {
        self.point_times = Some(choice.words.clone());
        (self.middle_ns, self.sweep_ns) = (choice.middle_ns, choice.sweep_ns);
    }

    /// Fills what follows from the scans.
    pub(crate) fn describe(&mut self, frames: &[FrameInfo]) {
        self.returns = frames.iter().map(|frame| frame.returns).sum();
        self.span_ns = span_ns(frames);
        self.period_ns = period_ns(frames);
    }

    /// What to know of a log that no checksum guards, for people.
    pub fn without_checksums(&self) -> Option<&'static str> {
        (!self.has_checksums).then_some(NO_CHECKSUMS)
    }

    /// Whether the log gives its points times of their own.
    pub fn has_point_times(&self) -> bool {
        self.point_times.is_some()
    }
}
