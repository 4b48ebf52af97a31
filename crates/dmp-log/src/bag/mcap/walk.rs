//! One pass over an MCAP file: which messages it has and where they are.
//!
//! [`walk`] reads everything; [`super::walk_heads`] passes over the chunks and reads their indexes instead;
//! [`super::walk_part`] reads some chunks and nothing else. What a record is, and what is damage in it, is
//! said once, here.

use super::McapPlace;
use super::channels::Channels;
use super::chunk::{ChunkDecoder, ChunkFault};
use super::heads::Heads;
use super::records::{HEAD_BYTES, MAX_RECORD_BYTES, MESSAGE_HEAD_BYTES, Records, Source, split_message};
use super::summary_hint::{self, SummaryHint};
use crate::Damage;
use crate::bag::{Channel, FileWalked};
use crate::damage::DamageList;
use crate::reads::ReadCount;
use mcap::records::op;
use std::io;
use std::path::Path;

/// Largest schema or channel record outside a chunk that is read.
const MAX_DESCRIPTION_BYTES: u64 = 16 << 20;

/// What is done with a message: its channel, the time it was recorded, its place, its body. Where only heads
/// are read the body is empty, and the place of a message in a chunk lacks its length.
pub(super) type Each<'a> = dyn FnMut(&Channel, u64, McapPlace, &[u8]) + 'a;

/// Reads the whole file once, one chunk at a time. Only the operating system makes it fail: whatever is
/// wrong with the bytes is damage.
pub(in crate::bag) fn walk(path: &Path, count: &ReadCount, each: &mut Each<'_>) -> io::Result<FileWalked> {
    let mut source = Source::open(path, count)?;
    let mut walk = Walk::new(Channels::default(), each);
    walk.file(&mut source)?;
    Ok(walk.found(&source).0)
}

/// A pass, and what it has found so far.
pub(super) struct Walk<'a, 'b> {
    pub(super) channels: Channels,
    pub(super) damage: DamageList,
    pub(super) decoder: ChunkDecoder,
    pub(super) each: &'a mut Each<'b>,
    /// Messages handed over, also those of unknown channels.
    pub(super) messages: u64,
    /// Where chunks are passed over.
    pub(super) heads: Option<Heads>,
    unchunked_messages: bool,
}

impl<'a, 'b> Walk<'a, 'b> {
    pub(super) fn new(channels: Channels, each: &'a mut Each<'b>) -> Self {
        Self {
            channels,
            damage: DamageList::default(),
            decoder: ChunkDecoder::default(),
            each,
            messages: 0,
            heads: None,
            unchunked_messages: false,
        }
    }

    /// What was found in a file that was gone through, and the channels by number.
    pub(super) fn found(mut self, source: &Source) -> (FileWalked, Channels) {
        for (id, count) in self.channels.unknown() {
            let what = format!("{count} messages of a channel that is not described before them are lost");
            self.damage.push(Damage::new(format!("channel {id}"), what));
        }
        let walked =
            FileWalked { channels: self.channels.described(), damage: self.damage, bytes: source.length() };
        (walked, self.channels)
    }
}

impl Walk<'_, '_> {
    /// Goes through the whole file.
    pub(super) fn file(&mut self, source: &mut Source) -> io::Result<()> {
        let hint = summary_hint::read(source);
        for (opcode, body) in &hint.descriptions {
            // A hint that cannot be read is none.
            let _ = self.channels.describe(*opcode, body);
        }
        self.records(source, &hint)?;
        self.settle(source)?;
        if let (Some(heads), Some(messages)) = (&mut self.heads, hint.messages) {
            heads.compare_count(messages, self.messages);
        }
        Ok(())
    }

    fn records(&mut self, source: &mut Source, hint: &SummaryHint) -> io::Result<()> {
        let length = source.length();
        let mut at = mcap::MAGIC.len() as u64;
        loop {
            if length.saturating_sub(at) < HEAD_BYTES {
                let what = format!(
                    "the file ends at byte {length} without an end of data: what was to follow is lost"
                );
                self.lost(at, what);
                return Ok(());
            }
            let (opcode, body_bytes) = source.head_at(at)?;
            let left = length - at - HEAD_BYTES;
            // A record cannot contain the start of a chunk that the summary, which is whole, knows.
            let next_chunk = hint.chunks_at.range(at + 1..).next().copied().filter(|&next| next < length);
            let reaches = body_bytes.min(left) + at + HEAD_BYTES;
            if opcode == 0 || body_bytes > left || next_chunk.is_some_and(|next| next < reaches) {
                let Some(next) = next_chunk else {
                    let what = format!(
                        "a record of type {opcode:#04x} claims {body_bytes} bytes and the file ends at byte {length}: \
                         the tail is lost"
                    );
                    self.lost(at, what);
                    return Ok(());
                };
                let what = format!(
                    "a record of type {opcode:#04x} claims {body_bytes} bytes, past the chunk at byte {next}: \
                     what lies between is lost"
                );
                self.lost(at, what);
                at = next;
                continue;
            }
            match opcode {
                op::CHUNK if self.heads.is_some() => self.pass_over(source, at, body_bytes)?,
                op::CHUNK => drop(self.chunk(source, at, body_bytes)?),
                op::MESSAGE_INDEX if self.heads.is_some() => self.message_index(source, at, body_bytes)?,
                op::MESSAGE if self.heads.is_some() => self.message_head(source, at, body_bytes)?,
                op::MESSAGE => self.message(source, at, body_bytes)?,
                _ if Channels::is_description(opcode) => self.description(source, at, body_bytes)?,
                op::DATA_END => return self.end_of_data(source, at, body_bytes),
                op::FOOTER => return Ok(()),
                // Indices, attachments, metadata and types of other programs.
                _ => {}
            }
            at += HEAD_BYTES + body_bytes;
        }
    }

