//! Chunks of a file that is read from start to end: unpacked a few at a time, on the threads of the pool that it is read in.

use super::chunk::{ChunkDecoder, ChunkFault};
use super::last_message::StartIsEnough;
use super::records::Source;
use crate::file::pool;
use rayon::iter::{IntoParallelRefMutIterator as _, ParallelIterator as _};
use std::io;

/// Chunks that are unpacked together, for each thread.
const CHUNKS_A_THREAD: usize = 2;

/// What they take, packed or unpacked, whichever is more, for each thread, bytes, but for the last of them: one chunk may take
/// more, as without threads.
const BYTES_A_THREAD: u64 = 4 << 20;

/// Buffers that together take more, for each thread, are given up.
const KEPT_A_THREAD: u64 = 2 * BYTES_A_THREAD;

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
    pub(super) fn read(
        &mut self,
        source: &mut Source,
        at: u64,
        body_bytes: u64,
        enough: Option<StartIsEnough<'_>>,
    ) -> io::Result<bool> {
        if self.chunks.len() == self.waiting {
            self.chunks.push(Coming::default());
        }
        let Some(chunk) = self.chunks.get_mut(self.waiting) else { return Ok(true) };
        (chunk.at, chunk.body_bytes) = (at, body_bytes);
        chunk.fault = match chunk.decoder.read(source, at, body_bytes, enough) {
            Ok(()) => None,
            Err(ChunkFault::Io(error)) => return Err(error),
            Err(fault) => Some(fault),
        };
        self.waiting += 1;
        self.bytes += chunk.decoder.bytes();
        let most = self.threads as u64 * BYTES_A_THREAD;
        Ok(self.waiting == self.threads * CHUNKS_A_THREAD || self.bytes >= most)
    }

    /// Unpacks the chunks that wait: they come in the order of the file.
    pub(super) fn unpack(&mut self, enough: Option<StartIsEnough<'_>>) -> &mut [Coming] {
        let waiting = std::mem::take(&mut self.waiting);
        self.bytes = 0;
        let chunks = &mut self.chunks[..waiting];
        chunks.par_iter_mut().filter(|chunk| chunk.fault.is_none()).for_each(|chunk| {
            chunk.fault = chunk.decoder.unpack(enough).err();
        });
        chunks
    }

    /// Gives up buffers that became too large.
    pub(super) fn trim(&mut self) {
        let kept_bytes: u64 = self.chunks.iter().map(|chunk| chunk.decoder.kept_bytes()).sum();
        if kept_bytes > self.threads as u64 * KEPT_A_THREAD {
            self.chunks.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::ReadCount;
    use crate::messages::bag::chunked::Framing;
    use std::io::Write as _;

    /// A file of one chunk that claims to be empty and holds this many zeros, packed.
    fn hollow(packed_bytes: u64) -> (tempfile::NamedTempFile, u64) {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let head: [&[u8]; 5] = [&[0; 9], &[0; 28], &4u32.to_le_bytes(), b"zstd", &packed_bytes.to_le_bytes()];
        head.iter().for_each(|bytes| file.write_all(bytes).unwrap());
        let body_bytes = 28 + 4 + 4 + 8 + packed_bytes;
        file.as_file().set_len(9 + body_bytes).unwrap();
        (file, body_bytes)
    }

    #[test]
    fn what_waits_and_what_is_kept_is_bounded_whatever_headers_claim() {
        let mut ahead = Ahead { threads: 2, chunks: Vec::new(), waiting: 0, bytes: 0 };
        for (packed_bytes, enough) in [(5 << 20, 2), (20 << 20, 1), (1 << 10, 4)] {
            let (file, body_bytes) = hollow(packed_bytes);
            let mut source = Source::open(file.path(), Framing::Mcap, &ReadCount::default()).unwrap();
            let read = |_: &usize| ahead.read(&mut source, 0, body_bytes, None).unwrap();
            assert_eq!((1..10).find(read), Some(enough));
            assert!(ahead.unpack(None).iter().all(|chunk| chunk.fault.is_some()));
            ahead.trim();
            let kept_bytes: u64 = ahead.chunks.iter().map(|chunk| chunk.decoder.kept_bytes()).sum();
            assert!(kept_bytes <= 2 * KEPT_A_THREAD, "{kept_bytes}");
        }
    }
}
