//! Stores of messages by topic: MCAP files, rosbag2's `SQLite` files, and bags of several such files.
//!
//! What the messages are is not known here; [`crate::ros`] knows.

mod mcap;
mod rosbag2;
mod sqlite;
mod topics;

use crate::damage::DamageList;
use crate::{Damage, LogError, Place};
use std::io;
use std::path::{Path, PathBuf};

pub(crate) use topics::{Topics, in_words};

/// Largest message that is read. One with 128 beams, 4096 columns and 48 bytes a point has 24 MiB; what
/// claims more than ten times that is a lie.
const MAX_MESSAGE_BYTES: u64 = 256 << 20;

/// A stream of messages of one type.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    /// As `sensor_msgs/msg/PointCloud2`; empty where the bag does not say.
    pub(crate) message_type: String,
    /// As `cdr`.
    pub(crate) encoding: String,
}

/// A message as a walk over the bag meets it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Message<'a> {
    pub(crate) channel: &'a Channel,
    pub(crate) location: Location,
    pub(crate) body: &'a [u8],
}

/// Where a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Location {
    /// The file of the bag.
    file: u32,
    within: Within,
}

/// Where in its file a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Within {
    Mcap(mcap::McapPlace),
    /// The row of the table.
    Sqlite(i64),
}

impl Location {
    /// For messages: `byte 4711` or `row 12`.
    pub(crate) fn in_words(&self) -> String {
        match self.within {
            Within::Mcap(place) => format!("byte {}", place.record_at),
            Within::Sqlite(row) => format!("row {row}"),
        }
    }

    /// Whether two messages are unpacked together.
    pub(crate) fn shares_chunk(&self, other: &Self) -> bool {
        match (self.within, other.within) {
            (Within::Mcap(a), Within::Mcap(b)) => {
                self.file == other.file && a.in_chunk.is_some() && a.record_at == b.record_at
            }
            _ => false,
        }
    }

    /// Whether the message is one of several packed into a chunk.
    pub(crate) fn is_in_chunk(&self) -> bool {
        matches!(self.within, Within::Mcap(place) if place.in_chunk.is_some())
    }
}

/// The kinds of files with messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Mcap,
    Sqlite,
}

/// A bag: one file, or several that follow one another.
#[derive(Debug, Clone)]
pub(crate) struct Bag {
    /// The file or folder that was named.
    path: PathBuf,
    files: Vec<(PathBuf, Kind)>,
    is_rosbag2: bool,
}

/// What a walk over all messages finds beside them.
#[derive(Debug, Default)]
pub(crate) struct Walked {
    pub(crate) topics: Topics,
    pub(crate) damage: Vec<Damage>,
    /// Bytes of all files.
    pub(crate) bytes: u64,
}

impl Bag {
    /// The bag in a file that starts with `start`; `None` where that is of no such format.
    pub(crate) fn of_file(path: &Path, start: &[u8]) -> Option<Self> {
        let kind = if start.starts_with(::mcap::MAGIC) {
            Kind::Mcap
        } else if start.starts_with(sqlite::MAGIC) {
            Kind::Sqlite
        } else {
            return None;
        };
        Some(Self { path: path.into(), files: vec![(path.into(), kind)], is_rosbag2: false })
    }

    /// The bag in a folder: the files that its `metadata.yaml` names, or its only `.mcap` or `.db3` file;
    /// `None` where there is neither.
    ///
    /// # Errors
    /// When the metadata cannot be read, names a file that is not there, or says that the files are packed;
    /// and when there are several files and no metadata.
    pub(crate) fn of_folder(path: &Path) -> Result<Option<Self>, LogError> {
        let Some(files) = rosbag2::files_of(path)? else { return Ok(None) };
        let kind_of = |file: PathBuf| {
            let sqlite = file.extension().is_some_and(|extension| extension == "db3");
            (file, if sqlite { Kind::Sqlite } else { Kind::Mcap })
        };
        let files = files.into_iter().map(kind_of).collect();
        Ok(Some(Self { path: path.into(), files, is_rosbag2: true }))
    }

    /// The file or folder that was named.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Its format.
    pub(crate) fn format(&self) -> crate::LogFormat {
        match self.files.first() {
            Some((_, Kind::Sqlite)) => crate::LogFormat::Rosbag2Sqlite,
            _ if self.is_rosbag2 => crate::LogFormat::Rosbag2Mcap,
            _ => crate::LogFormat::Mcap,
        }
    }

