//! A bag whose files are known: opened again without looking for them.

use super::chunked::RecordPlace;
use super::location::{Location, Within};
use super::sqlite::RowPlace;
use super::store::{Bag, FileKind};
use crate::file::ReadCount;
use crate::{LogError, PlaceInFile};
use dmp_lengths::thousands;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The files of a bag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct IndexedBag {
    files: Vec<IndexedFile>,
    is_rosbag2: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct IndexedFile {
    /// Seen from the path of the log; empty where that is the file.
    name: PathBuf,
    kind: FileKind,
    bytes: u64,
}

/// Where a message is: the file, the record or row in it, bytes of that, and within a chunk the place and bytes of the
/// message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct IndexedPlace(u32, i64, u64, Option<u64>, u64);

impl IndexedPlace {
    pub(crate) fn of(location: &Location) -> Self {
        let Location { file, within } = *location;
        match within {
            Within::Record(RecordPlace { record_at, record_bytes, in_chunk, body_bytes }) => {
                // No file has 2⁶³ bytes.
                Self(file, record_at.cast_signed(), record_bytes, in_chunk, body_bytes)
            }
            Within::Sqlite(RowPlace { row, bytes }) => Self(file, row, bytes, None, bytes),
        }
    }
}

impl IndexedBag {
    /// Of a bag whose files are as they were.
    pub(crate) fn of(bag: &Bag) -> Result<Self, LogError> {
        let file = |(path, kind): &(PathBuf, FileKind)| {
            let bytes = path.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
            let name = path.strip_prefix(&bag.path).unwrap_or(path).to_owned();
            Ok(IndexedFile { name, kind: *kind, bytes })
        };
        let files = bag.files.iter().map(file).collect::<Result<_, LogError>>()?;
        Ok(Self { files, is_rosbag2: bag.is_rosbag2 })
    }

    /// The bag at `path`.
    pub(crate) fn open(&self, path: &Path) -> Result<Bag, LogError> {
        let file = |file: &IndexedFile| {
            let found = path_of(path, &file.name);
            let now = found.metadata().map_err(|e| LogError::io(&found, "open", e))?.len();
            if now != file.bytes {
                let [now, then] = [now, file.bytes].map(thousands);
                let problem = format!("it has {now} bytes, and had {then} when the log was indexed");
                return Err(LogError::malformed(&found, PlaceInFile::WholeFile, problem));
            }
            Ok(())
        };
        self.files.iter().try_for_each(file)?;
        Ok(self.at(path))
    }

    /// The bag as it would be at `path`; nobody looks whether it is.
    pub(crate) fn at(&self, path: &Path) -> Bag {
        let files = self.files.iter().map(|file| (path_of(path, &file.name), file.kind)).collect();
        Bag {
            path: path.into(),
            files,
            missing: Vec::new(),
            is_rosbag2: self.is_rosbag2,
            count: ReadCount::default(),
            start_is_enough: None,
        }
    }

    /// Where a message lies; `None` where the bag has no such file.
    pub(crate) fn location(&self, place: IndexedPlace) -> Option<Location> {
        let IndexedPlace(file, record, record_bytes, in_chunk, body_bytes) = place;
        let within = match self.files.get(file as usize)?.kind {
            FileKind::Mcap | FileKind::Ros1 => Within::Record(RecordPlace {
                record_at: record.cast_unsigned(),
                record_bytes,
                in_chunk,
                body_bytes,
            }),
            FileKind::Sqlite => Within::Sqlite(RowPlace { row: record, bytes: record_bytes }),
        };
        Some(Location { file, within })
    }

    /// Each file with its bytes, and those of them that are read for messages at some places: ascending, what is read with them
    /// included. All of a file of rows, whose places nobody knows.
    pub(crate) fn ranges(
        &self,
        places: impl IntoIterator<Item = IndexedPlace>,
    ) -> Vec<(PathBuf, u64, Vec<Range<u64>>)> {
        let mut files: Vec<_> =
            self.files.iter().map(|file| (file.name.clone(), file.bytes, Vec::new())).collect();
        for IndexedPlace(file, record, record_bytes, ..) in places {
            let (Some((_, bytes, ranges)), Some(indexed)) =
                (files.get_mut(file as usize), self.files.get(file as usize))
            else {
                continue;
            };
            let at = record.cast_unsigned();
            ranges.push(match indexed.kind.framing() {
                Some(framing) => {
                    at..at.saturating_add(framing.head_bytes()).saturating_add(record_bytes).min(*bytes)
                }
                None => 0..*bytes,
            });
        }
        files
    }
}

fn path_of(log: &Path, name: &Path) -> PathBuf {
    if name.as_os_str().is_empty() { log.to_owned() } else { log.join(name) }
}
