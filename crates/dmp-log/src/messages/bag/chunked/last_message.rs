//! A chunk that ends in a scan is unpacked no further than the first points of it, where nothing more is asked.

use super::chunk::{ChunkDecoder, ChunkFault, ChunkHead, Packing};
use super::framing::{Framing, HEAD_BYTES, Kind};
use super::records::Source;
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
const FIRST_BYTES: u64 = 144 << 10;

/// How far a chunk was unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unpacked {
    /// As far as is enough; behind it are zeros. Nothing was checked.
    Start,
    All,
}

/// Of the same buffers as for the chunk before.
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

impl ChunkDecoder {
    /// Reads and unpacks no more of a chunk than is enough; whether that could be done with its first bytes.
    pub(super) fn read_start(
        &mut self,
        source: &mut Source,
        head: &ChunkHead,
        enough: StartIsEnough<'_>,
    ) -> io::Result<bool> {
        // Chunks of a file are alike.
        if self.has_more_messages || !CHUNK_BYTES.contains(&head.uncompressed_bytes) {
            return Ok(false);
        }
        source.read_into(head.data_at, head.compressed_bytes.min(FIRST_BYTES), &mut self.packed)?;
        Ok(matches!(self.unpack_start(head, enough), Ok(Unpacked::Start)))
    }

    /// Unpacks what was read of a chunk as far as is enough; an error where it is damaged or too little was read.
    pub(super) fn unpack_start(
        &mut self,
        head: &ChunkHead,
        enough: StartIsEnough<'_>,
    ) -> Result<Unpacked, ChunkFault> {
        let cut = || ChunkFault::Damaged("it is no row of whole records".to_owned());
        if !CHUNK_BYTES.contains(&head.uncompressed_bytes) {
            return Err(cut());
        }
        let bytes = head.uncompressed_bytes as usize;
        let Self { packed, records, start_zstd, has_more_messages, .. } = self;
        let packed = packed.as_slice();
        let mut unpacker: Box<dyn Read + '_> = match head.packing {
            Packing::None => Box::new(packed),
            Packing::Zstd => {
                let zstd = match start_zstd.take() {
                    Some(zstd) => zstd,
                    None => Decoder::new()?,
                };
                let zstd = start_zstd.insert(zstd);
                zstd.reinit()?;
                Box::new(Unzstd { zstd, packed: InBuffer::around(packed) })
            }
            Packing::Lz4 => Box::new(lz4::Decoder::new(packed)?),
            Packing::Bz2 => return Err(cut()),
        };
        records.clear();
        let mut at = 0;
        loop {
            let body_at = at + HEAD_BYTES as usize;
            unpack_to(&mut unpacker, records, bytes.min(body_at + START_BYTES))?;
            let (head, body) = records.get(at..).and_then(|rest| rest.split_first_chunk()).ok_or_else(cut)?;
            let [opcode, length @ ..]: [u8; HEAD_BYTES as usize] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).ok();
            at = length
                .and_then(|length| body_at.checked_add(length))
                .filter(|&end| end <= bytes)
                .ok_or_else(cut)?;
            if at < bytes {
                *has_more_messages |= at > records.len();
                continue;
            }
            let channel = Framing::Mcap.split_message(body).map(|message| message.channel_id);
            let is_message = Framing::Mcap.kind(opcode) == Kind::Message;
            if is_message && bytes > body_at + START_BYTES && channel.is_some_and(enough) {
                records.resize(bytes, 0);
                return Ok(Unpacked::Start);
            }
            unpack_to(&mut unpacker, records, bytes)?;
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
