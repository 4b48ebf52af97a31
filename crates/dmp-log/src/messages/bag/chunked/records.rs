//! Files of records: where one is, read at any place, and the records in a chunk.

use super::framing::{Framing, HEAD_BYTES, MESSAGE_HEAD_BYTES, MessageRecord};
use super::message_index::{Entry, entries_of};
use super::ros1;
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

/// Largest header of ROS 1 that is read. The longest field is the name of a topic.
const MAX_HEADER_BYTES: u64 = 1 << 16;

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

impl Framing {
    /// Type and body of the record at the start of these bytes; `None` where they are no whole record.
    pub(super) fn first_record(self, bytes: &[u8]) -> Option<(u8, &[u8])> {
        if self == Self::Ros1 {
            let record = ros1::first_record(bytes)?;
            return Some((record.opcode(), bytes.get(..record.bytes)?));
        }
        let (head, rest) = bytes.split_first_chunk::<{ HEAD_BYTES as usize }>()?;
        let [opcode, length @ ..] = *head;
        Some((opcode, rest.get(..usize::try_from(u64::from_le_bytes(length)).ok()?)?))
    }

    /// The parts of a message's record; `None` where its header is not whole.
    pub(super) fn split_message(self, body: &[u8]) -> Option<MessageRecord<'_>> {
        if self == Self::Ros1 {
            return ros1::split_message(body);
        }
        let (head, data) = body.split_first_chunk::<MESSAGE_HEAD_BYTES>()?;
        // Number of the channel, number of the message, time of recording, time of publishing.
        let [c0, c1, _, _, _, _, time @ ..] = head;
        let log_time_ns = u64::from_le_bytes(*time.first_chunk()?);
        Some(MessageRecord { channel_id: u16::from_le_bytes([*c0, *c1]).into(), log_time_ns, data })
    }

    /// The entries of a message index; `None` where it is not whole.
    pub(super) fn entries_of(self, body: &[u8]) -> Option<Vec<Entry>> {
        match self {
            Self::Mcap => entries_of(body),
            Self::Ros1 => ros1::entries_of(body),
        }
    }
}

/// What is in front of a record's data.
#[derive(Debug)]
pub(super) struct Ros1Head {
    pub(super) fields: Vec<u8>,
    pub(super) data_at: u64,
    pub(super) data_bytes: u64,
}

impl Source {
    /// The type and the body's length of the record at `at`, where [`HEAD_BYTES`] are; a type of 0 where that is no record.
    pub(super) fn head_at(&mut self, at: u64) -> io::Result<(u8, u64)> {
        if self.framing == Framing::Ros1 {
            let head = self.ros1_head_at(at)?;
            let bytes_of = |head: &Ros1Head| head.data_at - at + head.data_bytes;
            return Ok(head.map_or((0, 0), |head| (ros1::Fields(&head.fields).opcode(), bytes_of(&head))));
        }
        let mut head = [0; HEAD_BYTES as usize];
        self.read_at(at, &mut head)?;
        let [opcode, length @ ..] = head;
        Ok((opcode, u64::from_le_bytes(length)))
    }

    /// What is in front of the data of the record of ROS 1 at `at`; `None` where that is none, or the file ends in it.
    pub(super) fn ros1_head_at(&mut self, at: u64) -> io::Result<Option<Ros1Head>> {
        let mut length = |at: u64| -> io::Result<Option<u64>> {
            if self.length().saturating_sub(at) < 4 {
                return Ok(None);
            }
            let mut length = [0; 4];
            self.read_at(at, &mut length)?;
            Ok(Some(u32::from_le_bytes(length).into()))
        };
        let Some(header_bytes) = length(at)?.filter(|&bytes| bytes <= MAX_HEADER_BYTES) else {
            return Ok(None);
        };
        let data_at = at + 8 + header_bytes;
        let Some(data_bytes) = length(data_at - 4)? else { return Ok(None) };
        let mut fields = Vec::new();
        self.read_into(at + 4, header_bytes, &mut fields)?;
        Ok(Some(Ros1Head { fields, data_at, data_bytes }))
    }
}
