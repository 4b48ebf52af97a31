//! A pass over an MCAP file that reads no messages: where they are follows from the message indexes behind
//! the chunks. They lie where a walk from record to record comes by anyhow, so that a file without a summary,
//! and one that was cut short, is passed over as well.

use super::McapPlace;
use super::channels::Channels;
use super::chunk::ChunkFault;
use super::records::{Fields, HEAD_BYTES, MAX_RECORD_BYTES, MESSAGE_HEAD_BYTES, Records, Source};
use super::walk::{Each, Walk};
use crate::bag::FileWalked;
use crate::reads::ReadCount;
use std::io;
use std::path::Path;

/// Bytes of an entry of a message index: time and place.
const ENTRY_BYTES: usize = 16;

/// What a pass over the heads knows beside what every pass finds.
#[derive(Debug, Default)]
pub(in crate::bag) struct HeadsWalked {
    pub(in crate::bag) walked: FileWalked,
    /// For [`super::walk_part`].
    pub(in crate::bag) channels: Channels,
    /// Chunks with messages and without a whole index: they were read.
    pub(in crate::bag) unindexed_chunks: u64,
    /// Chunks read to learn what the channels of their messages are.
    pub(in crate::bag) learnt_chunks: u64,
    /// Messages outside the chunks, which have no checksum of their own.
    pub(in crate::bag) loose_messages: u64,
    /// Messages that the summary counts and no index names.
    pub(in crate::bag) unnamed_messages: u64,
}

/// Passes over the file: of a chunk its index is read, of a message outside the chunks its head. A chunk is
/// read only where it has no index, or to learn what a channel is. Damage within the others is not found.
pub(in crate::bag) fn walk_heads(
    path: &Path,
    count: &ReadCount,
    each: &mut Each<'_>,
) -> io::Result<HeadsWalked> {
    let mut source = Source::open_for_pieces(path, count)?;
    let mut walk = Walk::new(Channels::default(), each);
    walk.heads = Some(Heads::default());
    walk.file(&mut source)?;
    let heads = walk.heads.take().unwrap_or_default();
    let (walked, channels) = walk.found(&source);
    Ok(HeadsWalked {
        walked,
        channels,
        unindexed_chunks: heads.unindexed_chunks,
        learnt_chunks: heads.learnt_chunks,
        loose_messages: heads.loose_messages,
        unnamed_messages: heads.unnamed_messages,
    })
}

/// What a pass over the heads keeps in mind.
#[derive(Debug, Default)]
pub(super) struct Heads {
    /// The chunk that was passed over last, while its index is met.
    chunk: Option<PassedOver>,
    unindexed_chunks: u64,
    learnt_chunks: u64,
    loose_messages: u64,
    unnamed_messages: u64,
}

/// A chunk and what its index says.
#[derive(Debug)]
struct PassedOver {
    at: u64,
    body_bytes: u64,
    entries: Vec<Entry>,
    /// Whether an index was met, and nothing that makes it doubtful.
    is_indexed: bool,
    is_doubtful: bool,
}

/// A message by its index: where in the unpacked chunk its record begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    record_at: u64,
    channel_id: u16,
    log_time_ns: u64,
}

impl Heads {
    /// Something is wrong behind the chunk: its index may not be whole.
    pub(super) fn doubt(&mut self) {
        if let Some(chunk) = &mut self.chunk {
            chunk.is_doubtful = true;
        }
    }

    /// Compares what the summary counts with what was found.
    pub(super) fn compare_count(&mut self, claimed: u64, found: u64) {
        self.unnamed_messages = claimed.saturating_sub(found);
    }
}

impl Walk<'_, '_> {
    /// Leaves a chunk aside until its index is met.
    pub(super) fn pass_over(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        self.settle(source)?;
        if let Some(heads) = &mut self.heads {
            let entries = Vec::new();
            heads.chunk = Some(PassedOver { at, body_bytes, entries, is_indexed: false, is_doubtful: false });
        }
        Ok(())
    }

