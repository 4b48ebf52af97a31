//! The summary at the end of an MCAP file, the index at that of a bag of ROS 1. The log is read without it; it helps where the data before it
//! is damaged: a channel described only in a lost chunk, a place from which to go on.

use super::framing::{Fields, Framing, HEAD_BYTES};
use super::records::{MAX_RECORD_BYTES, Records, Source};
use super::ros1;
use mcap::records::op;
use std::collections::BTreeSet;
use std::io;

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
        return ros1::read_hint(source);
    }
    let magic = mcap::MAGIC.len() as u64;
    let Some(footer_at) = source.length().checked_sub(HEAD_BYTES + FOOTER_BYTES + magic) else {
        return Ok(SummaryHint::default());
    };
    let mut end = Vec::new();
    source.read_into(footer_at, HEAD_BYTES + FOOTER_BYTES + magic, &mut end)?;
    let Some(Footer { bytes, summary_start, summary_bytes, crc32 }) = footer_of(&end, footer_at) else {
        return Ok(SummaryHint::default());
    };
    let mut summary = Vec::new();
    source.read_into(summary_start, summary_bytes, &mut summary)?;
    let mut hasher = crc32fast::Hasher::new_with_initial(0);
    hasher.update(&summary);
    // The checksum covers the footer up to itself.
    hasher.update(&bytes[..bytes.len() - 4]);
    Ok(if hasher.finalize() == crc32 { hint_of(&summary) } else { SummaryHint::default() })
}

/// The record at the end of a file with a summary.
struct Footer<'a> {
    bytes: &'a [u8],
    summary_start: u64,
    summary_bytes: u64,
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
    let summary_bytes = footer_at.checked_sub(summary_start)?;
    let is_there =
        opcode == op::FOOTER && summary_start != 0 && crc32 != 0 && summary_bytes <= MAX_RECORD_BYTES;
    is_there.then_some(Footer { bytes: footer, summary_start, summary_bytes, crc32 })
}

fn hint_of(summary: &[u8]) -> SummaryHint {
    let mut hint = SummaryHint::default();
    for (opcode, _, body) in Records::of(Framing::Mcap, summary) {
        match opcode {
            op::SCHEMA | op::CHANNEL => hint.descriptions.push((opcode, body.to_vec())),
            // The first of its fields.
            op::STATISTICS => hint.messages = Fields(body).u64("the count of messages").ok(),
            op::CHUNK_INDEX => {
                // Behind the times of its first and last message.
                let times_and_start: Option<(&[u8; 16], &[u8])> = body.split_first_chunk();
                if let Some(Ok(at)) = times_and_start.map(|(_, rest)| Fields(rest).u64("a chunk's start")) {
                    hint.chunks_at.insert(at);
                }
            }
            _ => {}
        }
    }
    hint
}
