//! What can be wrong with a file, and where in it.

use crate::LogSetting;
use dmp_sensor::TrajectoryError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Where in a file something is. Bytes, messages and frames count from 0, lines from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlaceInFile {
    /// The file as a whole.
    WholeFile,
    /// A byte of the file.
    Byte(u64),
    /// A line of a text file.
    Line(u64),
    /// A message of the topic that is read.
    Message(u64),
    /// A scan of the log.
    Frame(u64),
    /// A point of a cloud.
    Point(u64),
}

impl fmt::Display for PlaceInFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WholeFile => f.write_str("the whole file"),
            Self::Byte(at) => write!(f, "byte {at}"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Message(index) => write!(f, "message {index}"),
            Self::Frame(index) => write!(f, "frame {index}"),
            Self::Point(index) => write!(f, "point {index}"),
        }
    }
}

/// What is wrong with bytes whose file the parser does not know.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct ParseError {
    /// Where it is.
    pub place: PlaceInFile,
    /// What it is, with the value that was found.
    pub problem: String,
}

impl ParseError {
    pub(crate) fn new(place: PlaceInFile, problem: impl Into<String>) -> Self {
        Self { place, problem: problem.into() }
    }

    /// The same with the name of the file.
    pub fn in_file(self, path: &Path) -> LogError {
        LogError::Malformed { path: path.into(), place: self.place, problem: self.problem }
    }
}

/// Why a file of the user's could not be read or written. Every message is one line that names the
/// file, the place in it and the value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// There is nothing at the path.
    #[error("{}: no such file or folder", path.display())]
    NotFound {
        /// The path as given.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: cannot {doing}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried: `open`, `read`, `write`, …
        doing: &'static str,
        /// What the operating system said.
        source: io::Error,
    },
    /// It is none of the formats known here.
    #[error("{}: not a format known here: {looked_for}", path.display())]
    UnknownFormat {
        /// The file or folder.
        path: PathBuf,
        /// What was looked for, and what was found instead.
        looked_for: String,
    },
    /// The format is known, the contents break it.
    #[error("{}: {place}: {problem}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: PlaceInFile,
        /// What is wrong, with the value.
        problem: String,
    },
    /// A scan is damaged, of a log that was opened with
    /// [`is_checked_as_read`](crate::LogOptions::is_checked_as_read): opened without, the log goes without that scan.
    #[error("{}: {place}: {problem}", path.display())]
    Unchecked {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: PlaceInFile,
        /// What is wrong, with the value.
        problem: String,
    },
    /// Two files that belong together have different counts.
    #[error("{}: {count} {what}, but {} has {other_count}", path.display(), other.display())]
    CountMismatch {
        /// The first file or folder.
        path: PathBuf,
        /// How many it has.
        count: u64,
        /// What is counted.
        what: &'static str,
        /// The second.
        other: PathBuf,
        /// How many that one has.
        other_count: u64,
    },
    /// There is no topic with scans that can be read.
    #[error("{}: no topic with sensor_msgs/PointCloud2 or Livox CustomMsg; the log has {topics}", path.display())]
    NoCloudTopic {
        /// The log.
        path: PathBuf,
        /// Its topics, in words.
        topics: String,
    },
    /// There are several topics with scans and none was named.
    #[error("{}", self.message_with(&|setting| setting.to_string()))]
    SeveralTopics {
        /// The log.
        path: PathBuf,
        /// The topics with scans, in words.
        topics: String,
    },
    /// The topic that was named does not exist or holds no scans.
    #[error("{}: no topic `{wanted}` with scans that can be read; the log has {topics}", path.display())]
    UnknownTopic {
        /// The log.
        path: PathBuf,
        /// The topic that was asked for.
        wanted: String,
        /// The log's topics, in words.
        topics: String,
    },
    /// The times of the points have no meaning that could be found.
    #[error("{}", self.message_with(&|setting| setting.to_string()))]
    PointTime {
        /// The log.
        path: PathBuf,
        /// The field or file with the times.
        field: String,
        /// Why they are not understood, with span and period.
        problem: String,
    },
    /// A setting was given that the log has no use for, or a value of it that makes no sense.
    #[error("{}", self.message_with(&|setting| setting.to_string()))]
    Setting {
        /// The log.
        path: PathBuf,
        /// The setting.
        setting: LogSetting,
        /// Its value as text; empty where that says nothing.
        value: String,
        /// What was wrong with it, and what was needed: the sentence goes on behind the value.
        problem: String,
    },
    /// A setting was not given without which the log cannot be read.
    #[error("{}", self.message_with(&|setting| setting.to_string()))]
    MissingSetting {
        /// The log.
        path: PathBuf,
        /// What was found without it; the sentence goes on with the setting and the value.
        problem: String,
        /// The setting.
        setting: LogSetting,
        /// The value that is to be given, or its form.
        value: String,
    },
    /// The scans of a folder lie in world coordinates: they are a map, or a log with what it was made with.
    #[error("{}", self.message_with(&|setting| setting.to_string()))]
    WorldCoordinates {
        /// The file, or the folder where none of its files is a scan.
        path: PathBuf,
        /// What was found.
        problem: String,
    },
    /// What was asked for is not there.
    #[error("{}: {problem}", path.display())]
    Option {
        /// The log.
        path: PathBuf,
        /// What was asked for, and what there is.
        problem: String,
    },
    /// The poses of a trajectory contradict each other.
    #[error("{}: {source}", path.display())]
    Trajectory {
        /// The file.
        path: PathBuf,
        /// The contradiction.
        source: TrajectoryError,
    },
    /// A scan cannot be expressed in the format that is written.
    #[error("{}: frame {frame}: cannot be written: {problem}", path.display())]
    Unwritable {
        /// The file that is written.
        path: PathBuf,
        /// The scan's number in it, from 0.
        frame: u64,
        /// Why, with the value.
        problem: String,
    },
}

