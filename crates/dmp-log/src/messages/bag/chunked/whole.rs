//! A pass over a whole file, from record to record: [`read_whole`] reads everything, [`read_heads`] passes over the
//! chunks and reads their indexes instead.

use super::ahead::Ahead;
use super::channels::Channels;
use super::framing::{Framing, HEAD_BYTES, Kind};
use super::message_index::Heads;
use super::pass::{Each, Pass};
use super::records::Source;
use super::summary_hint::{self, SummaryHint};
use crate::file::ReadCount;
use crate::messages::bag::basics::{Channel, FileFound};
use dmp_lengths::thousands;
use std::io;
use std::path::Path;

/// Reads the whole file once, one chunk at a time, or a few in a pool with several threads. What is found is the same. Only the
/// operating system makes it fail: whatever is wrong with the bytes is damage. Messages of which a start is enough may come with
/// zeros behind it; then their chunk was not checked.
pub(in crate::messages::bag) fn read_whole(
    path: &Path,
    framing: Framing,
    count: &ReadCount,
    start_is_enough: Option<fn(&Channel) -> bool>,
    each: &mut Each<'_>,
) -> io::Result<FileFound> {
    let mut source = Source::open(path, framing, count)?;
    let mut pass = Pass::new(framing, Channels::default(), each);
    pass.ahead = Ahead::here();
    pass.start_is_enough = start_is_enough;
    pass.file(&mut source)?;
    Ok(pass.found(&source).0)
}

/// What a pass over the heads knows beside what every pass finds.
#[derive(Debug, Default)]
pub(in crate::messages::bag) struct HeadsFound {
    pub(in crate::messages::bag) found: FileFound,
    /// For [`super::read_part`].
    pub(in crate::messages::bag) channels: Channels,
    pub(in crate::messages::bag) heads: Heads,
}

/// Passes over the file: of a chunk its index is read, of a message outside the chunks its head. A chunk is
/// read only where it has no index, or to learn what a channel is. Damage within the others is not found.
pub(in crate::messages::bag) fn read_heads(
    path: &Path,
    framing: Framing,
    count: &ReadCount,
    each: &mut Each<'_>,
) -> io::Result<HeadsFound> {
    let mut source = Source::open_for_pieces(path, framing, count)?;
    let mut pass = Pass::new(framing, Channels::default(), each);
    pass.heads = Some(Heads::default());
    pass.file(&mut source)?;
    let heads = pass.heads.take().unwrap_or_default();
    let (found, channels) = pass.found(&source);
    Ok(HeadsFound { found, channels, heads })
}

impl Pass<'_, '_> {
    fn file(&mut self, source: &mut Source) -> io::Result<()> {
        let mut hint = summary_hint::read(source)?;
        for (opcode, body) in &hint.descriptions {
            // A hint that cannot be read is none.
            let _ = self.channels.describe(self.framing, *opcode, body);
        }
        self.records(source, &mut hint)?;
        self.take_ahead()?;
        self.settle(source)?;
        let unmet = hint.messages.unwrap_or(0).saturating_sub(self.messages);
        if let Some(heads) = &mut self.heads {
            heads.unnamed_messages = unmet;
        } else if let (1.., Some(index_at), true) = (unmet, hint.index_at, self.damage.is_empty()) {
            self.lost(index_at, format!("{} messages that the index counts are not there", thousands(unmet)));
        }
        Ok(())
    }

    fn records(&mut self, source: &mut Source, hint: &mut SummaryHint) -> io::Result<()> {
        let length = source.length();
        let mut at = self.framing.magic().len() as u64;
        let head_bytes = self.framing.head_bytes();
        loop {
            if length.saturating_sub(at) < HEAD_BYTES {
                self.take_ahead()?;
                let end = self.framing.end_in_words();
                let what =
                    format!("the file ends at byte {length} without {end}: what was to follow is lost");
                self.lost(at, what);
                return Ok(());
            }
            let (opcode, body_bytes) = source.head_at(at)?;
            let kind = self.framing.kind(opcode);
            if hint.index_at == Some(at) && !matches!(kind, Kind::Chunk | Kind::MessageIndex | Kind::Message)
            {
                self.take_ahead()?;
                if !hint.is_index_whole {
                    self.lost(at, "the index at the end is cut or damaged; no scan is lost by it".to_owned());
                }
                return Ok(());
            }
            let left = length - at - head_bytes;
            // A record cannot contain the start of a chunk that the summary, which is whole, knows.
            let next_chunk = hint.chunks_at.range(at + 1..).next().copied().filter(|&next| next < length);
            let reaches = body_bytes.min(left) + at + head_bytes;
            if opcode == 0 || body_bytes > left || next_chunk.is_some_and(|next| next < reaches) {
                // Nothing guards the index of a bag of ROS 1: there may be no chunk.
                if let Some(next) = next_chunk
                    && (length - next < HEAD_BYTES
                        || self.framing.kind(source.head_at(next)?.0) != Kind::Chunk)
                {
                    hint.chunks_at.remove(&next);
                    continue;
                }
                self.take_ahead()?;
                let claimed = thousands(body_bytes);
                let Some(next) = next_chunk else {
                    let what = format!(
                        "a record of type {opcode:#04x} claims {claimed} bytes and the file ends at byte {length}: \
                         the tail is lost"
                    );
                    self.lost(at, what);
                    return Ok(());
                };
                let what = format!(
                    "a record of type {opcode:#04x} claims {claimed} bytes, past the chunk at byte {next}: \
                     what lies between is lost"
                );
                self.lost(at, what);
                at = next;
                continue;
            }
            match kind {
                Kind::Chunk if self.heads.is_some() => self.pass_over(source, at, body_bytes)?,
                Kind::Chunk => self.chunk_ahead(source, at, body_bytes)?,
                Kind::MessageIndex if self.heads.is_some() => self.message_index(source, at, body_bytes)?,
                Kind::Message if self.heads.is_some() => self.message_head(source, at, body_bytes)?,
                Kind::Message => {
                    self.take_ahead()?;
                    self.message(source, at, body_bytes)?;
                }
                Kind::Description => {
                    self.take_ahead()?;
                    self.description(source, at, body_bytes)?;
                }
                Kind::EndOfData => {
                    self.take_ahead()?;
                    return self.end_of_data(source, at, body_bytes);
                }
                Kind::Footer => return Ok(()),
                Kind::Unknown => {
                    self.take_ahead()?;
                    let bytes = thousands(body_bytes);
                    self.lost(
                        at,
                        format!("a record of {bytes} bytes and unknown type {opcode:#04x} is skipped"),
                    );
                }
                Kind::MessageIndex | Kind::Other => {}
            }
            at += head_bytes + body_bytes;
        }
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
        self.data_crc_compared = true;
        if crc != claimed {
            let crcs = format!("the CRC of the data is {crc:08x}, the file says {claimed:08x}");
            self.lost(at, format!("{crcs}: some message is wrong"));
        }
        Ok(())
    }
}
