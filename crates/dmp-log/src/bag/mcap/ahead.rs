//! Chunks of a file that is read from start to end: unpacked a few at a time, on the threads of the pool that it is read in.

use super::chunk::{ChunkDecoder, ChunkFault};
use super::records::Source;
use crate::pool;
use rayon::iter::{IntoParallelRefMutIterator as _, ParallelIterator as _};
use std::io;

/// Chunks that are unpacked together, for each thread.
const CHUNKS_A_THREAD: usize = 2;

/// What they take unpacked, for each thread, bytes, but for the last of them: one chunk may take more, as without threads.
const BYTES_A_THREAD: u64 = 4 << 20;

/// Buffers that are larger are given up.
const MOST_KEPT_BYTES: u64 = 2 * BYTES_A_THREAD;

/// Chunks that were read and wait to be unpacked.
#[derive(Debug)]
pub(super) struct Ahead {
    threads: usize,
    /// Those that wait come first; the others lend their buffers to the next.
    chunks: Vec<Coming>,
    waiting: usize,
    bytes: u64,
}

/// A chunk, and what came of it.
#[derive(Debug, Default)]
pub(super) struct Coming {
    pub(super) at: u64,
    pub(super) body_bytes: u64,
    pub(super) decoder: ChunkDecoder,
    pub(super) fault: Option<ChunkFault>,
}

impl Ahead {
    /// For the threads of the pool that this is called in; `None` where it is one, which gains nothing.
    pub(super) fn here() -> Option<Self> {
        let threads = pool::threads();
        (threads > 1).then(|| Self { threads, chunks: Vec::new(), waiting: 0, bytes: 0 })
    }

    /// Reads the chunk at `at`; whether those that wait are enough.
    pub(super) fn read(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<bool> {
        if self.chunks.len() == self.waiting {
            self.chunks.push(Coming::default());
        }
        let Some(chunk) = self.chunks.get_mut(self.waiting) else { return Ok(true) };
        (chunk.at, chunk.body_bytes) = (at, body_bytes);
        chunk.fault = match chunk.decoder.read(source, at, body_bytes) {
            Ok(()) => None,
            Err(ChunkFault::Io(error)) => return Err(error),
            Err(fault) => Some(fault),
        };
        self.waiting += 1;
        self.bytes += chunk.decoder.unpacked_bytes();
        let most = self.threads as u64 * BYTES_A_THREAD;
        Ok(self.waiting == self.threads * CHUNKS_A_THREAD || self.bytes >= most)
    }

    /// Unpacks the chunks that wait: they come in the order of the file.
    pub(super) fn unpack(&mut self) -> &mut [Coming] {
        let waiting = std::mem::take(&mut self.waiting);
        self.bytes = 0;
        let chunks = &mut self.chunks[..waiting];
        chunks.par_iter_mut().filter(|chunk| chunk.fault.is_none()).for_each(|chunk| {
            chunk.fault = chunk.decoder.unpack().err();
        });
        chunks
    }

    /// Gives up buffers of chunks that were larger than most.
    pub(super) fn trim(&mut self) {
        self.chunks.iter_mut().for_each(|chunk| chunk.decoder.trim(MOST_KEPT_BYTES));
    }
}
