//! A chunk of an MCAP file, read, checked and unpacked.

use super::records::{HEAD_BYTES, MAX_RECORD_BYTES, Source};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::fmt;
use std::io;

/// Fixed part of a chunk's header: two times, size, checksum, length of the compression's name.
const FIXED_BYTES: u64 = 32;
/// A record type of our own, fed behind a chunk: when it comes out, all of the chunk has.
const END_OF_CHUNK: u8 = 0xff;

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

/// Unpacks one chunk after the other into the same buffer.
#[derive(Default)]
pub(super) struct ChunkDecoder {
    /// Keeps its decompression contexts from chunk to chunk; given up after a fault.
    linear: Option<LinearReader>,
    records: Vec<u8>,
}

impl fmt::Debug for ChunkDecoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ChunkDecoder").field("records_bytes", &self.records.len()).finish_non_exhaustive()
    }
}

struct ChunkHead {
    uncompressed_bytes: u64,
    crc: u32,
    compressed: bool,
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
        self.records.clear();
        let head = read_head(source, at, body_bytes)?;
        if head.compressed {
            let mut linear = self.linear.take().unwrap_or_else(new_reader);
            self.unpack(&mut linear, source, at, HEAD_BYTES + body_bytes)?;
            self.linear = Some(linear);
            if self.records.len() as u64 != head.uncompressed_bytes {
                let (got, claimed) = (self.records.len(), head.uncompressed_bytes);
                return damaged(format!("its whole records have {got} bytes, its header says {claimed}"));
            }
        } else {
            source.read_into(head.data_at, head.compressed_bytes, &mut self.records)?;
            let crc = crc32fast::hash(&self.records);
            if head.crc != 0 && head.crc != crc {
                return damaged(format!("its CRC is {crc:08x}, its header says {:08x}", head.crc));
            }
        }
        Ok(&self.records)
    }

    /// What was decoded last.
    pub(super) fn records(&self) -> &[u8] {
        &self.records
    }

    fn unpack(
        &mut self,
        linear: &mut LinearReader,
        source: &mut Source,
        mut at: u64,
        mut left: u64,
    ) -> Result<(), ChunkFault> {
        let mut end_fed = false;
        while let Some(event) = linear.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) if left > 0 => {
                    let count = left.min(wanted as u64).max(1);
                    let space = linear.insert(count as usize);
                    let Some(space) = space.get_mut(..count as usize) else { break };
                    source.read_at(at, space)?;
                    linear.notify_read(count as usize);
                    at += count;
                    left -= count;
                }
                Ok(LinearReadEvent::ReadRequest(wanted)) if !end_fed && wanted as u64 == HEAD_BYTES => {
                    let mut end = [0; HEAD_BYTES as usize];
                    if let Some(first) = end.first_mut() {
                        *first = END_OF_CHUNK;
                    }
                    let space = linear.insert(end.len());
                    let Some(space) = space.get_mut(..end.len()) else { break };
                    space.copy_from_slice(&end);
                    linear.notify_read(end.len());
                    end_fed = true;
                }
                Ok(LinearReadEvent::ReadRequest(_)) => break,
                Ok(LinearReadEvent::Record { opcode: END_OF_CHUNK, data: [] }) if end_fed => return Ok(()),
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    self.records.push(opcode);
                    self.records.extend_from_slice(&(data.len() as u64).to_le_bytes());
                    self.records.extend_from_slice(data);
                }
                Err(error) => return damaged(one_line(&error.to_string())),
            }
        }
        damaged("its contents end before they should")
    }
}

fn new_reader() -> LinearReader {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_RECORD_BYTES as usize);
    LinearReader::new_with_options(options)
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
    let compressed = match name {
        b"" => false,
        b"zstd" | b"lz4" => true,
        other => return damaged(format!("unknown compression `{}`", String::from_utf8_lossy(other))),
    };
    let compressed_bytes = word_at(size, 0);
    let available = body_bytes - FIXED_BYTES - name_bytes - 8;
    if compressed_bytes > available {
        return damaged(format!("its data claims {compressed_bytes} bytes of {available}"));
    }
    if uncompressed_bytes.max(compressed_bytes) > MAX_RECORD_BYTES {
        let most = MAX_RECORD_BYTES;
        return damaged(format!(
            "it claims {uncompressed_bytes} bytes unpacked, more than the {most} allowed"
        ));
    }
    if !compressed && uncompressed_bytes != compressed_bytes {
        return damaged(format!(
            "it is not compressed, yet claims {compressed_bytes} bytes packed and {uncompressed_bytes} unpacked"
        ));
    }
    let data_at = body_at + FIXED_BYTES + name_bytes + 8;
    Ok(ChunkHead { uncompressed_bytes, crc, compressed, data_at, compressed_bytes })
}

fn word_at(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |word| u64::from_le_bytes(*word))
}

/// A message of another library, without its line breaks.
pub(super) fn one_line(text: &str) -> String {
    crate::decimal::shorten(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}