    pub(super) fn lost(&mut self, at: u64, what: String) {
        if let Some(heads) = &mut self.heads {
            heads.doubt();
        }
        self.damage.push(Damage::new(format!("byte {at}"), what));
    }

    /// Reads a chunk; whether it is whole.
    pub(super) fn chunk(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<bool> {
        // Lent to this chunk: its records are looked at while the walk takes note of them.
        let mut decoder = std::mem::take(&mut self.decoder);
        let decoded =
            decoder.decode(source, at, body_bytes).map(|records| self.records_of(records, at, body_bytes));
        self.decoder = decoder;
        match decoded {
            Ok(()) => Ok(true),
            Err(ChunkFault::Io(error)) => Err(error),
            Err(ChunkFault::Damaged(problem)) => {
                self.lost(at, format!("a chunk of {body_bytes} bytes is damaged and skipped: {problem}"));
                Ok(false)
            }
        }
    }

    fn records_of(&mut self, records: &[u8], at: u64, body_bytes: u64) {
        let mut walk = Records::of(records);
        for (opcode, place, body) in &mut walk {
            if Channels::is_description(opcode) {
                if let Err(problem) = self.channels.describe(opcode, body) {
                    self.lost(at, format!("in the chunk: {problem}"));
                }
            } else if opcode == op::MESSAGE {
                let place = McapPlace {
                    record_at: at,
                    record_bytes: body_bytes,
                    in_chunk: Some(place),
                    body_bytes: body.len() as u64,
                };
                self.add(place, body);
            }
        }
        let rest = walk.rest();
        if rest > 0 {
            self.lost(at, format!("the last {rest} bytes of the chunk are no whole record and are lost"));
        }
    }

    /// Reads a message outside the chunks.
    pub(super) fn message(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        self.message_up_to(source, at, body_bytes, body_bytes)
    }

    /// Reads a message outside the chunks as far as its first `read_bytes` bytes.
    pub(super) fn message_up_to(
        &mut self,
        source: &mut Source,
        at: u64,
        body_bytes: u64,
        read_bytes: u64,
    ) -> io::Result<()> {
        self.unchunked_messages = true;
        if !(MESSAGE_HEAD_BYTES as u64..=MAX_RECORD_BYTES).contains(&body_bytes) {
            self.lost(at, format!("a message of {body_bytes} bytes is not read"));
            return Ok(());
        }
        let mut body = Vec::new();
        source.read_into(at + HEAD_BYTES, read_bytes, &mut body)?;
        let place = McapPlace { record_at: at, record_bytes: body_bytes, in_chunk: None, body_bytes };
        self.add(place, &body);
        Ok(())
    }

    fn add(&mut self, place: McapPlace, body: &[u8]) {
        let Some(message) = split_message(body) else {
            let what = format!("a message of {} bytes is shorter than its header", body.len());
            return self.lost(place.record_at, what);
        };
        self.messages += 1;
        if let Some(channel) = self.channels.of_message(message.channel_id) {
            (self.each)(channel, message.log_time_ns, place, message.data);
        }
    }

    fn description(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        if body_bytes > MAX_DESCRIPTION_BYTES {
            self.lost(at, format!("a channel or schema of {body_bytes} bytes is not read"));
            return Ok(());
        }
        let mut body = Vec::new();
        source.read_into(at + HEAD_BYTES, body_bytes, &mut body)?;
        let (opcode, _) = source.head_at(at)?;
        if let Err(problem) = self.channels.describe(opcode, &body) {
            self.lost(at, problem);
        }
        Ok(())
    }

    /// Compares the checksum of the data, which is the only one that messages outside chunks have, and
    /// looks whether the file was finished.
    fn end_of_data(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        let magic = mcap::MAGIC.len() as u64;
        let mut end = Vec::new();
        source.read_into(source.length().saturating_sub(magic), magic.min(source.length()), &mut end)?;
        if end != mcap::MAGIC {
            let length = source.length();
            self.lost(
                at,
                format!("the file ends at byte {length} inside its summary; no scan is lost by it"),
            );
        }
        if !self.unchunked_messages || body_bytes != 4 || self.heads.is_some() {
            return Ok(());
        }
        let mut claimed = [0; 4];
        source.read_at(at + HEAD_BYTES, &mut claimed)?;
        let claimed = u32::from_le_bytes(claimed);
        if claimed == 0 {
            return Ok(());
        }
        let mut hasher = crc32fast::Hasher::new();
        let (mut from, mut piece) = (0, Vec::new());
        while from < at {
            let count = (at - from).min(1 << 20);
            source.read_into(from, count, &mut piece)?;
            hasher.update(&piece);
            from += count;
        }
        let crc = hasher.finalize();
        if crc != claimed {
            self.lost(
                at,
                format!(
                    "the CRC of the data is {crc:08x}, the file says {claimed:08x}: some message is wrong"
                ),
            );
        }
        Ok(())
    }
}