    /// Reads the index of one channel in the chunk before.
    pub(super) fn message_index(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        let Some(chunk) = self.heads.as_mut().and_then(|heads| heads.chunk.as_mut()) else { return Ok(()) };
        if body_bytes > MAX_RECORD_BYTES {
            chunk.is_doubtful = true;
            return Ok(());
        }
        let mut body = Vec::new();
        source.read_into(at + HEAD_BYTES, body_bytes, &mut body)?;
        match entries_of(&body) {
            Some(mut entries) => {
                chunk.is_indexed = true;
                chunk.entries.append(&mut entries);
            }
            None => chunk.is_doubtful = true,
        }
        Ok(())
    }

    /// Reads the head of a message outside the chunks.
    pub(super) fn message_head(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        self.settle(source)?;
        if let Some(heads) = &mut self.heads {
            heads.loose_messages += 1;
        }
        self.message_up_to(source, at, body_bytes, MESSAGE_HEAD_BYTES as u64)
    }

    /// Hands over what is in the chunk that was left aside: by its index where that can be so, else by reading it.
    pub(super) fn settle(&mut self, source: &mut Source) -> io::Result<()> {
        let Some(mut chunk) = self.heads.as_mut().and_then(|heads| heads.chunk.take()) else { return Ok(()) };
        chunk.entries.sort_unstable();
        let is_twice = chunk.entries.windows(2).any(|pair| pair[0].record_at == pair[1].record_at);
        // A record has a head, and no chunk is larger.
        let is_beyond = chunk.entries.last().is_some_and(|last| last.record_at > MAX_RECORD_BYTES);
        if !chunk.is_indexed || chunk.is_doubtful || is_twice || is_beyond {
            let before = self.messages;
            self.chunk(source, chunk.at, chunk.body_bytes)?;
            if let Some(heads) = self.heads.as_mut().filter(|_| self.messages > before) {
                heads.unindexed_chunks += 1;
            }
            return Ok(());
        }
        if chunk.entries.iter().any(|entry| !self.channels.knows(entry.channel_id)) {
            self.learn_channels(source, &chunk)?;
        }
        for entry in chunk.entries {
            self.messages += 1;
            let place = McapPlace {
                record_at: chunk.at,
                record_bytes: chunk.body_bytes,
                in_chunk: Some(entry.record_at + HEAD_BYTES),
                body_bytes: 0,
            };
            if let Some(channel) = self.channels.of_message(entry.channel_id) {
                (self.each)(channel, entry.log_time_ns, place, &[]);
            }
        }
        Ok(())
    }

    /// Reads a chunk for the channels that are described in it. What is wrong with it is told when its
    /// messages are wanted.
    fn learn_channels(&mut self, source: &mut Source, chunk: &PassedOver) -> io::Result<()> {
        if let Some(heads) = &mut self.heads {
            heads.learnt_chunks += 1;
        }
        match self.decoder.decode(source, chunk.at, chunk.body_bytes) {
            Ok(records) => {
                for (opcode, _, body) in Records::of(records) {
                    let _ = self.channels.describe(opcode, body);
                }
                Ok(())
            }
            Err(ChunkFault::Io(error)) => Err(error),
            Err(ChunkFault::Damaged(_)) => Ok(()),
        }
    }
}

/// The entries of a message index, whose body is a channel's number, a length in bytes, times and places;
/// `None` where it is not whole.
fn entries_of(body: &[u8]) -> Option<Vec<Entry>> {
    let mut fields = Fields(body);
    let channel_id = fields.u16("the index's channel").ok()?;
    let claimed = u32::from_le_bytes(fields.array("the index's length").ok()?);
    let (entries, rest) =
        fields.0.split_at_checked(usize::try_from(claimed).ok()?)?.0.as_chunks::<ENTRY_BYTES>();
    let entry = |entry: &[u8; ENTRY_BYTES]| {
        let (words, _) = entry.as_chunks::<8>();
        let [log_time_ns, record_at] = words else { return None };
        let [log_time_ns, record_at] = [log_time_ns, record_at].map(|word| u64::from_le_bytes(*word));
        Some(Entry { record_at, channel_id, log_time_ns })
    };
    if !rest.is_empty() {
        return None;
    }
    entries.iter().map(entry).collect()
}
