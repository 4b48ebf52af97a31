//! Messages of an MCAP file.

mod channels;
mod chunk;
mod heads;
mod part;
mod records;
mod summary_hint;
mod walk;

use super::MessageFault;
use crate::reads::ReadCount;
use chunk::{ChunkDecoder, ChunkFault};
use records::{HEAD_BYTES, Source, split_message};
use std::io;
use std::path::Path;

pub(super) use channels::Channels;
pub(super) use heads::walk_heads;
pub(super) use part::{Record, walk_part};
pub(super) use walk::walk;

/// Where a message is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct McapPlace {
    /// Where the chunk's record starts in the file, or the message's own record outside a chunk.
    pub(super) record_at: u64,
    /// Bytes of that record's body.
    pub(super) record_bytes: u64,
    /// Place of the message's body in the unpacked chunk; `None` outside a chunk.
    pub(super) in_chunk: Option<u64>,
    /// Bytes of the message's body.
    pub(super) body_bytes: u64,
}

/// Reads single messages of a file; keeps the chunk it read last.
#[derive(Debug)]
pub(super) struct McapMessages {
    source: Source,
    decoder: ChunkDecoder,
    /// The chunk that the decoder holds.
    chunk_at: Option<u64>,
    message: Vec<u8>,
}

impl McapMessages {
    pub(super) fn open(path: &Path, count: &ReadCount) -> io::Result<Self> {
        let source = Source::open_for_pieces(path, count)?;
        Ok(Self { source, decoder: ChunkDecoder::default(), chunk_at: None, message: Vec::new() })
    }

    pub(super) fn message(&mut self, place: McapPlace) -> Result<&[u8], MessageFault> {
        let body = if let Some(in_chunk) = place.in_chunk {
            if self.chunk_at != Some(place.record_at) {
                self.chunk_at = None;
                match self.decoder.decode(&mut self.source, place.record_at, place.record_bytes) {
                    Ok(_) => self.chunk_at = Some(place.record_at),
                    Err(ChunkFault::Io(error)) => return Err(error.into()),
                    Err(ChunkFault::Damaged(problem)) => {
                        let problem = format!(
                            "the chunk at byte {} was whole and is not any more: {problem}",
                            place.record_at
                        );
                        return Err(MessageFault::Changed(problem));
                    }
                }
            }
            let rest = self.decoder.records().get(in_chunk as usize..).unwrap_or_default();
            rest.get(..place.body_bytes as usize).unwrap_or_default()
        } else {
            self.source.read_into(place.record_at + HEAD_BYTES, place.body_bytes, &mut self.message)?;
            &self.message
        };
        match split_message(body) {
            Some(message) => Ok(message.data),
            None => Err(MessageFault::Changed("the file has changed since it was opened".into())),
        }
    }
}
