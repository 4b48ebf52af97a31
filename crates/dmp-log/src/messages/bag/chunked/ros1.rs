//! Bags of ROS 1, version 2.0: a record is a header of named fields, and data, each behind its length.
//!
//! Chunks come first, each with an index of its messages behind it, then the descriptions of all topics and where the chunks
//! are. Layout: <http://wiki.ros.org/Bags/Format/2.0>.

use super::framing::MessageRecord;
use super::message_index::Entry;

/// Fields of the form `name=value`, each behind its length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn get(self, name: &str) -> Option<&'a [u8]> {
        let mut rest = self.0;
        while let Some((field, behind)) = counted(rest) {
            let value = field.strip_prefix(name.as_bytes()).and_then(|value| value.strip_prefix(b"="));
            if value.is_some() {
                return value;
            }
            rest = behind;
        }
        None
    }

    fn array<const N: usize>(self, name: &str) -> Option<[u8; N]> {
        self.get(name)?.try_into().ok()
    }

    pub(super) fn number(self, name: &str) -> Option<u32> {
        self.array(name).map(u32::from_le_bytes)
    }

    pub(super) fn place(self, name: &str) -> Option<u64> {
        self.array(name).map(u64::from_le_bytes)
    }

    fn text(self, name: &str) -> Result<&'a str, String> {
        let value = self.get(name).ok_or_else(|| format!("a connection has no `{name}`"))?;
        std::str::from_utf8(value).map_err(|_| format!("the `{name}` of a connection is not text"))
    }

    pub(super) fn opcode(self) -> u8 {
        self.array("op").map_or(0, |[opcode]| opcode)
    }
}

/// A record taken apart.
#[derive(Debug)]
pub(super) struct Record<'a> {
    pub(super) fields: Fields<'a>,
    pub(super) data: &'a [u8],
    pub(super) bytes: usize,
}

impl Record<'_> {
    pub(super) fn opcode(&self) -> u8 {
        self.fields.opcode()
    }
}

/// The record at the start of these bytes; `None` where it is not whole.
pub(super) fn first_record(bytes: &[u8]) -> Option<Record<'_>> {
    let (header, rest) = counted(bytes)?;
    let (data, rest) = counted(rest)?;
    Some(Record { fields: Fields(header), data, bytes: bytes.len() - rest.len() })
}

/// What lies behind its length, which is not believed, and what follows.
fn counted(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

/// Seconds and nanoseconds.
fn time_ns(bytes: [u8; 8]) -> u64 {
    let time = u64::from_le_bytes(bytes);
    u64::from(time as u32) * 1_000_000_000 + (time >> 32)
}

pub(super) fn split_message(body: &[u8]) -> Option<MessageRecord<'_>> {
    let Record { fields, data, .. } = first_record(body)?;
    let log_time_ns = time_ns(fields.array("time")?);
    Some(MessageRecord { channel_id: fields.number("conn")?, log_time_ns, data })
}

/// Bytes of an entry of a message index: time, and the place of the message in the unpacked chunk.
const ENTRY_BYTES: usize = 12;

pub(super) fn entries_of(body: &[u8]) -> Option<Vec<Entry>> {
    let Record { fields, data, .. } = first_record(body)?;
    let (entries, rest) = data.as_chunks::<ENTRY_BYTES>();
    let [version, channel_id, count] = ["ver", "conn", "count"].map(|name| fields.number(name));
    let channel_id = channel_id.filter(|_| version == Some(1))?;
    let entry = |entry: &[u8; ENTRY_BYTES]| {
        let (time, place) = entry.split_first_chunk()?;
        let record_at = u32::from_le_bytes(place.try_into().ok()?).into();
        Some(Entry { record_at, channel_id, log_time_ns: time_ns(*time) })
    };
    let is_whole = rest.is_empty() && count.map(|count| count as usize) == Some(entries.len());
    is_whole.then(|| entries.iter().map(entry).collect())?
}

/// Number, topic and type of a connection, which is a channel.
pub(super) fn connection(body: &[u8]) -> Result<(u32, &str, &str), String> {
    let Record { fields, data, .. } = first_record(body).ok_or("a connection is cut")?;
    let number = fields.number("conn").ok_or("a connection has no number")?;
    Ok((number, fields.text("topic")?, Fields(data).text("type")?))
}
