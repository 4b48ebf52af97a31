//! A bag: which files it has, and a pass over all its messages.

use super::basics::{Channel, FileFound};
use super::chunked::Framing;
use super::location::{Location, Within};
use super::topics::Topics;
use super::{chunked, rosbag2, sqlite};
use crate::file::{DamageList, ReadCount, shorten};
use crate::{Damage, LogError, PlaceInFile};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

/// A message as a pass over the bag meets it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Message<'a> {
    pub(crate) channel: &'a Channel,
    pub(crate) location: Location,
    pub(crate) log_time_ns: u64,
    pub(crate) body: &'a [u8],
}

/// The kinds of files with messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) enum FileKind {
    Mcap,
    Ros1,
    Sqlite,
}

impl FileKind {
    /// How the file is made of records; `None` where it is of rows.
    pub(super) fn framing(self) -> Option<Framing> {
        match self {
            Self::Mcap => Some(Framing::Mcap),
            Self::Ros1 => Some(Framing::Ros1),
            Self::Sqlite => None,
        }
    }
}

/// A bag: one file, or several that follow one another.
#[derive(Debug, Clone)]
pub(crate) struct Bag {
    /// The file or folder that was named.
    pub(super) path: PathBuf,
    pub(super) files: Vec<(PathBuf, FileKind)>,
    /// Files that its metadata names and that are not there any more.
    pub(super) missing: Vec<String>,
    pub(super) is_rosbag2: bool,
    pub(super) count: ReadCount,
    /// Of these messages a pass over all need not have more than the first bytes, and need not check the others.
    pub(super) start_is_enough: Option<fn(&Channel) -> bool>,
}

/// What a pass over all messages finds beside them.
#[derive(Debug, Default)]
pub(crate) struct BagFound {
    pub(crate) topics: Topics,
    pub(crate) damage: Vec<Damage>,
    pub(crate) bytes: u64,
    /// Whether messages were read that no checksum guards.
    pub(crate) unguarded: bool,
}

impl Bag {
    /// The bag in a file that starts with `start`; `None` where that is of no such format.
    pub(crate) fn of_file(path: &Path, start: &[u8]) -> Option<Self> {
        let starts_as =
            |kind: &FileKind| start.starts_with(kind.framing().map_or(sqlite::MAGIC, Framing::magic));
        let kind = [FileKind::Mcap, FileKind::Ros1, FileKind::Sqlite].into_iter().find(starts_as)?;
        Some(Self {
            path: path.into(),
            files: vec![(path.into(), kind)],
            missing: Vec::new(),
            is_rosbag2: false,
            count: ReadCount::default(),
            start_is_enough: None,
        })
    }

    /// The bag in a folder: the files that its `metadata.yaml` names, or its only `.mcap` or `.db3` file, or without those its only `.bag`;
    /// `None` where there is neither.
    pub(crate) fn of_folder(path: &Path) -> Result<Option<Self>, LogError> {
        let Some(rosbag2::BagFiles { files, missing }) = rosbag2::files_of(path)? else { return Ok(None) };
        let kind_of = |file: PathBuf| {
            let kind = match file.extension().and_then(OsStr::to_str) {
                Some("db3") => FileKind::Sqlite,
                Some("bag") => FileKind::Ros1,
                _ => FileKind::Mcap,
            };
            (file, kind)
        };
        let files = files.into_iter().map(kind_of).collect();
        let count = ReadCount::default();
        Ok(Some(Self { path: path.into(), files, missing, is_rosbag2: true, count, start_is_enough: None }))
    }

    /// The file or folder that was named.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The same bag, of whose messages of some channels a pass over all gives no more than the first bytes, and zeros. What is
    /// damaged in the others shows when a message is read.
    pub(crate) fn with_starts_of(self, is_enough: fn(&Channel) -> bool) -> Self {
        Self { start_is_enough: Some(is_enough), ..self }
    }

    /// Why a message is not what it was found to be.
    pub(crate) fn fault(&self, path: &Path, frame: usize, problem: impl Into<String>) -> LogError {
        let (path, place, problem) = (path.into(), PlaceInFile::Frame(frame as u64), problem.into());
        match self.start_is_enough {
            None => LogError::Malformed { path, place, problem },
            Some(_) => LogError::Unchecked { path, place, problem },
        }
    }

