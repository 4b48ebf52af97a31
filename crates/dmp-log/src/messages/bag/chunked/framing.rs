//! How bytes are records, in either format: MCAP, and bags of ROS 1.

use super::message_index::{Entry, entries_of};
use super::records::{MessageRecord, Source};
use super::ros1;
use mcap::records::op;
use std::io;

/// The formats of files that are records, most of them chunks of records. A record has a type, and a body that lies behind a
/// head of always the same length: in a bag of ROS 1 the body is all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::messages::bag) enum Framing {
    Mcap,
    Ros1,
}

/// What a record is, in either format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Chunk,
    MessageIndex,
    Message,
    /// Of a channel, or of the type of its messages.
    Description,
    EndOfData,
    Footer,
    /// Indices, attachments, metadata, and in MCAP types of other programs.
    Other,
    /// Of a type that the format does not have.
    Unknown,
}

/// Bytes before the body of a record of MCAP: its type, and eight of length. No record of a bag of ROS 1 is shorter.
pub(super) const HEAD_BYTES: u64 = 9;
/// Bytes of the header of a message record of MCAP.
const MESSAGE_HEAD_BYTES: usize = 22;

impl Framing {
    /// The first bytes of a file.
    pub(in crate::messages::bag) fn magic(self) -> &'static [u8] {
        match self {
            Self::Mcap => mcap::MAGIC,
            Self::Ros1 => ros1::MAGIC,
        }
    }

    /// What the last part of a whole file is called.
    pub(super) fn end_in_words(self) -> &'static str {
        match self {
            Self::Mcap => "an end of data",
            Self::Ros1 => "an index",
        }
    }

    /// Bytes before the body of a record.
    pub(in crate::messages::bag) fn head_bytes(self) -> u64 {
        match self {
            Self::Mcap => HEAD_BYTES,
            Self::Ros1 => 0,
        }
    }

    /// Bytes of a message's body that have its time and channel, where that many do.
    pub(super) fn message_head_bytes(self) -> Option<u64> {
        (self == Self::Mcap).then_some(MESSAGE_HEAD_BYTES as u64)
    }

    pub(super) fn kind(self, opcode: u8) -> Kind {
        match self {
            Self::Mcap => match opcode {
                op::CHUNK => Kind::Chunk,
                op::MESSAGE_INDEX => Kind::MessageIndex,
                op::MESSAGE => Kind::Message,
                op::SCHEMA | op::CHANNEL => Kind::Description,
                op::DATA_END => Kind::EndOfData,
                op::FOOTER => Kind::Footer,
                _ => Kind::Other,
            },
            Self::Ros1 => ros1::kind(opcode),
        }
    }

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

impl Source {
    /// The type and the body's length of the record at `at`, where [`HEAD_BYTES`] are; a type of 0 where that is no record.
    pub(super) fn head_at(&mut self, at: u64) -> io::Result<(u8, u64)> {
        if self.framing == Framing::Ros1 {
            return ros1::type_at(self, at);
        }
        let mut head = [0; HEAD_BYTES as usize];
        self.read_at(at, &mut head)?;
        let [opcode, length @ ..] = head;
        Ok((opcode, u64::from_le_bytes(length)))
    }
}

/// The fields of a record of MCAP, from the first on.
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
