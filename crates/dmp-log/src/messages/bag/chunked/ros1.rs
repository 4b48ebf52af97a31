//! Bags of ROS 1, version 2.0: a record is a header of named fields, and data, each behind its length.
//!
//! Chunks come first, each with an index of its messages behind it, then the descriptions of all topics and where the chunks
//! are. Layout: <http://wiki.ros.org/Bags/Format/2.0>.

use super::framing::Kind;
use super::message_index::Entry;
use super::records::{MAX_RECORD_BYTES, MessageRecord, Records, Source};
use super::summary_hint::SummaryHint;
use std::io;

/// The first bytes of a bag.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Largest header that is read. The longest field is the name of a topic.
const MAX_HEADER_BYTES: u64 = 1 << 16;

const BAG: u8 = 0x03;
const CHUNK_INFO: u8 = 0x06;
const CONNECTION: u8 = 0x07;

pub(super) fn kind(opcode: u8) -> Kind {
    match opcode {
        0x02 => Kind::Message,
        0x04 => Kind::MessageIndex,
        0x05 => Kind::Chunk,
        CONNECTION => Kind::Description,
        BAG | CHUNK_INFO => Kind::Other,
        _ => Kind::Unknown,
    }
}

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

    fn place(self, name: &str) -> Option<u64> {
        self.array(name).map(u64::from_le_bytes)
    }

    fn text(self, name: &str) -> Result<&'a str, String> {
        let value = self.get(name).ok_or_else(|| format!("a connection has no `{name}`"))?;
        std::str::from_utf8(value).map_err(|_| format!("the `{name}` of a connection is not text"))
    }

    fn opcode(self) -> u8 {
        self.array("op").map_or(0, |[opcode]| opcode)
    }
}

/// A record taken apart.
#[derive(Debug)]
pub(super) struct Record<'a> {
    fields: Fields<'a>,
    data: &'a [u8],
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

/// What is in front of a record's data.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) fields: Vec<u8>,
    pub(super) data_at: u64,
    pub(super) data_bytes: u64,
}

/// The head of the record at `at`; `None` where that is none, or the file ends in it.
pub(super) fn head_at(source: &mut Source, at: u64) -> io::Result<Option<Head>> {
    let mut length = |at: u64| -> io::Result<Option<u64>> {
        if source.length().saturating_sub(at) < 4 {
            return Ok(None);
        }
        let mut length = [0; 4];
        source.read_at(at, &mut length)?;
        Ok(Some(u32::from_le_bytes(length).into()))
    };
    let Some(header_bytes) = length(at)?.filter(|&bytes| bytes <= MAX_HEADER_BYTES) else { return Ok(None) };
    let data_at = at + 8 + header_bytes;
    let Some(data_bytes) = length(data_at - 4)? else { return Ok(None) };
    let mut fields = Vec::new();
    source.read_into(at + 4, header_bytes, &mut fields)?;
    Ok(Some(Head { fields, data_at, data_bytes }))
}

/// Type and bytes of the record at `at`; a type of 0 where that is none.
pub(super) fn type_at(source: &mut Source, at: u64) -> io::Result<(u8, u64)> {
    let head = head_at(source, at)?;
    Ok(head.map_or((0, 0), |head| (Fields(&head.fields).opcode(), head.data_at - at + head.data_bytes)))
}

/// Number, topic and type of a connection, which is a channel.
pub(super) fn connection(body: &[u8]) -> Result<(u32, &str, &str), String> {
    let Record { fields, data, .. } = first_record(body).ok_or("a connection is cut")?;
    let number = fields.number("conn").ok_or("a connection has no number")?;
    Ok((number, fields.text("topic")?, Fields(data).text("type")?))
}

/// Reads the index at the end of the bag: nothing of it is used where it is not whole.
pub(super) fn read_hint(source: &mut Source) -> io::Result<SummaryHint> {
    let mut hint = SummaryHint::default();
    let Some(head) = head_at(source, MAGIC.len() as u64)? else { return Ok(hint) };
    let fields = Fields(&head.fields);
    if fields.opcode() != BAG {
        return Ok(hint);
    }
    if fields.get("encryptor").is_some_and(|name| !name.is_empty()) {
        return Err(io::Error::other("as a ROS 1 bag: it is encrypted: decrypt it with `rosbag decrypt`"));
    }
    let counts = ["conn_count", "chunk_count"].map(|name| fields.number(name));
    // 0 in a bag that was not closed.
    let behind = head.data_at + head.data_bytes..source.length();
    let Some(index_at) = fields.place("index_pos").filter(|at| behind.contains(at)) else {
        return Ok(hint);
    };
    hint.index_at = Some(index_at);
    let index_bytes = source.length() - index_at;
    if index_bytes > MAX_RECORD_BYTES {
        return Ok(hint);
    }
    let mut index = Vec::new();
    source.read_into(index_at, index_bytes, &mut index)?;
    let mut records = Records::of(source.framing, &index);
    let (mut connections, mut chunks, mut messages) = (0, 0, 0);
    let mut found = SummaryHint { index_at: hint.index_at, is_index_whole: true, ..SummaryHint::default() };
    for (opcode, _, body) in &mut records {
        let Some(Record { fields, data, .. }) = first_record(body) else { return Ok(hint) };
        if opcode == CONNECTION {
            connections += 1;
            found.descriptions.push((opcode, body.to_vec()));
            continue;
        }
        let (CHUNK_INFO, Some(at)) = (opcode, fields.place("chunk_pos")) else { return Ok(hint) };
        chunks += 1;
        found.chunks_at.insert(at);
        // Number of the connection, and how many messages it has in the chunk.
        let (counts, _) = data.as_chunks::<8>();
        messages += counts.iter().map(|count| u64::from_le_bytes(*count) >> 32).sum::<u64>();
    }
    found.messages = Some(messages);
    let is_whole = records.rest() == 0 && counts == [Some(connections), Some(chunks)];
    Ok(if is_whole { found } else { hint })
}
