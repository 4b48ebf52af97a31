//! Passing over chunks without reading them: where their messages are follows from the message indexes behind them.
//! These lie where a pass from record to record comes by anyhow, so that a file without a summary, and one that was
//! cut short, is passed over as well.

use super::chunk::ChunkFault;
use super::framing::Kind;
use super::message_index::PassedOver;
use super::pass::Pass;
use super::records::{MAX_RECORD_BYTES, RecordPlace, Records, Source};
use std::io;

impl Pass<'_, '_> {
    /// Leaves a chunk aside until its index is met.
    pub(super) fn pass_over(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        self.settle(source)?;
        self.decoder.pass_over(source, at, body_bytes)?;
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
        source.read_into(at + self.framing.head_bytes(), body_bytes, &mut body)?;
        match self.framing.entries_of(&body) {
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
        let read_bytes = self.framing.message_head_bytes().unwrap_or(body_bytes);
        self.message_up_to(source, at, body_bytes, read_bytes)
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
            let place = RecordPlace {
                record_at: chunk.at,
                record_bytes: chunk.body_bytes,
                in_chunk: Some(entry.record_at + self.framing.head_bytes()),
                body_bytes: 0,
            };
            if let Some(channel) = self.channels.of_message(entry.channel_id) {
                (self.each)(channel, entry.log_time_ns, place, &[]);
            }
        }
        Ok(())
    }

    /// Reads a chunk for the channels that are described in it. What is wrong with it is reported when its
    /// messages are wanted.
    fn learn_channels(&mut self, source: &mut Source, chunk: &PassedOver) -> io::Result<()> {
        if let Some(heads) = &mut self.heads {
            heads.learnt_chunks += 1;
        }
        match self.decoder.decode(source, chunk.at, chunk.body_bytes) {
            Ok(records) => {
                let all = Records::of(self.framing, records);
                let is_description = |opcode| self.framing.kind(opcode) == Kind::Description;
                for (opcode, _, body) in all.filter(|(opcode, ..)| is_description(*opcode)) {
                    let _ = self.channels.describe(self.framing, opcode, body);
                }
                Ok(())
            }
            Err(ChunkFault::Io(error)) => Err(error),
            Err(ChunkFault::Damaged(_)) => Ok(()),
        }
    }
}
