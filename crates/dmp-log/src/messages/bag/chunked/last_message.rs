//! A chunk that ends in a scan is unpacked no further than the first points of it, where nothing more is asked.

use super::framing::{Framing, HEAD_BYTES, Kind};
use std::fmt;
use std::io::{self, Read};
use std::ops::RangeInclusive;
use zstd::stream::raw::{Decoder, InBuffer, Operation as _, OutBuffer};

/// Whether the first bytes are enough of a message of the channel with this number.
pub(super) type StartIsEnough<'a> = &'a (dyn Fn(u32) -> bool + Sync);

/// Unpacked, chunks of other sizes are always unpacked whole: little is gained, or too much is claimed.
const CHUNK_BYTES: RangeInclusive<u64> = 256 << 10..=16 << 20;
/// What is unpacked of the last message. The layout of points takes less.
const START_BYTES: usize = 8 << 10;
/// What is read of a packed chunk to see whether it has one message: a block of zstd gives at most 128 KiB.
pub(super) const FIRST_BYTES: u64 = 144 << 10;

/// How far a chunk was unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unpacked {
    /// As far as is enough; behind it are zeros. Nothing was checked.
    Start,
    All,
}

/// Unpacks chunks no further than is enough.
#[derive(Default)]
pub(super) struct ChunkStarts {
    zstd: Option<Decoder<'static>>,
    /// Whether a chunk had long messages before the last.
    has_more_messages: bool,
}

impl fmt::Debug for ChunkStarts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ChunkStarts")
            .field("has_more_messages", &self.has_more_messages)
            .finish_non_exhaustive()
    }
}

/// With the buffers of the chunk before.
struct Unzstd<'a> {
    zstd: &'a mut Decoder<'static>,
    packed: InBuffer<'a>,
}

impl Read for Unzstd<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let mut to = OutBuffer::around(to);
        self.zstd.run(&mut self.packed, &mut to)?;
        Ok(to.pos())
    }
}

impl ChunkStarts {
    /// Whether the first bytes of a chunk may be enough, which unpacks to so many: chunks of a file are alike.
    pub(super) fn may_be_first_bytes(&self, chunk_bytes: u64) -> bool {
        !self.has_more_messages && CHUNK_BYTES.contains(&chunk_bytes)
    }

    /// The same as [`Self::unpack`] of zstd.
    pub(super) fn unpack_zstd(
        &mut self,
        packed: &[u8],
        chunk_bytes: u64,
        records: &mut Vec<u8>,
        enough: StartIsEnough<'_>,
    ) -> io::Result<Unpacked> {
        let mut zstd = match self.zstd.take() {
            Some(zstd) => zstd,
            None => Decoder::new()?,
        };
        zstd.reinit()?;
        let mut unpacker = Unzstd { zstd: &mut zstd, packed: InBuffer::around(packed) };
        let unpacked = self.unpack(&mut unpacker, chunk_bytes, records, enough);
        self.zstd = Some(zstd);
        unpacked
    }

    /// Unpacks a chunk as far as is enough; an error where it is damaged or too little of it is there.
    pub(super) fn unpack(
        &mut self,
        unpacker: &mut dyn Read,
        chunk_bytes: u64,
        records: &mut Vec<u8>,
        enough: StartIsEnough<'_>,
    ) -> io::Result<Unpacked> {
        let cut = || io::Error::from(io::ErrorKind::InvalidData);
        if !CHUNK_BYTES.contains(&chunk_bytes) {
            return Err(cut());
        }
        let bytes = chunk_bytes as usize;
        records.clear();
        let mut at = 0;
        loop {
            let body_at = at + HEAD_BYTES as usize;
            unpack_to(unpacker, records, bytes.min(body_at + START_BYTES))?;
            let (head, body) = records.get(at..).and_then(|rest| rest.split_first_chunk()).ok_or_else(cut)?;
            let [opcode, length @ ..]: [u8; HEAD_BYTES as usize] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).ok();
            let end = length.and_then(|length| body_at.checked_add(length)).filter(|&end| end <= bytes);
            at = end.ok_or_else(cut)?;
            if at < bytes {
                self.has_more_messages |= at > records.len();
                continue;
            }
            let channel = Framing::Mcap.split_message(body).map(|message| message.channel_id);
            let is_message = Framing::Mcap.kind(opcode) == Kind::Message;
            if is_message && bytes > body_at + START_BYTES && channel.is_some_and(enough) {
                records.resize(bytes, 0);
                return Ok(Unpacked::Start);
            }
            unpack_to(unpacker, records, bytes)?;
            // Also what ends the packed bytes is checked.
            return if unpacker.read(&mut [0])? == 0 { Ok(Unpacked::All) } else { Err(cut()) };
        }
    }
}

/// Goes on until so many bytes are unpacked.
fn unpack_to(unpacker: &mut dyn Read, records: &mut Vec<u8>, to: usize) -> io::Result<()> {
    let from = records.len();
    records.resize(to.max(from), 0);
    unpacker.read_exact(records.get_mut(from..).unwrap_or_default())
}
