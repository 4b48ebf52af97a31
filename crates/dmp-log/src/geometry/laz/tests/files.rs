//! Files of random points, compressed by the crate `laz`, and both decoders.

use crate::geometry::cloud::las_header;
use crate::geometry::cloud::las_header::LasHeader;
use crate::geometry::laz::reader::LazReader;
use laz::laszip::{LazItem, LazVlr, LazVlrBuilder};
use laz::{LasZipCompressor, LasZipDecompressor, LazItemRecordBuilder};
use std::io::{Cursor, Seek as _, SeekFrom};

const HEADER_BYTES: usize = 375;
/// Bytes of a point of each format, without extra ones.
const FORMAT_BYTES: [u16; 9] = [20, 28, 26, 34, 57, 63, 30, 36, 38];

/// xorshift: the same numbers in every run.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(super) fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn once_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

pub(super) struct Made {
    pub(super) format: u8,
    pub(super) items: Vec<LazItem>,
    /// Points of a chunk; `None` where they differ.
    pub(super) chunk: Option<u32>,
    pub(super) records: Vec<u8>,
    pub(super) record_bytes: u16,
}

impl Made {
    pub(super) fn new(format: u8, extra: u16, points: usize, seed: u64) -> Self {
        let items = LazItemRecordBuilder::default_for_point_format_id(format, extra).unwrap();
        let record_bytes = FORMAT_BYTES[usize::from(format)] + extra;
        let records = random_records(format, record_bytes, points, &mut Random(seed));
        Self { format, items, chunk: Some(1000), records, record_bytes }
    }

    pub(super) fn points(&self) -> usize {
        self.records.len() / usize::from(self.record_bytes)
    }

    pub(super) fn file(&self) -> Vec<u8> {
        let vlr = LazVlrBuilder::default().with_laz_items(self.items.clone());
        let vlr = match self.chunk {
            Some(points) => vlr.with_fixed_chunk_size(points),
            None => vlr.with_variable_chunk_size(),
        }
        .build();
        let mut record = Vec::new();
        vlr.write_to(&mut record).unwrap();
        let mut file = header(self, &record);
        let mut cursor = Cursor::new(std::mem::take(&mut file));
        cursor.seek(SeekFrom::End(0)).unwrap();
        let mut compressor = LasZipCompressor::new(cursor, vlr).unwrap();
        let record_bytes = usize::from(self.record_bytes);
        let mut random = Random(77);
        let mut rest = self.records.as_slice();
        while self.chunk.is_none() && !rest.is_empty() {
            let points = (random.below(900) as usize + 1).min(rest.len() / record_bytes);
            let (now, later) = rest.split_at(points * record_bytes);
            compressor.compress_many(now).unwrap();
            compressor.finish_current_chunk().unwrap();
            rest = later;
        }
        compressor.compress_many(rest).unwrap();
        compressor.done().unwrap();
        compressor.into_inner().into_inner()
    }
}

fn header(made: &Made, record: &[u8]) -> Vec<u8> {
    let mut file = vec![0; HEADER_BYTES];
    let mut put = |at: usize, bytes: &[u8]| file[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 4]);
    put(94, &(HEADER_BYTES as u16).to_le_bytes());
    put(96, &((HEADER_BYTES + 54 + record.len()) as u32).to_le_bytes());
    put(100, &1_u32.to_le_bytes());
    put(104, &[made.format | 0x80]);
    put(105, &made.record_bytes.to_le_bytes());
    put(107, &(made.points() as u32).to_le_bytes());
    for k in 0..3 {
        put(131 + 8 * k, &0.001_f64.to_le_bytes());
    }
    put(247, &(made.points() as u64).to_le_bytes());
    file.resize(HEADER_BYTES + 54, 0);
    file[HEADER_BYTES + 2..HEADER_BYTES + 16].copy_from_slice(b"laszip encoded");
    file[HEADER_BYTES + 18..HEADER_BYTES + 20].copy_from_slice(&22_204_u16.to_le_bytes());
    file[HEADER_BYTES + 20..HEADER_BYTES + 22].copy_from_slice(&(record.len() as u16).to_le_bytes());
    file.extend(record);
    file
}

