//! Single messages of a file of records.

use super::chunk::{ChunkDecoder, ChunkFault};
use super::framing::Framing;
use super::records::{RecordPlace, Source};
use crate::file::ReadCount;
use crate::messages::bag::basics::MessageFault;
use std::io;
use std::path::Path;

/// Reads single messages of a file; keeps the chunk it read last.
#[derive(Debug)]
pub(in crate::messages::bag) struct ChunkedMessages {
    source: Source,
    decoder: ChunkDecoder,
    /// The chunk that the decoder holds.
    chunk_at: Option<u64>,
    message: Vec<u8>,
}

impl ChunkedMessages {
    pub(in crate::messages::bag) fn open(
        path: &Path,
        framing: Framing,
        count: &ReadCount,
    ) -> io::Result<Self> {
        let source = Source::open_for_pieces(path, framing, count)?;
        Ok(Self { source, decoder: ChunkDecoder::default(), chunk_at: None, message: Vec::new() })
    }

    pub(in crate::messages::bag) fn message(&mut self, place: RecordPlace) -> Result<&[u8], MessageFault> {
        let body = if let Some(in_chunk) = place.in_chunk {
            if self.chunk_at != Some(place.record_at) {
                self.chunk_at = None;
                match self.decoder.decode(&mut self.source, place.record_at, place.record_bytes) {
                    Ok(_) => self.chunk_at = Some(place.record_at),
                    Err(ChunkFault::Io(error)) => return Err(error.into()),
                    Err(ChunkFault::Damaged(problem)) => {
                        let problem = format!("the chunk at byte {} is damaged: {problem}", place.record_at);
                        return Err(MessageFault::Changed(problem));
                    }
                }
            }
            let rest = self.decoder.records().get(in_chunk as usize..).unwrap_or_default();
            rest.get(..place.body_bytes as usize).unwrap_or_default()
        } else {
            let body_at = place.record_at + self.source.framing.head_bytes();
            self.source.read_into(body_at, place.body_bytes, &mut self.message)?;
            &self.message
        };
        match self.source.framing.split_message(body) {
            Some(message) => Ok(message.data),
            None => Err(MessageFault::Changed("the file has changed since it was opened".into())),
        }
    }
}
