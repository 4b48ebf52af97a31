//! MCAP as records, taken apart and put together again, its chunks too; and damage to them with checksums that are right.

use std::io::{Read as _, Write as _};

use super::field::{Field, number, odd_number};
use super::{Random, bytes, cdr, damage_parts};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

pub(crate) const FOOTER: u8 = 2;
pub(crate) const MESSAGE: u8 = 5;
pub(crate) const CHUNK: u8 = 6;
pub(crate) const DATA_END: u8 = 15;

/// A record: its opcode and content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Record {
    pub(crate) op: u8,
    pub(crate) body: Vec<u8>,
}

impl Record {
    /// The numbers and the lengths of texts in the content.
    fn fields(&self) -> Vec<Field> {
        // By their widths; `s` is a text or a list behind its length in four bytes.
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
        let (mut fields, mut at) = (Vec::new(), 0_usize);
        for letter in layout.bytes() {
            let width = if letter == b's' { 4 } else { usize::from(letter - b'0') };
            let Some(value) = number(&self.body, at, width) else { break };
            fields.push(Field::little(at, width));
            at = at.saturating_add(width).saturating_add(if letter == b's' { value } else { 0 });
        }
        fields
    }
}

/// The records that stand behind each other; what is none at the end is dropped.
fn records(mut bytes: &[u8]) -> Vec<Record> {
    let mut records = Vec::new();
    while let Some((head, rest)) = bytes.split_at_checked(9) {
        let body = number(head, 1, 8).and_then(|length| rest.split_at_checked(length));
        let Some((body, rest)) = body else { break };
        records.push(Record { op: head[0], body: body.to_vec() });
        bytes = rest;
    }
    records
}

fn joined(records: &[Record]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for record in records {
        bytes.push(record.op);
        bytes.extend_from_slice(&(record.body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&record.body);
    }
    bytes
}

/// The records of a file; `None` where it is no MCAP.
pub(crate) fn of_file(file: &[u8]) -> Option<Vec<Record>> {
    Some(records(file.strip_prefix(MAGIC)?))
}

/// A file of records.
pub(crate) fn file_of(records: &[Record]) -> Vec<u8> {
    [MAGIC, &joined(records), MAGIC].concat()
}

/// A chunk, unpacked.
#[derive(Debug)]
pub(crate) struct Chunk {
    /// First and last time.
    span: [u8; 16],
    packing: Vec<u8>,
    records: Vec<Record>,
}

impl Chunk {
    pub(crate) fn unpacked(record: &Record) -> Option<Self> {
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
        Some(Self { span: *body.first_chunk()?, packing, records: records(&plain) })
    }

    /// Packed again, with the right lengths and checksum.
    pub(crate) fn packed(&self) -> std::io::Result<Record> {
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
        let parts: [&[u8]; 7] = [
            &self.span,
            &(plain.len() as u64).to_le_bytes(),
            &crc32fast::hash(&plain).to_le_bytes(),
            &(self.packing.len() as u32).to_le_bytes(),
            &self.packing,
            &(packed.len() as u64).to_le_bytes(),
            &packed,
        ];
        Ok(Record { op: CHUNK, body: parts.concat() })
    }

    /// As `n` chunks, each with a part of the messages and all that says what they are.
    pub(crate) fn split(self, n: usize) -> Vec<Self> {
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
    fn bomb(random: &mut Random) -> std::io::Result<Record> {
        let zeros = vec![0; 1 << random.below(28)];
        let bomb = Record { op: random.below(20) as u8, body: zeros };
        Self { span: [0; 16], packing: b"zstd".to_vec(), records: vec![bomb] }.packed()
    }
}

/// One damage; false where the file cannot be taken apart.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some(mut records) = of_file(file).filter(|records| !records.is_empty()) else { return false };
    let chunks: Vec<usize> = (0..records.len()).filter(|&at| records[at].op == CHUNK).collect();
    if !chunks.is_empty() && random.below(10) < 6 {
        let at = *random.pick(&chunks);
        let Some(mut chunk) = Chunk::unpacked(&records[at]) else { return false };
        for _ in 0..=random.below(3) {
            damage_records(&mut chunk.records, random);
        }
        let Ok(packed) = chunk.packed() else { return false };
        records[at] = packed;
    } else {
        damage_records(&mut records, random);
    }
    // Checksums of the whole are dropped, which is allowed; often the summary too, whose places are wrong now.
    let from = if random.once_in(2) { 0 } else { 16 };
    for record in &mut records {
        match (record.op, record.body.len()) {
            (DATA_END, 4) => record.body.fill(0),
            (FOOTER, 20) => record.body[from..].fill(0),
            _ => {}
        }
    }
    *file = file_of(&records);
    if random.once_in(12) {
        file.truncate(random.below(file.len()));
    }
    if random.once_in(12) {
        // The length of a record, which nothing guards.
        let before = records.iter().take(random.below(records.len()));
        let at = 8 + before.map(|record| 9 + record.body.len()).sum::<usize>();
        Field::little(at + 1, 8).spoil(file, random);
    }
    true
}

fn damage_records(records: &mut Vec<Record>, random: &mut Random) {
    let one = random.below(records.len());
    let Some(record) = records.get_mut(one) else { return };
    match random.below(16) {
        0 => record.op = odd_number(random) as u8,
        1..=3 => damage_parts(records, |record| record.body.len(), random),
        4 => bytes::damage(&mut record.body, b"", random),
        5 => record.body.truncate(random.below(record.body.len() + 1)),
        6 => records.extend(Chunk::bomb(random).ok()),
        7..=10 => damage_message(records, random),
        _ => {
            let fields = record.fields();
            if !fields.is_empty() {
                random.pick(&fields).spoil(&mut record.body, random);
            }
        }
    }
}

/// What a message says, behind the 22 bytes of its head.
fn damage_message(records: &mut [Record], random: &mut Random) {
    let messages: Vec<usize> = (0..records.len()).filter(|&at| records[at].op == MESSAGE).collect();
    if messages.is_empty() {
        return;
    }
    // The same damage in all messages goes further than in one, which is skipped.
    let (one, is_all, again) = (*random.pick(&messages), random.once_in(3), random.next());
    for at in if is_all { messages } else { vec![one] } {
        let body = &mut records[at].body;
        if body.len() >= 22 {
            let mut content = body.split_off(22);
            cdr::damage(&mut content, &mut Random::of(&[again]));
            body.extend(content);
        }
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
            assert_eq!(packed.fields().len(), 6);
            let file = file_of(std::slice::from_ref(&packed));
            assert_eq!(of_file(&file).unwrap(), std::slice::from_ref(&packed));
            let chunk = Chunk::unpacked(&packed).unwrap();
            assert_eq!(chunk.records, records);
            let parts = chunk.split(2);
            assert_eq!(parts.iter().map(|part| part.records.len()).collect::<Vec<_>>(), [3, 2]);
        }
    }
}
