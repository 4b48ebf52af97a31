//! The framing of MCAP: records of one byte of type, eight of length, and a body.

use crate::file::{CountedFile, ReadCount};
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::messages::bag) struct McapPlace {
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
    pub(in crate::messages::bag) fn of(place: McapPlace) -> Self {
        Self { at: place.record_at, body_bytes: place.record_bytes, is_chunk: place.in_chunk.is_some() }
    }
}

/// Bytes before the body of a record.
pub(in crate::messages::bag) const HEAD_BYTES: u64 = 9;
/// Bytes of the header of a message record.
pub(super) const MESSAGE_HEAD_BYTES: usize = 22;
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
}

impl Source {
    /// A file that is read from start to end.
    pub(super) fn open(path: &Path, count: &ReadCount) -> io::Result<Self> {
        Self::with_buffer(path, count, STREAM_BYTES)
    }

    /// A file that is read in pieces here and there: little beyond them is read.
    pub(super) fn open_for_pieces(path: &Path, count: &ReadCount) -> io::Result<Self> {
        Self::with_buffer(path, count, PIECE_BYTES)
    }

    fn with_buffer(path: &Path, count: &ReadCount, buffer_bytes: usize) -> io::Result<Self> {
        let file = count.open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file: BufReader::with_capacity(buffer_bytes, file), at: 0, length })
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

    /// The type and the body's length of the record at `at`.
    pub(super) fn head_at(&mut self, at: u64) -> io::Result<(u8, u64)> {
        let mut head = [0; HEAD_BYTES as usize];
        self.read_at(at, &mut head)?;
        let [opcode, length @ ..] = head;
        Ok((opcode, u64::from_le_bytes(length)))
    }
}

/// The records in a chunk's contents or in a summary: type, place of the body, body. Ends where a record
/// is cut, which [`Records::rest`] says.
#[derive(Debug)]
pub(super) struct Records<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Records<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes behind the last whole record.
    pub(super) fn rest(&self) -> usize {
        self.bytes.len() - self.at
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = (u8, u64, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (head, rest) = self.bytes.get(self.at..)?.split_first_chunk::<{ HEAD_BYTES as usize }>()?;
        let [opcode, length @ ..] = *head;
        let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
        let body = rest.get(..length)?;
        let place = self.at + head.len();
        self.at = place + length;
        Some((opcode, place as u64, body))
    }
}

/// A message's record, taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageRecord<'a> {
    pub(super) channel_id: u16,
    pub(super) log_time_ns: u64,
    pub(super) data: &'a [u8],
}

/// The parts of a message's record; `None` where the body is too short for a header.
pub(super) fn split_message(body: &[u8]) -> Option<MessageRecord<'_>> {
    let (head, data) = body.split_first_chunk::<MESSAGE_HEAD_BYTES>()?;
    // Number of the channel, number of the message, time of recording, time of publishing.
    let [c0, c1, _, _, _, _, time @ ..] = head;
    let log_time_ns = u64::from_le_bytes(*time.first_chunk()?);
    Some(MessageRecord { channel_id: u16::from_le_bytes([*c0, *c1]), log_time_ns, data })
}

/// The fields of a record, from the first on.
#[derive(Debug)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], String> {
        let Some((array, rest)) = self.0.split_first_chunk() else {
            return Err(format!("{what} takes {N} bytes, the record has {} left", self.0.len()));
        };
        self.0 = rest;
        Ok(*array)
    }

    pub(super) fn u16(&mut self, what: &str) -> Result<u16, String> {
        self.array(what).map(u16::from_le_bytes)
    }

    pub(super) fn u64(&mut self, what: &str) -> Result<u64, String> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// A text behind its length, which is not believed.
    pub(super) fn string(&mut self, what: &str) -> Result<&'a str, String> {
        let claimed = u32::from_le_bytes(self.array(what)?);
        let text = usize::try_from(claimed).ok().and_then(|length| self.0.split_at_checked(length));
        let (text, rest) =
            text.ok_or_else(|| format!("{what} claims {claimed} bytes of {}", self.0.len()))?;
        self.0 = rest;
        std::str::from_utf8(text).map_err(|_| format!("{what} is not text"))
    }
}
