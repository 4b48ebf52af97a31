//! A chunk, read, checked and unpacked.

use super::framing::{Framing, HEAD_BYTES};
use super::last_message::{ChunkStarts, FIRST_BYTES, StartIsEnough, Unpacked};
use super::records::{MAX_RECORD_BYTES, Source};
use super::ros1;
use crate::file::shorten;
use bzip2::read::BzDecoder;
use dmp_lengths::thousands;
use std::fmt;
use std::io::{self, Read};
use zstd::bulk::Decompressor;

/// Fixed part of the header of MCAP's: two times, size, checksum, length of the compression's name.
const FIXED_BYTES: u64 = 32;
/// How much more a chunk of points may have unpacked than packed before its claim is doubted. More is
/// read too, but no memory is taken for it before the bytes are there.
const USUAL_RATIO: u64 = 32;

/// Why a chunk gives nothing.
#[derive(Debug)]
pub(super) enum ChunkFault {
    /// The file could not be read.
    Io(io::Error),
    /// Its bytes are wrong; in words.
    Damaged(String),
}

impl From<io::Error> for ChunkFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

fn damaged<T>(problem: impl Into<String>) -> Result<T, ChunkFault> {
    Err(ChunkFault::Damaged(problem.into()))
}

/// Unpacks one chunk after the other into the same buffers.
#[derive(Default)]
pub(super) struct ChunkDecoder {
    zstd: Option<Decompressor<'static>>,
    /// Of the chunk that was read last.
    head: ChunkHead,
    packed: Vec<u8>,
    records: Vec<u8>,
    starts: ChunkStarts,
    /// How far it is unpacked already.
    unpacked: Option<Unpacked>,
    met_no_crc: bool,
}

impl fmt::Debug for ChunkDecoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ChunkDecoder").field("records_bytes", &self.records.len()).finish_non_exhaustive()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Packing {
    #[default]
    None,
    Zstd,
    Lz4,
    Bz2,
}

#[derive(Debug, Clone, Copy, Default)]
struct ChunkHead {
    uncompressed_bytes: u64,
    crc: u32,
    packing: Packing,
    data_at: u64,
    compressed_bytes: u64,
}

impl ChunkDecoder {
    /// The records of the chunk record at `at`, whose body has `body_bytes`: checksum compared, nothing
    /// given of a chunk that is not whole.
    pub(super) fn decode(
        &mut self,
        source: &mut Source,
        at: u64,
        body_bytes: u64,
    ) -> Result<&[u8], ChunkFault> {
        self.read(source, at, body_bytes, None)?;
        self.unpack(None)?;
        Ok(&self.records)
    }

    /// The first half: reads the chunk, or no more of it than is enough.
    pub(super) fn read(
        &mut self,
        source: &mut Source,
        at: u64,
        body_bytes: u64,
        enough: Option<StartIsEnough<'_>>,
    ) -> Result<(), ChunkFault> {
        self.records.clear();
        self.head = ChunkHead::default();
        self.unpacked = None;
        let head = match source.framing {
            Framing::Mcap => read_head(source, at, body_bytes),
            Framing::Ros1 => read_ros1_head(source, at),
        }?;
        self.head = head;
        if let Some(enough) = enough.filter(|_| self.starts.may_be_first_bytes(head.uncompressed_bytes)) {
            source.read_into(head.data_at, head.compressed_bytes.min(FIRST_BYTES), &mut self.packed)?;
            self.unpacked = self.unpack_start(enough).ok().filter(|unpacked| *unpacked == Unpacked::Start);
            if self.unpacked.is_some() {
                return Ok(());
            }
        }
        self.records.clear();
        let into = if head.packing == Packing::None { &mut self.records } else { &mut self.packed };
        Ok(source.read_into(head.data_at, head.compressed_bytes, into)?)
    }

    /// The second half: unpacks what was read and compares its checksum; neither of what is not needed.
    pub(super) fn unpack(&mut self, enough: Option<StartIsEnough<'_>>) -> Result<(), ChunkFault> {
        let head = self.head;
        if let (None, Some(enough)) = (self.unpacked, enough.filter(|_| head.packing != Packing::None)) {
            self.unpacked = self.unpack_start(enough).ok();
        }
        match self.unpacked {
            None => self.unpack_all(&head)?,
            Some(Unpacked::All) => {}
            Some(Unpacked::Start) => {
                self.met_no_crc |= head.crc == 0;
                return Ok(());
            }
        }
        if self.records.len() as u64 != head.uncompressed_bytes {
            let [got, claimed] = [self.records.len() as u64, head.uncompressed_bytes].map(thousands);
            return damaged(format!("it unpacks to {got} bytes, its header says {claimed}"));
        }
        let crc = crc32fast::hash(&self.records);
        self.met_no_crc |= head.crc == 0 && !self.records.is_empty();
        if head.crc != 0 && head.crc != crc {
            return damaged(format!("its CRC is {crc:08x}, its header says {:08x}", head.crc));
        }
        Ok(())
    }