/// Points that go on as a scanner's do for a while, and then do not.
fn random_records(format: u8, record_bytes: u16, points: usize, random: &mut Random) -> Vec<u8> {
    let record_bytes = usize::from(record_bytes);
    let mut record = vec![0_u8; record_bytes];
    let mut times = [3.0e8_f64, 4.0e8, 1.0, 1e-300, 3.1e8];
    let (mut sequence, mut step_s, mut last_time) = (0, 1e-5, 0);
    let mut records = Vec::with_capacity(points * record_bytes);
    for _ in 0..points {
        let magnitude = if random.once_in(50) { 32 } else { random.below(14) };
        for axis in 0..3 {
            let last = i32::from_le_bytes(record[4 * axis..4 * axis + 4].try_into().unwrap());
            let noise = (random.next() as i64 % (1 << magnitude)) as i32;
            record[4 * axis..4 * axis + 4].copy_from_slice(&last.wrapping_add(noise).to_le_bytes());
        }
        // All other bytes change now and then, channels and numbers of returns too.
        for byte in &mut record[12..] {
            if random.once_in(12) {
                *byte = random.next() as u8;
            }
        }
        if random.once_in(30) {
            sequence = random.below(5) as usize;
        }
        if random.once_in(40) {
            step_s = [1e-5, 0.0, -3e-5, 1e-3, 7.0][random.below(5) as usize];
        }
        let multiple = if random.once_in(4) { random.below(600) as f64 - 20.0 } else { 1.0 };
        times[sequence] += step_s * multiple;
        // The encoder cannot have two times 2^63 apart.
        let time =
            if random.once_in(100) { random.next() } else { times[sequence].to_bits() } & (u64::MAX >> 1);
        if let Some(at) = time_at(format) {
            if random.below(3) > 0 {
                last_time = time;
            }
            record[at..at + 8].copy_from_slice(&last_time.to_le_bytes());
        }
        match format {
            // Nor two offsets of waveforms.
            4 => record[36] &= 0x3f,
            5 => record[42] &= 0x3f,
            _ => {}
        }
        records.extend_from_slice(&record);
    }
    records
}

pub(super) fn time_at(format: u8) -> Option<usize> {
    match format {
        0 | 2 => None,
        1..=5 => Some(20),
        _ => Some(22),
    }
}

/// Only what is decoded of records: places and times.
pub(super) fn wanted(format: u8, record: &[u8]) -> ([u8; 12], [u8; 8]) {
    let time = time_at(format).map_or([0; 8], |at| record[at..at + 8].try_into().unwrap());
    (record[..12].try_into().unwrap(), time)
}

pub(super) fn check(file: &[u8]) -> Result<LasHeader, String> {
    las_header::check(&mut Cursor::new(file), file.len() as u64).map_err(|e| e.to_string())
}

/// All records, by our decoder.
pub(super) fn decode(file: &[u8]) -> Result<Vec<u8>, String> {
    let header = check(file)?;
    let mut reader = LazReader::new(Cursor::new(file), header.laz.unwrap());
    let record_bytes = usize::from(header.record_bytes);
    let (mut records, mut left) = (Vec::new(), header.points);
    while left > 0 {
        // Batches that do not end where chunks do.
        let count = left.min(700);
        let mut batch = vec![0; count as usize * record_bytes];
        reader.read(&mut batch).map_err(|e| e.to_string())?;
        records.extend(batch);
        left -= count;
    }
    Ok(records)
}

/// All records, by the crate's.
pub(super) fn decode_by_laz(file: &[u8]) -> Vec<u8> {
    let header = check(file).unwrap();
    let record_at = file.windows(14).position(|bytes| bytes == b"laszip encoded").unwrap() + 52;
    let vlr = LazVlr::from_buffer(&file[record_at..]).unwrap();
    let mut cursor = Cursor::new(file);
    cursor.set_position(header.data_at);
    let mut records = vec![0; header.points as usize * usize::from(header.record_bytes)];
    LasZipDecompressor::new(cursor, vlr).unwrap().decompress_many(&mut records).unwrap();
    records
}
