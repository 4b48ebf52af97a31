//! The summary at the end of an MCAP file, the index at that of a bag of ROS 1. The log is read without it; it helps where the data before it
//! is damaged: a channel described only in a lost chunk, a place from which to go on.

use super::framing::{Fields, Framing, HEAD_BYTES, ROS1_BAG, ROS1_CHUNK_INFO, ROS1_CONNECTION};
use super::records::{MAX_RECORD_BYTES, Records, Source};
use super::ros1;
use mcap::records::op;
use std::collections::BTreeSet;
use std::io;
use std::ops::Range;

/// Bytes of the footer's body and of the magic behind it.
const FOOTER_BYTES: u64 = 20;

/// What a whole summary says.
#[derive(Debug, Default)]
pub(super) struct SummaryHint {
    /// Schema and channel records: type and body.
    pub(super) descriptions: Vec<(u8, Vec<u8>)>,
    pub(super) chunks_at: BTreeSet<u64>,
    pub(super) messages: Option<u64>,
    /// Where the index of a bag of ROS 1 begins, behind all chunks, as its first record says.
    pub(super) index_at: Option<u64>,
    pub(super) is_index_whole: bool,
}

/// Reads the summary; nothing where there is none, or where its checksum is wrong or missing.
pub(super) fn read(source: &mut Source) -> io::Result<SummaryHint> {
    if source.framing == Framing::Ros1 {
        return read_ros1(source);
    }
    let magic = mcap::MAGIC.len() as u64;
    let Some(footer_at) = source.length().checked_sub(HEAD_BYTES + FOOTER_BYTES + magic) else {
        return Ok(SummaryHint::default());
    };
    let mut end = Vec::new();
    source.read_into(footer_at, HEAD_BYTES + FOOTER_BYTES + magic, &mut end)?;
    let Some(Footer { bytes, summary_start, crc32 }) = footer_of(&end, footer_at) else {
        return Ok(SummaryHint::default());
    };
    let (mut hint, mut hasher) = (SummaryHint::default(), crc32fast::Hasher::new());
    let is_whole = each_record(source, summary_start..footer_at, &mut |record| {
        hasher.update(record);
        hint.take(record);
    })?;
    // The checksum covers the footer up to itself.
    hasher.update(&bytes[..bytes.len() - 4]);
    Ok(if is_whole && hasher.finalize() == crc32 { hint } else { SummaryHint::default() })
}

/// Reads records one at a time, each with its head: a summary may be larger than the memory. Whether all of them are whole.
fn each_record(source: &mut Source, range: Range<u64>, each: &mut dyn FnMut(&[u8])) -> io::Result<bool> {
    let (mut at, mut record) = (range.start, Vec::new());
    while at < range.end {
        if range.end - at < HEAD_BYTES {
            return Ok(false);
        }
        let (opcode, body_bytes) = source.head_at(at)?;
        let bytes = body_bytes.saturating_add(source.framing.head_bytes());
        if opcode == 0 || bytes > MAX_RECORD_BYTES.min(range.end - at) {
            return Ok(false);
        }
        source.read_into(at, bytes, &mut record)?;
        each(&record);
        at += bytes;
    }
    Ok(true)
}

/// The record at the end of a file with a summary.
struct Footer<'a> {
    bytes: &'a [u8],
    summary_start: u64,
    crc32: u32,
}

/// `None` where there is no summary, or none with a checksum.
fn footer_of(end: &[u8], footer_at: u64) -> Option<Footer<'_>> {
    let (footer, end_magic) = end.split_at_checked((HEAD_BYTES + FOOTER_BYTES) as usize)?;
    if end_magic != mcap::MAGIC {
        return None;
    }
    let (opcode, _, body) = Records::of(Framing::Mcap, footer).next()?;
    let mut fields = Fields(body);
    let summary_start = fields.u64("the summary's start").ok()?;
    let _offsets_start = fields.u64("the start of the summary's offsets").ok()?;
    let crc32 = u32::from_le_bytes(fields.array("the summary's CRC").ok()?);
    let is_there = opcode == op::FOOTER && (1..=footer_at).contains(&summary_start) && crc32 != 0;
    is_there.then_some(Footer { bytes: footer, summary_start, crc32 })
}

impl SummaryHint {
    /// Takes in a record of MCAP.
    fn take(&mut self, record: &[u8]) {
        let Some((opcode, body)) = Framing::Mcap.first_record(record) else { return };
        match opcode {
            op::SCHEMA | op::CHANNEL => self.descriptions.push((opcode, body.to_vec())),
            // The first of its fields.
            op::STATISTICS => self.messages = Fields(body).u64("the count of messages").ok(),
            op::CHUNK_INDEX => {
                // Behind the times of its first and last message.
                let times_and_start: Option<(&[u8; 16], &[u8])> = body.split_first_chunk();
                if let Some(Ok(at)) = times_and_start.map(|(_, rest)| Fields(rest).u64("a chunk's start")) {
                    self.chunks_at.insert(at);
                }
            }
            _ => {}
        }
    }
}

/// Reads the index at the end of the bag: nothing of it is used where it is not whole.
fn read_ros1(source: &mut Source) -> io::Result<SummaryHint> {
    let mut hint = SummaryHint::default();
    let Some(head) = source.ros1_head_at(source.framing.magic().len() as u64)? else { return Ok(hint) };
    let fields = ros1::Fields(&head.fields);
    if fields.opcode() != ROS1_BAG {
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
    let (mut connections, mut chunks, mut messages, mut is_known) = (0, 0, 0, true);
    let mut found = SummaryHint { index_at: hint.index_at, is_index_whole: true, ..SummaryHint::default() };
    let is_whole = each_record(source, index_at..source.length(), &mut |record| {
        let Some(ros1::Record { fields, data, .. }) = ros1::first_record(record) else { return };
        match (fields.opcode(), fields.place("chunk_pos")) {
            (ROS1_CONNECTION, _) => {
                connections += 1;
                found.descriptions.push((ROS1_CONNECTION, record.to_vec()));
            }
            (ROS1_CHUNK_INFO, Some(at)) => {
                chunks += 1;
                found.chunks_at.insert(at);
                // Number of the connection, and how many messages it has in the chunk.
                let (counts, _) = data.as_chunks::<8>();
                messages += counts.iter().map(|count| u64::from_le_bytes(*count) >> 32).sum::<u64>();
            }
            _ => is_known = false,
        }
    })?;
    found.messages = Some(messages);
    Ok(if is_whole && is_known && counts == [Some(connections), Some(chunks)] { found } else { hint })
}
