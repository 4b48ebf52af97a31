//! How bytes are records, in either format: MCAP, and bags of ROS 1.

use mcap::records::op;

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
pub(super) const MESSAGE_HEAD_BYTES: usize = 22;

/// Types of records of ROS 1: the first one, the place of a chunk, the description of a topic.
pub(super) const ROS1_BAG: u8 = 0x03;
pub(super) const ROS1_CHUNK_INFO: u8 = 0x06;
pub(super) const ROS1_CONNECTION: u8 = 0x07;

impl Framing {
    /// The first bytes of a file.
    pub(in crate::messages::bag) fn magic(self) -> &'static [u8] {
        match self {
            Self::Mcap => mcap::MAGIC,
            Self::Ros1 => b"#ROSBAG V2.0\n",
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
            Self::Ros1 => match opcode {
                0x02 => Kind::Message,
                0x04 => Kind::MessageIndex,
                0x05 => Kind::Chunk,
                ROS1_CONNECTION => Kind::Description,
                ROS1_BAG | ROS1_CHUNK_INFO => Kind::Other,
                _ => Kind::Unknown,
            },
        }
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

/// A message's record, taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageRecord<'a> {
    pub(super) channel_id: u32,
    pub(super) log_time_ns: u64,
    pub(super) data: &'a [u8],
}