    /// What its metadata names and is not there, in words.
    pub(crate) fn missing_files(&self) -> Option<String> {
        let names: Vec<String> =
            self.missing.iter().take(5).map(|name| format!("`{}`", shorten(name))).collect();
        let more = if self.missing.len() > names.len() { ", …" } else { "" };
        (!names.is_empty()).then(|| {
            format!(
                "metadata.yaml names files that are not there, whose messages are missing: {}{more}",
                names.join(", ")
            )
        })
    }

    pub(crate) fn format(&self) -> crate::LogFormat {
        match self.files.first() {
            Some((_, FileKind::Sqlite)) => crate::LogFormat::Rosbag2Sqlite,
            Some((_, FileKind::Ros1)) => crate::LogFormat::Rosbag1,
            _ if self.is_rosbag2 => crate::LogFormat::Rosbag2Mcap,
            _ => crate::LogFormat::Mcap,
        }
    }

    /// Hands over every message that can be read, in the order of the files. Only the operating system makes
    /// it fail: whatever is wrong with the bytes is damage.
    pub(crate) fn read_whole(&self, each: &mut dyn FnMut(Message<'_>)) -> Result<BagFound, LogError> {
        self.each_file(&mut |file, path, kind, topics| {
            let mut take = |channel: &Channel, log_time_ns: u64, within: Within, body: &[u8]| {
                topics.count(channel, log_time_ns);
                each(Message { channel, location: Location { file, within }, log_time_ns, body });
            };
            match kind.framing() {
                Some(framing) => chunked::read_whole(
                    path,
                    framing,
                    &self.count,
                    self.start_is_enough,
                    &mut |channel, time, place, body| {
                        take(channel, time, Within::Record(place), body);
                    },
                ),
                None => sqlite::read_whole(path, &mut |channel, time, place, body| {
                    take(channel, time, Within::Sqlite(place), body);
                }),
            }
        })
    }

    /// Gathers what is found in every file by `read`, which is given the file's number, path and kind.
    pub(super) fn each_file(
        &self,
        read: &mut dyn FnMut(u32, &Path, FileKind, &mut Topics) -> io::Result<FileFound>,
    ) -> Result<BagFound, LogError> {
        let (mut bag_found, mut damage) = (BagFound::default(), DamageList::default());
        for (number, (path, kind)) in self.files.iter().enumerate() {
            let found = read(number as u32, path, *kind, &mut bag_found.topics);
            let found = found.map_err(|e| LogError::io(path, "read", e))?;
            for channel in found.channels {
                bag_found.topics.describe(&channel);
            }
            damage.append(found.damage, |lost| self.in_file(path, lost));
            bag_found.bytes += found.bytes;
            bag_found.unguarded |= found.unguarded;
        }
        bag_found.damage = damage.into_vec();
        Ok(bag_found)
    }

    /// Names the file where the bag has several.
    pub(super) fn in_file(&self, path: &Path, damage: Damage) -> Damage {
        if self.files.len() == 1 {
            return damage;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Damage { place: format!("{name}, {}", damage.place), ..damage }
    }

    /// What identifies the bag.
    pub(crate) fn fingerprint(&self) -> Result<String, LogError> {
        let of_file =
            |path: &Path| crate::file::of_file(path, &self.count).map_err(|e| LogError::io(path, "read", e));
        match self.files.as_slice() {
            [(only, _)] => of_file(only),
            several => {
                let prints = several.iter().map(|(path, _)| of_file(path)).collect::<Result<Vec<_>, _>>()?;
                Ok(crate::file::of_names(prints.iter().map(|print| (print.as_str(), 0))))
            }
        }
    }

    /// Bytes read of the bag so far, by whatever was made of it; `None` where a library reads it.
    pub(crate) fn bytes_read(&self) -> Option<u64> {
        self.files.iter().all(|(_, kind)| kind.framing().is_some()).then(|| self.count.bytes())
    }
}