    /// As far as is enough.
    fn unpack_start(&mut self, enough: StartIsEnough<'_>) -> io::Result<Unpacked> {
        let (packed, bytes, records) =
            (self.packed.as_slice(), self.head.uncompressed_bytes, &mut self.records);
        match self.head.packing {
            Packing::None => self.starts.unpack(&mut &*packed, bytes, records, enough),
            Packing::Zstd => self.starts.unpack_zstd(packed, bytes, records, enough),
            Packing::Lz4 => self.starts.unpack(&mut lz4::Decoder::new(packed)?, bytes, records, enough),
            Packing::Bz2 => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    fn unpack_all(&mut self, head: &ChunkHead) -> Result<(), ChunkFault> {
        if head.packing != Packing::None {
            self.records.clear();
        }
        match head.packing {
            Packing::None => Ok(()),
            Packing::Zstd => self.unpack_zstd(head.uncompressed_bytes),
            Packing::Lz4 => self.unpack_lz4(head.uncompressed_bytes),
            Packing::Bz2 => {
                let bz2 = BzDecoder::new(self.packed.as_slice());
                read_at_most(bz2, head.uncompressed_bytes, &mut self.records)
            }
        }
    }

    /// What the chunk that was read last takes: packed, or unpacked as it claims, whichever is more.
    pub(super) fn bytes(&self) -> u64 {
        self.head.uncompressed_bytes.max(self.head.compressed_bytes)
    }

    pub(super) fn kept_bytes(&self) -> u64 {
        (self.packed.capacity() + self.records.capacity()) as u64
    }

    /// Takes over what another one knows of checksums.
    pub(super) fn learn_from(&mut self, other: &Self) {
        self.met_no_crc |= other.met_no_crc;
    }

    /// Takes note of whether a chunk that is not read has a checksum.
    pub(super) fn pass_over(&mut self, source: &mut Source, at: u64, body_bytes: u64) -> io::Result<()> {
        // What is wrong with one that is too short is reported when it is read. Those of ROS 1 have none.
        if source.framing == Framing::Ros1 {
            self.met_no_crc = true;
        } else if body_bytes >= FIXED_BYTES {
            let mut fixed = [0; FIXED_BYTES as usize];
            source.read_at(at + HEAD_BYTES, &mut fixed)?;
            self.met_no_crc |= word_at(&fixed, 24) as u32 == 0 && word_at(&fixed, 16) > 0;
        }
        Ok(())
    }

    /// Whether any chunk had no checksum.
    pub(super) fn met_no_crc(&self) -> bool {
        self.met_no_crc
    }

    pub(super) fn records(&self) -> &[u8] {
        &self.records
    }

    fn unpack_zstd(&mut self, claimed_bytes: u64) -> Result<(), ChunkFault> {
        let usual_bytes = claimed_bytes.min((self.packed.len() as u64).saturating_mul(USUAL_RATIO));
        if usual_bytes == claimed_bytes {
            self.records.reserve(usual_bytes as usize);
            let zstd = match self.zstd.take() {
                Some(zstd) => zstd,
                None => Decompressor::new()?,
            };
            let unpacked = self.zstd.insert(zstd).decompress_to_buffer(&self.packed, &mut self.records);
            if unpacked.is_ok_and(|bytes| bytes as u64 == claimed_bytes) {
                return Ok(());
            }
        }
        // Also where the claim is unusual: memory grows with what is there. What is said of a damaged chunk depends on the room
        // that there is, so it is always unpacked into none.
        self.records = Vec::new();
        let zstd = zstd::stream::read::Decoder::new(self.packed.as_slice())?;
        read_at_most(zstd, claimed_bytes, &mut self.records)
    }

    fn unpack_lz4(&mut self, claimed_bytes: u64) -> Result<(), ChunkFault> {
        let lz4 = lz4::Decoder::new(self.packed.as_slice())?;
        read_at_most(lz4, claimed_bytes, &mut self.records)
    }
}

/// Reads what an unpacker gives, at most one byte more than is claimed.
fn read_at_most(unpacker: impl Read, claimed_bytes: u64, records: &mut Vec<u8>) -> Result<(), ChunkFault> {
    let read = unpacker.take(claimed_bytes + 1).read_to_end(records);
    read.map(|_| ()).or_else(|error| damaged(one_line(&error.to_string())))
}

/// Reads and checks a chunk's header, so that nothing claimed there is believed further down.
fn read_head(source: &mut Source, at: u64, body_bytes: u64) -> Result<ChunkHead, ChunkFault> {
    let body_at = at + HEAD_BYTES;
    if body_bytes < FIXED_BYTES + 8 {
        return damaged(format!("it has {body_bytes} bytes, fewer than its header"));
    }
    let mut fixed = [0; FIXED_BYTES as usize];
    source.read_at(body_at, &mut fixed)?;
    let uncompressed_bytes = word_at(&fixed, 16);
    let crc = word_at(&fixed, 24) as u32;
    let name_bytes = word_at(&fixed, 24) >> 32;
    if name_bytes > 16 || FIXED_BYTES + name_bytes + 8 > body_bytes {
        return damaged(format!("the name of its compression claims {name_bytes} bytes"));
    }
    let mut rest = vec![0; name_bytes as usize + 8];
    source.read_at(body_at + FIXED_BYTES, &mut rest)?;
    let (name, size) = rest.split_at(name_bytes as usize);
    let packing = match name {
        b"" => Packing::None,
        b"zstd" => Packing::Zstd,
        b"lz4" => Packing::Lz4,
        other => return unknown(other),
    };
    let compressed_bytes = word_at(size, 0);
    let available = body_bytes - FIXED_BYTES - name_bytes - 8;
    if compressed_bytes > available {
        let [claimed, available] = [compressed_bytes, available].map(thousands);
        return damaged(format!("its data claims {claimed} bytes of {available}"));
    }
    let data_at = body_at + FIXED_BYTES + name_bytes + 8;
    check_head(ChunkHead { uncompressed_bytes, crc, packing, data_at, compressed_bytes })
}

/// The same of ROS 1: fields with names, and behind them the length of the data.
fn read_ros1_head(source: &mut Source, at: u64) -> Result<ChunkHead, ChunkFault> {
    let Some(head) = source.ros1_head_at(at)? else { return damaged("its header is cut") };
    let fields = ros1::Fields(&head.fields);
    let packing = match fields.get("compression") {
        Some(b"none") => Packing::None,
        Some(b"lz4") => Packing::Lz4,
        Some(b"bz2") => Packing::Bz2,
        other => return unknown(other.unwrap_or_default()),
    };
    let Some(size) = fields.number("size") else { return damaged("its header does not say its size") };
    let (uncompressed_bytes, compressed_bytes) = (u64::from(size), head.data_bytes);
    // A chunk that was begun: its records lie behind it.
    let packing = if compressed_bytes == 0 { Packing::None } else { packing };
    check_head(ChunkHead { uncompressed_bytes, crc: 0, packing, data_at: head.data_at, compressed_bytes })
}

fn unknown(packing: &[u8]) -> Result<ChunkHead, ChunkFault> {
    damaged(format!("unknown compression `{}`", shorten(&String::from_utf8_lossy(packing))))
}

fn check_head(head: ChunkHead) -> Result<ChunkHead, ChunkFault> {
    let ChunkHead { uncompressed_bytes, packing, compressed_bytes, .. } = head;
    if uncompressed_bytes.max(compressed_bytes) > MAX_RECORD_BYTES {
        let [claimed, most] = [uncompressed_bytes, MAX_RECORD_BYTES].map(thousands);
        return damaged(format!("it claims {claimed} bytes unpacked, more than the {most} allowed"));
    }
    if packing == Packing::None && uncompressed_bytes != compressed_bytes {
        let [packed, unpacked] = [compressed_bytes, uncompressed_bytes].map(thousands);
        return damaged(format!(
            "it is not compressed, yet claims {packed} bytes packed and {unpacked} unpacked"
        ));
    }
    Ok(head)
}

fn word_at(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |word| u64::from_le_bytes(*word))
}

/// A message of another library, without its line breaks.
pub(super) fn one_line(text: &str) -> String {
    shorten(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}