    /// Hands over every message that can be read, in the order of the files. Only the operating system makes
    /// it fail: whatever is wrong with the bytes is damage.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(crate) fn walk(&self, each: &mut dyn FnMut(Message<'_>)) -> Result<Walked, LogError> {
        let (mut walked, mut damage) = (Walked::default(), DamageList::default());
        for (number, (path, kind)) in self.files.iter().enumerate() {
            let file = number as u32;
            let topics = &mut walked.topics;
            let mut take = |channel: &Channel, log_time_ns: u64, within: Within, body: &[u8]| {
                topics.count(channel, log_time_ns);
                each(Message { channel, location: Location { file, within }, body });
            };
            let found = match kind {
                Kind::Mcap => mcap::walk(path, &mut |channel, time, place, body| {
                    take(channel, time, Within::Mcap(place), body);
                }),
                Kind::Sqlite => sqlite::walk(path, &mut |channel, time, row, body| {
                    take(channel, time, Within::Sqlite(row), body);
                }),
            };
            let found = found.map_err(|e| LogError::io(path, "read", e))?;
            for channel in found.channels {
                walked.topics.describe(&channel);
            }
            damage.append(found.damage, |lost| self.in_file(path, lost));
            walked.bytes += found.bytes;
        }
        walked.damage = damage.into_vec();
        Ok(walked)
    }

    /// Names the file where the bag has several.
    fn in_file(&self, path: &Path, damage: Damage) -> Damage {
        if self.files.len() == 1 {
            return damage;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Damage { place: format!("{name}, {}", damage.place), ..damage }
    }

    /// What identifies the bag.
    pub(crate) fn fingerprint(&self) -> Result<String, LogError> {
        let of_file =
            |path: &Path| crate::fingerprint::of_file(path).map_err(|e| LogError::io(path, "read", e));
        match self.files.as_slice() {
            [(only, _)] => of_file(only),
            several => {
                let prints = several.iter().map(|(path, _)| of_file(path)).collect::<Result<Vec<_>, _>>()?;
                Ok(crate::fingerprint::of_names(prints.iter().map(|print| (print.as_str(), 0))))
            }
        }
    }

    /// A reader of single messages, with a file handle of its own.
    pub(crate) fn reader(&self) -> BagReader<'_> {
        BagReader { bag: self, open: None }
    }
}

/// What a walk over one file finds.
#[derive(Debug, Default)]
struct FileWalked {
    channels: Vec<Channel>,
    damage: DamageList,
    bytes: u64,
}

/// Why a message that was there cannot be read again.
#[derive(Debug)]
enum MessageFault {
    Io(io::Error),
    /// The file is not what it was; in words.
    Changed(String),
}

impl From<io::Error> for MessageFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Reads single messages of a [`Bag`]. Holds one file at a time.
#[derive(Debug)]
pub(crate) struct BagReader<'a> {
    bag: &'a Bag,
    open: Option<(u32, FileReader)>,
}

#[derive(Debug)]
enum FileReader {
    Mcap(Box<mcap::McapMessages>),
    Sqlite(sqlite::SqliteMessages),
}

impl BagReader<'_> {
    /// The body of the message at `location`, which is that of the scan `frame`.
    pub(crate) fn message(&mut self, location: &Location, frame: usize) -> Result<&[u8], LogError> {
        let Some((path, kind)) = self.bag.files.get(location.file as usize) else {
            let problem = format!("the bag has {} files", self.bag.files.len());
            return Err(LogError::malformed(&self.bag.path, Place::Frame(frame as u64), problem));
        };
        if self.open.as_ref().is_none_or(|(file, _)| *file != location.file) {
            // The one before is closed first.
            self.open = None;
            let reader = match kind {
                Kind::Mcap => mcap::McapMessages::open(path).map(|reader| FileReader::Mcap(Box::new(reader))),
                Kind::Sqlite => sqlite::SqliteMessages::open(path).map(FileReader::Sqlite),
            };
            self.open = Some((location.file, reader.map_err(|e| LogError::io(path, "open", e))?));
        }
        let body = match (self.open.as_mut().map(|(_, reader)| reader), location.within) {
            (Some(FileReader::Mcap(reader)), Within::Mcap(place)) => reader.message(place),
            (Some(FileReader::Sqlite(reader)), Within::Sqlite(row)) => reader.message(row),
            _ => Err(MessageFault::Changed("the message lies in a file of another kind".into())),
        };
        body.map_err(|fault| match fault {
            MessageFault::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                let problem = "the file is shorter than it was when it was opened";
                LogError::malformed(path, Place::Frame(frame as u64), problem)
            }
            MessageFault::Io(error) => LogError::io(path, "read", error),
            MessageFault::Changed(problem) => LogError::malformed(path, Place::Frame(frame as u64), problem),
        })
    }
}
