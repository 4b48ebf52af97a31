//! Chunks that are decoded before their points are asked for, on the threads of the pool that the reader runs in.

use super::chunk::OpenChunk;
use super::error::LazError;
use super::layout::LazLayout;
use rayon::Yield;
use std::collections::VecDeque;
use std::io;
use std::ops::Range;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// Chunks that are decoded or wait for it, for each thread: one in hand, one to go on with.
const CHUNKS_A_THREAD: usize = 2;

/// What they take, for each thread, bytes: two chunks as they usually are.
const BYTES_A_THREAD: u64 = 4 << 20;

/// A chunk that takes more is decoded when it is read, batch by batch: what a table claims is not set aside.
const MAX_CHUNK_BYTES: u64 = 8 << 20;

/// Chunks one behind the other, the first of them with the points that are read next.
#[derive(Debug)]
pub(super) struct Ahead {
    threads: usize,
    chunks: VecDeque<Coming>,
    /// Lists of records that were read.
    spare: Vec<Vec<u8>>,
}

#[derive(Debug)]
struct Coming {
    number: usize,
    points: Range<u64>,
    bytes: u64,
    receiver: Receiver<Decoded>,
    /// What came of it, as soon as it was waited for.
    decoded: Option<Decoded>,
}

#[derive(Debug)]
struct Decoded {
    records: Vec<u8>,
    /// Points that can be read. Where they are not all, `problem` says why.
    sound: u64,
    problem: Option<LazError>,
}

impl Decoded {
    /// Decodes all points of a chunk into `records`, whose other bytes are zeros.
    fn of(mut chunk: OpenChunk, mut records: Vec<u8>, record_bytes: usize) -> Self {
        let points = chunk.points.clone();
        let count = points.end - points.start;
        records.resize(count as usize * record_bytes, 0);
        let problem = chunk.read(&mut records, record_bytes).err();
        // Bytes that are left over are found with the last point.
        let sound = match problem {
            Some(_) => chunk.next.min(points.end.saturating_sub(1)) - points.start,
            None => count,
        };
        Self { records, sound, problem }
    }
}

impl Ahead {
    /// For a reader in a pool of so many threads.
    pub(super) fn new(threads: usize) -> Self {
        Self { threads, chunks: VecDeque::new(), spare: Vec::new() }
    }

    /// Fills whole records with the points from `next` on, up to the end of their chunk; returns how many they are; `None`
    /// where there is no such point, or where its chunk is too large to be decoded ahead.
    pub(super) fn read(
        &mut self,
        layout: &LazLayout,
        next: u64,
        records: &mut [u8],
        open: impl FnMut(usize) -> Result<OpenChunk, LazError>,
    ) -> Result<Option<usize>, LazError> {
        while let Some(behind) = self.chunks.pop_front_if(|chunk| chunk.points.end <= next) {
            self.spare.extend(behind.decoded.map(|decoded| decoded.records));
        }
        if self.chunks.front().is_some_and(|first| !first.points.contains(&next)) {
            self.chunks.clear();
        }
        self.go_on(layout, next, open);
        let Some(first) = self.chunks.front_mut() else { return Ok(None) };
        let decoded = match &mut first.decoded {
            Some(decoded) => decoded,
            none => none.insert(wait_for(&first.receiver)?),
        };
        let at = next - first.points.start;
        let wanted = (records.len() / layout.record_bytes) as u64;
        let count = wanted.min(first.points.end - next);
        if at + count > decoded.sound
            && let Some(problem) = decoded.problem.take()
        {
            self.chunks.pop_front();
            return Err(problem);
        }
        let [at, count] = [at, count].map(|points| points as usize);
        let range =
            |points: Range<usize>| points.start * layout.record_bytes..points.end * layout.record_bytes;
        records[range(0..count)].copy_from_slice(&decoded.records[range(at..at + count)]);
        Ok(Some(count))
    }

    /// Begins chunks, from that of a point on, while there is room.
    fn go_on(
        &mut self,
        layout: &LazLayout,
        next: u64,
        mut open: impl FnMut(usize) -> Result<OpenChunk, LazError>,
    ) {
        let room = BYTES_A_THREAD * self.threads as u64;
        while self.chunks.len() < CHUNKS_A_THREAD * self.threads {
            let number = match self.chunks.back() {
                Some(last) => Some(last.number + 1),
                None => layout.chunk_of(next),
            };
            let chunk = number.and_then(|number| Some((number, layout.chunk(number)?)));
            let Some((number, (points, compressed))) = chunk else { break };
            let unpacked = (points.end - points.start).saturating_mul(layout.record_bytes as u64);
            let bytes = unpacked.saturating_add(compressed.end - compressed.start);
            let held: u64 = self.chunks.iter().map(|chunk| chunk.bytes).sum();
            if bytes > MAX_CHUNK_BYTES || held.saturating_add(bytes) > room {
                break;
            }
            let (sender, receiver) = sync_channel(1);
            let opened = open(number);
            let is_there = opened.is_ok();
            match opened {
                Ok(chunk) => {
                    let (records, record_bytes) = (self.spare.pop().unwrap_or_default(), layout.record_bytes);
                    rayon::spawn_fifo(move || {
                        // Nobody waits for it any more where reading has ended or goes on elsewhere.
                        let _ = sender.send(Decoded::of(chunk, records, record_bytes));
                    });
                }
                Err(problem) => {
                    let _ = sender.send(Decoded { records: Vec::new(), sound: 0, problem: Some(problem) });
                }
            }
            self.chunks.push_back(Coming { number, points, bytes, receiver, decoded: None });
            if !is_there {
                // What cannot be opened is reported before anything behind it is tried.
                break;
            }
        }
    }
}

/// What comes of a chunk. Until it is there this thread decodes, too: it is one of the pool's.
fn wait_for(receiver: &Receiver<Decoded>) -> Result<Decoded, LazError> {
    let ended = || LazError::Read(io::Error::other("a thread that decodes has ended"));
    loop {
        match receiver.try_recv() {
            Ok(decoded) => return Ok(decoded),
            Err(TryRecvError::Disconnected) => return Err(ended()),
            // What nobody has begun is begun here, so that what is waited for is in somebody's hands.
            Err(TryRecvError::Empty) if rayon::yield_now() == Some(Yield::Executed) => {}
            Err(TryRecvError::Empty) => return receiver.recv().map_err(|_| ended()),
        }
    }
}
