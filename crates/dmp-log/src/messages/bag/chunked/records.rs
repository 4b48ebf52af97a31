//! Files of records: where one is, read at any place, and the records in a chunk.

use super::framing::Framing;
use crate::file::{CountedFile, ReadCount};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::messages::bag) struct RecordPlace {
    /// Where the chunk's record starts in the file, or the message's own record outside a chunk.
    pub(in crate::messages::bag) record_at: u64,
    /// Bytes of that record's body.
    pub(in crate::messages::bag) record_bytes: u64,
    /// Place of the message's body in the unpacked chunk; `None` outside a chunk.
    pub(in crate::messages::bag) in_chunk: Option<u64>,
    pub(in crate::messages::bag) body_bytes: u64,
}

/// A chunk, or a message outside the chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::messages::bag) struct Record {
    pub(super) at: u64,
    pub(super) body_bytes: u64,
    pub(super) is_chunk: bool,
}

impl Record {
    /// That in which a message lies.
    pub(in crate::messages::bag) fn of(place: RecordPlace) -> Self {
        Self { at: place.record_at, body_bytes: place.record_bytes, is_chunk: place.in_chunk.is_some() }
    }
}

/// Largest chunk, message or summary that is read, uncompressed.
pub(super) const MAX_RECORD_BYTES: u64 = crate::messages::bag::basics::MAX_MESSAGE_BYTES;

/// Bytes read at once of a file that is read from start to end.
const STREAM_BYTES: usize = 1 << 16;
/// Bytes read at once of a file of which only pieces are: no system reads less.
const PIECE_BYTES: usize = 1 << 12;

/// A file read at any place, with its length known.
#[derive(Debug)]
pub(super) struct Source {
    file: BufReader<CountedFile>,
    at: u64,
    length: u64,
    pub(super) framing: Framing,
}

impl Source {
    /// A file that is read from start to end.
    pub(super) fn open(path: &Path, framing: Framing, count: &ReadCount) -> io::Result<Self> {
        Self::with_buffer(path, framing, count, STREAM_BYTES)
    }

    /// A file that is read in pieces here and there: little beyond them is read.
    pub(super) fn open_for_pieces(path: &Path, framing: Framing, count: &ReadCount) -> io::Result<Self> {
        Self::with_buffer(path, framing, count, PIECE_BYTES)
    }

    fn with_buffer(
        path: &Path,
        framing: Framing,
        count: &ReadCount,
        buffer_bytes: usize,
    ) -> io::Result<Self> {
        let file = count.open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file: BufReader::with_capacity(buffer_bytes, file), at: 0, length, framing })
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    pub(super) fn read_at(&mut self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        if at != self.at {
            let step = i64::try_from(i128::from(at) - i128::from(self.at));
            match step {
                // Keeps what is in the buffer.
                Ok(step) => self.file.seek_relative(step)?,
                Err(_) => self.file.seek(SeekFrom::Start(at)).map(|_| ())?,
            }
        }
        // A failed read leaves the position unknown; the next one starts from a seek.
        self.at = u64::MAX;
        if let Err(error) = self.file.read_exact(bytes) {
            self.at = self.file.stream_position()?;
            return Err(error);
        }
        self.at = at + bytes.len() as u64;
        Ok(())
    }

    /// Reads `count` bytes, at most [`MAX_RECORD_BYTES`] and what the file has, into `buffer`.
    pub(super) fn read_into(&mut self, at: u64, count: u64, buffer: &mut Vec<u8>) -> io::Result<()> {
        if count > MAX_RECORD_BYTES || at.checked_add(count).is_none_or(|end| end > self.length) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        buffer.resize(count as usize, 0);
        self.read_at(at, buffer)
    }
}

/// The records in a chunk's contents or in a summary: type, place of the body, body. Ends where a record
/// is cut, which [`Records::rest`] says.
#[derive(Debug)]
pub(super) struct Records<'a> {
    framing: Framing,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Records<'a> {
    pub(super) fn of(framing: Framing, bytes: &'a [u8]) -> Self {
        Self { framing, bytes, at: 0 }
    }

    /// Bytes behind the last whole record.
    pub(super) fn rest(&self) -> usize {
        self.bytes.len() - self.at
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = (u8, u64, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (opcode, body) = self.framing.first_record(self.bytes.get(self.at..)?)?;
        let place = self.at + self.framing.head_bytes() as usize;
        self.at = place + body.len();
        Some((opcode, place as u64, body))
    }
}

/// A message's record, taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageRecord<'a> {
    pub(super) channel_id: u32,
    pub(super) log_time_ns: u64,
    pub(super) data: &'a [u8],
}
