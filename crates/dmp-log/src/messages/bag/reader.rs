//! Single messages of a bag.

use super::basics::MessageFault;
use super::location::{Location, Within};
use super::store::Bag;
use super::{chunked, sqlite};
use crate::{LogError, PlaceInFile};
use std::io;

impl Bag {
    /// A reader of single messages, with a file handle of its own.
    pub(crate) fn reader(&self) -> BagReader<'_> {
        BagReader { bag: self, open: None }
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
    Chunked(Box<chunked::ChunkedMessages>),
    Sqlite(sqlite::SqliteMessages),
}

impl BagReader<'_> {
    /// The body of the message at `location`, which is that of the scan `frame`.
    pub(crate) fn message(&mut self, location: &Location, frame: usize) -> Result<&[u8], LogError> {
        let Some((path, kind)) = self.bag.files.get(location.file as usize) else {
            let problem = format!("the bag has {} files", self.bag.files.len());
            return Err(LogError::malformed(&self.bag.path, PlaceInFile::Frame(frame as u64), problem));
        };
        if self.open.as_ref().is_none_or(|(file, _)| *file != location.file) {
            // The one before is closed first.
            self.open = None;
            let reader = match kind.framing() {
                Some(framing) => chunked::ChunkedMessages::open(path, framing, &self.bag.count)
                    .map(|reader| FileReader::Chunked(Box::new(reader))),
                None => sqlite::SqliteMessages::open(path).map(FileReader::Sqlite),
            };
            self.open = Some((location.file, reader.map_err(|e| LogError::io(path, "open", e))?));
        }
        let body = match (self.open.as_mut().map(|(_, reader)| reader), location.within) {
            (Some(FileReader::Chunked(reader)), Within::Record(place)) => reader.message(place),
            (Some(FileReader::Sqlite(reader)), Within::Sqlite(place)) => reader.message(place.row),
            _ => Err(MessageFault::Changed("the message lies in a file of another kind".into())),
        };
        body.map_err(|fault| match fault {
            MessageFault::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                self.bag.fault(path, frame, "the file is shorter than it was when it was opened")
            }
            MessageFault::Io(error) => LogError::io(path, "read", error),
            MessageFault::Changed(problem) => self.bag.fault(path, frame, problem),
        })
    }
}
