//! MCAP as records: taken apart and put together again, its chunks too.

use std::io::{Read as _, Write as _};

use crate::trials::Random;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

pub(super) const FOOTER: u8 = 2;
pub(super) const MESSAGE: u8 = 5;
pub(super) const CHUNK: u8 = 6;
pub(super) const DATA_END: u8 = 15;

/// A record: its opcode and content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Record {
    pub(super) op: u8,
    pub(super) body: Vec<u8>,
}

impl Record {
    /// Where the numbers and the lengths of texts are: places and widths.
    pub(super) fn numbers(&self) -> Vec<(usize, usize)> {
        // `s` is a text or a list behind its length in four bytes.
        let layout = match self.op {
            1 => "ss",
            FOOTER => "884",
            3 => "2sss",
            4 => "22sss",
            MESSAGE => "2488",
            CHUNK => "8884s8",
            7 => "2s",
            8 => "8888s8s88",
            11 => "82444488s",
            14 => "188",
            DATA_END => "4",
            _ => "",
        };
        let (mut numbers, mut at) = (Vec::new(), 0);
        for letter in layout.bytes() {
            let width = if letter == b's' { 4 } else { usize::from(letter - b'0') };
            let Some(field) = self.body.get(at..at + width) else { break };
            numbers.push((at, width));
            at += width;
            if letter == b's' {
                at += field.iter().rev().fold(0, |length, &byte| length << 8 | usize::from(byte));
            }
        }
        numbers
    }
}

/// The records that stand behind each other; what is none at the end is left out.
pub(super) fn records(mut bytes: &[u8]) -> Vec<Record> {
    let mut records = Vec::new();
    while let Some((head, rest)) = bytes.split_at_checked(9) {
        let length = u64_at(head, 1) as usize;
        let Some((body, rest)) = rest.split_at_checked(length) else { break };
        records.push(Record { op: head[0], body: body.to_vec() });
        bytes = rest;
    }
    records
}

/// Records as bytes, one behind the other.
pub(super) fn joined(records: &[Record]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for record in records {
        bytes.push(record.op);
        bytes.extend_from_slice(&(record.body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&record.body);
    }
    bytes
}

/// The records of a file.
pub(super) fn of_file(file: &[u8]) -> Option<Vec<Record>> {
    Some(records(file.strip_prefix(MAGIC)?))
}

/// A file of records.
pub(super) fn file_of(records: &[Record]) -> Vec<u8> {
    [MAGIC, &joined(records), MAGIC].concat()
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(number)
}

/// A chunk, unpacked.
#[derive(Debug)]
pub(super) struct Chunk {
    /// First and last time.
    span: [u8; 16],
    packing: Vec<u8>,
    pub(super) records: Vec<Record>,
}

impl Chunk {
    pub(super) fn unpacked(record: &Record) -> Option<Self> {
        let body = &record.body;
        let packing_length = usize::from(*body.get(28)?);
        let packing = body.get(32..32 + packing_length)?.to_vec();
        let packed = body.get(40 + packing_length..)?;
        let plain = match packing.as_slice() {
            b"" => packed.to_vec(),
            b"zstd" => zstd::decode_all(packed).ok()?,
            b"lz4" => {
                let mut plain = Vec::new();
                lz4::Decoder::new(packed).ok()?.read_to_end(&mut plain).ok()?;
                plain
            }
            _ => return None,
        };
        let mut span = [0; 16];
        span.copy_from_slice(&body[..16]);
        Some(Self { span, packing, records: records(&plain) })
    }

    /// Packed again, with the right lengths and checksum.
    pub(super) fn packed(&self) -> std::io::Result<Record> {
        let plain = joined(&self.records);
        let packed = match self.packing.as_slice() {
            b"zstd" => zstd::encode_all(plain.as_slice(), 1)?,
            b"lz4" => {
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new())?;
                encoder.write_all(&plain)?;
                let (packed, done) = encoder.finish();
                done?;
                packed
            }
            _ => plain.clone(),
        };
        let mut body = self.span.to_vec();
        body.extend_from_slice(&(plain.len() as u64).to_le_bytes());
        body.extend_from_slice(&crc32fast::hash(&plain).to_le_bytes());
        body.extend_from_slice(&(self.packing.len() as u32).to_le_bytes());
        body.extend_from_slice(&self.packing);
        body.extend_from_slice(&(packed.len() as u64).to_le_bytes());
        body.extend_from_slice(&packed);
        Ok(Record { op: CHUNK, body })
    }

    /// As `n` chunks, each with a part of the messages and all that says what they are.
    pub(super) fn split(self, n: usize) -> Vec<Self> {
        let Self { span, packing, records } = self;
        let (messages, others): (Vec<_>, Vec<_>) =
            records.into_iter().partition(|record| record.op == MESSAGE);
        let size = messages.len().div_ceil(n).max(1);
        let part = |part: &[Record]| Self {
            span,
            packing: packing.clone(),
            records: others.iter().chain(part).cloned().collect(),
        };
        messages.chunks(size).map(part).collect()
    }

    /// A chunk of zeros that are many more than they take.
    pub(super) fn bomb(random: &mut Random) -> std::io::Result<Record> {
        let zeros = vec![0; 1 << random.below(28)];
        let bomb = Record { op: random.below(20) as u8, body: zeros };
        Self { span: [0; 16], packing: b"zstd".to_vec(), records: vec![bomb] }.packed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_back_from_every_packing() {
        let message = |id| Record { op: MESSAGE, body: vec![id; 30] };
        for packing in ["", "zstd", "lz4"] {
            let records = vec![Record { op: 4, body: vec![0; 12] }, message(1), message(2), message(3)];
            let chunk = Chunk { span: [0; 16], packing: packing.into(), records: records.clone() };
            let packed = chunk.packed().unwrap();
            assert_eq!(packed.numbers().len(), 6);
            let file = file_of(std::slice::from_ref(&packed));
            assert_eq!(of_file(&file).unwrap(), std::slice::from_ref(&packed));
            let chunk = Chunk::unpacked(&packed).unwrap();
            assert_eq!(chunk.records, records);
            let parts = chunk.split(2);
            assert_eq!(parts.iter().map(|part| part.records.len()).collect::<Vec<_>>(), [3, 2]);
        }
    }
}