impl LogError {
    /// Whether the user asked for the wrong thing (and the file is well): a named topic that does not
    /// exist, a choice that was not made, an option without its object, a path without a file.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            Self::NotFound { .. }
                | Self::SeveralTopics { .. }
                | Self::UnknownTopic { .. }
                | Self::Setting { .. }
                | Self::MissingSetting { .. }
                | Self::Option { .. }
        )
    }

    /// Whether a file could not be written, for which no input is at fault: a full disk, a folder that is not writable.
    pub fn is_of_writing(&self) -> bool {
        matches!(self, Self::Io { doing: "create" | "write" | "rename to", .. })
    }

    /// The message, with the words that `name` has for settings: a command line may have options for them. The plain
    /// message (`Display`) has the names of the fields of [`LogOptions`](crate::LogOptions).
    pub fn message_with(&self, name: &dyn Fn(LogSetting) -> String) -> String {
        match self {
            Self::SeveralTopics { path, topics } => {
                let topic = name(LogSetting::Topic);
                format!("{}: several topics hold scans, name one with {topic}: {topics}", path.display())
            }
            Self::PointTime { path, field, problem } => {
                let (path, point_time) = (path.display(), name(LogSetting::PointTime));
                format!(
                    "{path}: point time {field}: {problem}; say what they are with {point_time}, or {point_time} ignore"
                )
            }
            Self::Setting { path, setting, value, problem } => {
                let space = if value.is_empty() { "" } else { " " };
                format!("{}: {}{space}{value} {problem}", path.display(), name(*setting))
            }
            Self::MissingSetting { path, problem, setting, value } => {
                format!("{}: {problem} {} {value}", path.display(), name(*setting))
            }
            Self::WorldCoordinates { path, problem } => {
                let (path, made_with) = (path.display(), name(LogSetting::MadeWith));
                format!(
                    "{path}: {problem}: points in world coordinates are a map, or with {made_with} a log, as one file"
                )
            }
            other => other.to_string(),
        }
    }

    pub(crate) fn setting(
        path: &Path,
        setting: LogSetting,
        value: impl fmt::Display,
        problem: impl Into<String>,
    ) -> Self {
        Self::Setting { path: path.into(), setting, value: value.to_string(), problem: problem.into() }
    }

    pub(crate) fn missing(
        path: &Path,
        problem: impl Into<String>,
        setting: LogSetting,
        value: impl Into<String>,
    ) -> Self {
        Self::MissingSetting { path: path.into(), problem: problem.into(), setting, value: value.into() }
    }

    pub(crate) fn io(path: &Path, doing: &'static str, source: io::Error) -> Self {
        if source.kind() == io::ErrorKind::NotFound && doing == "open" {
            return Self::NotFound { path: path.into() };
        }
        Self::Io { path: path.into(), doing, source }
    }

    pub(crate) fn malformed(path: &Path, place: PlaceInFile, problem: impl Into<String>) -> Self {
        Self::Malformed { path: path.into(), place, problem: problem.into() }
    }
}
