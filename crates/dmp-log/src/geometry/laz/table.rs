//! The table of chunks: where each begins and how many points it has.

use super::las_bytes::Bytes;
use crate::geometry::laz::coder::{Decoder, IntegerDecoder};
use crate::geometry::laz::fields::{Cutting, PointsHead};
use crate::{ParseError, PlaceInFile};
use std::io::{Read, Seek};

/// Compressed bytes of a chunk up to which it is read: a reader holds one chunk.
const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// Chunks up to which a file is read: where each is is held.
const MAX_CHUNKS: u64 = 1 << 22;

/// Bytes that a number of the table takes, at most.
const MAX_NUMBER_BYTES: u64 = 8;

/// The beginning of a chunk, and the end of the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chunk {
    pub(super) first_point: u64,
    /// Its first byte in the file.
    pub(super) at: u64,
}

fn wrong<T>(at: u64, problem: String) -> Result<T, ParseError> {
    Err(ParseError::new(PlaceInFile::Byte(at), problem))
}

/// The chunks with points that the header knows of, and the end of the last.
pub(super) fn read<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    head: &PointsHead,
    cutting: Cutting,
) -> Result<Vec<Chunk>, ParseError> {
    let chunks = match cutting {
        _ if head.points == 0 => Vec::new(),
        Cutting::Whole => {
            let end = Chunk { first_point: head.points, at: bytes.length };
            vec![Chunk { first_point: 0, at: head.data_at }, end]
        }
        Cutting::Fixed(points) => read_table(bytes, head, Some(points))?,
        Cutting::Variable => read_table(bytes, head, None)?,
    };
    for (number, pair) in chunks.array_windows().enumerate() {
        let [begin, end]: &[Chunk; 2] = pair;
        let length = end.at - begin.at;
        if length > MAX_CHUNK_BYTES {
            let problem =
                format!("chunk {number} is {length} bytes, more than {MAX_CHUNK_BYTES} are not read");
            return wrong(begin.at, problem);
        }
    }
    Ok(chunks)
}

fn read_table<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    head: &PointsHead,
    fixed: Option<u32>,
) -> Result<Vec<Chunk>, ParseError> {
    let data_at = head.data_at;
    let mut table_at = bytes.u64(data_at, "the offset to the chunk table")?.cast_signed();
    if table_at <= data_at.cast_signed() {
        // A writer that could not seek leaves the offset at the very end.
        table_at = bytes.u64(bytes.length.saturating_sub(8), "the offset to the chunk table")?.cast_signed();
    }
    let table_at = u64::try_from(table_at).unwrap_or(0);
    if table_at < data_at + 8 || table_at > bytes.length.saturating_sub(8) {
        let problem =
            format!("the chunk table should be at byte {table_at} of {}: is the file cut?", bytes.length);
        return wrong(data_at, problem);
    }
    let count = u64::from(bytes.u32(table_at + 4, "the number of chunks")?);
    // Each has a whole point; but where the table says how many, a writer may have closed one without any.
    let room = table_at - data_at - 8;
    let record_bytes = u64::from(head.record_bytes);
    let most = if fixed.is_some() { room / record_bytes.max(1) } else { room / 4 + 1 };
    if count > most || fixed.is_some_and(|points| count * u64::from(points) < head.points) {
        let cut = fixed.map_or(String::new(), |points| format!(" of {points} points"));
        let problem = format!("{count} chunks{cut} in {room} bytes, for {} points", head.points);
        return wrong(table_at + 4, problem);
    }
    if count > MAX_CHUNKS {
        return wrong(table_at + 4, format!("{count} chunks, more than {MAX_CHUNKS} are not read"));
    }
    let numbers = if fixed.is_some() { count } else { 2 * count };
    let size = (numbers * MAX_NUMBER_BYTES + 8).min(bytes.length - table_at - 8);
    let mut decoder = Decoder::new(bytes.many(table_at + 8, size, "the chunk table")?);
    let mut integers = IntegerDecoder::new(32, 2);
    let mut chunks = Vec::new();
    let mut next = Chunk { first_point: 0, at: data_at + 8 };
    let (mut points, mut length) = (0, 0);
    for _ in 0..count {
        if next.first_point >= head.points {
            break;
        }
        points = match fixed {
            Some(points) => points.cast_signed(),
            None => integers.decode(&mut decoder, points, 0),
        };
        length = integers.decode(&mut decoder, length, 1);
        if !decoder.is_sound() {
            return wrong(table_at, format!("the chunk table of {count} chunks cannot be decoded"));
        }
        let (points, length) = (u64::from(points.cast_unsigned()), u64::from(length.cast_unsigned()));
        if points > 0 {
            if length < record_bytes || next.at + length > table_at {
                let problem = format!(
                    "a chunk of {points} points and {length} bytes, with the table at byte {table_at}"
                );
                return wrong(next.at, problem);
            }
            chunks.push(next);
        }
        next.first_point += points;
        next.at += length;
    }
    if next.first_point < head.points {
        let problem = format!("{count} chunks with {} points, for {} points", next.first_point, head.points);
        return wrong(table_at, problem);
    }
    chunks.push(Chunk { first_point: head.points, ..next });
    Ok(chunks)
}

/// Compares the heads of layered chunks with the table: each begins with a whole point, the number of points and the layers'
/// sizes.
pub(super) fn check_layers<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    record_bytes: u16,
    layers: u64,
    chunks: &[Chunk],
) -> Result<(), ParseError> {
    for pair in chunks.array_windows() {
        let [begin, end]: &[Chunk; 2] = pair;
        let count_at = begin.at + u64::from(record_bytes);
        let points = end.first_point - begin.first_point;
        let held = u64::from(bytes.u32(count_at, "a chunk's number of points")?);
        if held < points {
            return wrong(begin.at, format!("a chunk of {points} points says it has {held}"));
        }
        let sizes_at = count_at + 4;
        let mut next = sizes_at + 4 * layers;
        for layer in 0..layers {
            next += u64::from(bytes.u32(sizes_at + 4 * layer, "a layer's size")?);
        }
        if next > end.at {
            let problem = format!("a chunk claims to reach byte {next}, past its end at byte {}", end.at);
            return wrong(begin.at, problem);
        }
    }
    Ok(())
}
