//! What a LAS header claims, compared with the file before anything is believed or allocated.
//!
//! The decoders further down allocate what a header, a variable-length record, a chunk table or a layer
//! claims. Offsets are those of the LAS 1.4 R15 and `LASzip` specifications.

use super::las_bytes::Bytes;
use super::las_crs::{self, CrsRecord, EVLR_HEAD_BYTES, VLR_HEAD_BYTES};
use crate::{ParseError, PlaceInFile};
use std::io::{Read, Seek};

/// Extra bytes of a point up to which compressed files are read; each costs kilobytes of decoder.
const MAX_EXTRA_BYTES: u16 = 1024;

/// Bytes beside the points up to which a file is read: the decoder holds its records, and what lies between
/// them and the points.
const MAX_HELD_BYTES: u64 = 256 << 20;

/// From where the times of points count, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GpsTime {
    /// The beginning of the week.
    Week,
    /// The GPS epoch, and 10⁹ more.
    Standard,
}

/// A LAS header that does not lie about sizes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LasHeader {
    pub(crate) points: u64,
    pub(crate) compressed: bool,
    /// What the times of points count; `None` where they have none.
    pub(crate) gps_time: Option<GpsTime>,
    /// What it says of its coordinate system, in the file's order.
    pub(super) crs: Vec<CrsRecord>,
    /// Whether the well-known text counts, not the `GeoTIFF` keys.
    pub(super) says_wkt: bool,
    /// The largest of the bounds it claims for x and y, without their signs; `None` where they make no sense.
    pub(crate) extent: Option<f64>,
}

/// Checks a LAS or LAZ file of `length` bytes.
pub(crate) fn check(input: &mut (impl Read + Seek), length: u64) -> Result<LasHeader, ParseError> {
    let mut bytes = Bytes::of(input, length);
    let wrong = |at: u64, problem: String| Err(ParseError::new(PlaceInFile::Byte(at), problem));
    let [major, minor] = bytes.at(24, "the version")?;
    if major != 1 || minor > 4 {
        return wrong(24, format!("LAS version {major}.{minor} is not read, 1.0 to 1.4 are"));
    }
    let header_bytes = u64::from(bytes.u16(94, "the header's size")?);
    let data_at = u64::from(bytes.u32(96, "the offset to the points")?);
    if header_bytes < 227 || header_bytes > data_at || data_at > length {
        return wrong(
            96,
            format!("a header of {header_bytes} bytes, points from byte {data_at}, a file of {length} bytes"),
        );
    }
    if data_at > MAX_HELD_BYTES {
        return wrong(
            96,
            format!("points from byte {data_at} on: records of more than {MAX_HELD_BYTES} bytes"),
        );
    }
    let [format] = bytes.at(104, "the point format")?;
    let record_bytes = bytes.u16(105, "the size of a point")?;
    if record_bytes < 20 {
        return wrong(105, format!("a point of {record_bytes} bytes is less than any format has"));
    }
    for k in 0..6 {
        let value = f64::from_bits(bytes.u64(131 + 8 * k, "scales and offsets")?);
        if !value.is_finite() || (k < 3 && value == 0.0) {
            return wrong(
                131 + 8 * k,
                format!("a {} of {value}", if k < 3 { "scale" } else { "coordinate offset" }),
            );
        }
    }
    let mut points = u64::from(bytes.u32(107, "the number of points")?);
    if minor == 4 && points == 0 {
        points = bytes.u64(247, "the number of points")?;
    }
    // The two highest bits of the format mark compression.
    let compressed = format & 0xc0 != 0;
    let points_bytes = points.checked_mul(record_bytes.into());
    match points_bytes.and_then(|size| size.checked_add(data_at)) {
        Some(end) if compressed || end <= length => {}
        _ => {
            return wrong(
                107,
                format!(
                    "{points} points of {record_bytes} bytes from byte {data_at} do not fit in {length} bytes"
                ),
            );
        }
    }
    if minor == 4 {
        // Of compressed points only the decoder knows the end.
        let points_end = (!compressed).then_some(points_bytes.unwrap_or(0) + data_at);
        check_evlr(&mut bytes, points_end)?;
    }
    if compressed {
        check_laz(&mut bytes, header_bytes, data_at, record_bytes, points)?;
    }
    let crs = las_crs::records(&mut bytes, header_bytes, data_at, minor)?;
    let encoding = bytes.u16(6, "the global encoding")?;
    let says_wkt = encoding & 16 != 0;
    let kind = if encoding & 1 == 0 { GpsTime::Week } else { GpsTime::Standard };
    // The highest bits mark compression.
    let gps_time = (!matches!(format & 0x3f, 0 | 2)).then_some(kind);
    let mut extent = 0.0_f64;
    for k in 0..4 {
        let bound = f64::from_bits(bytes.u64(179 + 8 * k, "the bounds")?).abs();
        // A bound that is no number makes no sense of the others either.
        extent = if bound.is_finite() { extent.max(bound) } else { f64::INFINITY };
    }
    let extent = Some(extent).filter(|extent| extent.is_finite());
    Ok(LasHeader { points, compressed, gps_time, crs, says_wkt, extent })
}

fn check_evlr<R: Read + Seek>(bytes: &mut Bytes<'_, R>, points_end: Option<u64>) -> Result<(), ParseError> {
    let start = bytes.u64(235, "the first extended record")?;
    let count = bytes.u32(243, "the number of extended records")?;
    if count == 0 || start == 0 {
        return Ok(());
    }
    let claimed = start.checked_add(20).map_or(Ok(u64::MAX), |at| bytes.u64(at, "an extended record"))?;
    let end = start.checked_add(EVLR_HEAD_BYTES).and_then(|at| at.checked_add(claimed));
    if end.is_none_or(|end| end > bytes.length) {
        let problem = format!("an extended record of {claimed} bytes does not fit in {} bytes", bytes.length);
        return Err(ParseError::new(PlaceInFile::Byte(start), problem));
    }
    let gap = points_end.map_or(0, |points_end| start.saturating_sub(points_end));
    if gap.saturating_add(claimed) > MAX_HELD_BYTES {
        let problem = format!(
            "an extended record of {claimed} bytes, {gap} bytes behind the points: more than {MAX_HELD_BYTES}"
        );
        return Err(ParseError::new(PlaceInFile::Byte(start), problem));
    }
    Ok(())
}

/// The compression's own record: how points are cut into items and chunks.
struct LazItems {
    compressor: u16,
    chunk_points: u32,
    /// Layers of a chunk, for the layered formats.
    layers: u64,
}

fn check_laz<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    header_bytes: u64,
    data_at: u64,
    record_bytes: u16,
    points: u64,
) -> Result<(), ParseError> {
    let items = find_items(bytes, header_bytes, data_at, record_bytes)?;
    // Compressor 1 has all points in one chunk and no table.
    if items.compressor == 1 || points == 0 {
        return Ok(());
    }
    let mut table_at = bytes.u64(data_at, "the offset to the chunk table")?.cast_signed();
    if table_at <= data_at as i64 {
        // A writer that could not seek leaves the offset at the very end.
        table_at = bytes.u64(bytes.length.saturating_sub(8), "the offset to the chunk table")?.cast_signed();
    }
    let table_at = u64::try_from(table_at).unwrap_or(0);
    if table_at < data_at + 8 || table_at > bytes.length.saturating_sub(8) {
        let problem =
            format!("the chunk table should be at byte {table_at} of {}: is the file cut?", bytes.length);
        return Err(ParseError::new(PlaceInFile::Byte(data_at), problem));
    }
    let chunks = u64::from(bytes.u32(table_at + 4, "the number of chunks")?);
    let most_chunks = (table_at - data_at - 8) / u64::from(record_bytes);
    let variable = items.chunk_points == u32::MAX || items.chunk_points == 0;
    if chunks > most_chunks || (!variable && chunks * u64::from(items.chunk_points) < points) {
        let problem = format!(
            "{chunks} chunks of {} points in {} bytes, for {points} points",
            items.chunk_points,
            table_at - data_at - 8
        );
        return Err(ParseError::new(PlaceInFile::Byte(table_at + 4), problem));
    }
    if items.compressor == 3 {
        check_layers(bytes, data_at + 8, table_at, u64::from(record_bytes), items.layers)?;
    }
    Ok(())
}

/// Walks the chunks of a layered file: each begins with a whole point, a count, and the layers' sizes.
fn check_layers<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    mut at: u64,
    table_at: u64,
    record_bytes: u64,
    layers: u64,
) -> Result<(), ParseError> {
    while at < table_at {
        let sizes_at = at + record_bytes + 4;
        let mut next = sizes_at + 4 * layers;
        for layer in 0..layers {
            next += u64::from(bytes.u32(sizes_at + 4 * layer, "a layer's size")?);
        }
        if next > table_at {
            let problem =
                format!("a chunk claims to reach byte {next}, past the chunk table at byte {table_at}");
            return Err(ParseError::new(PlaceInFile::Byte(at), problem));
        }
        at = next;
    }
    Ok(())
}

fn find_items<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    header_bytes: u64,
    data_at: u64,
    record_bytes: u16,
) -> Result<LazItems, ParseError> {
    let count = bytes.u32(100, "the number of records")?;
    let mut at = header_bytes;
    for _ in 0..count {
        if at + VLR_HEAD_BYTES > data_at {
            break;
        }
        let user: [u8; 16] = bytes.at(at + 2, "a record")?;
        let id = bytes.u16(at + 18, "a record")?;
        let size = u64::from(bytes.u16(at + 20, "a record")?);
        if user.starts_with(b"laszip encoded") && id == 22_204 {
            return read_items(bytes, at + VLR_HEAD_BYTES, size, record_bytes);
        }
        at += VLR_HEAD_BYTES + size;
    }
    let problem = format!("compressed, but none of {count} records before byte {data_at} says how");
    Err(ParseError::new(PlaceInFile::Byte(header_bytes), problem))
}

fn read_items<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    at: u64,
    size: u64,
    record_bytes: u16,
) -> Result<LazItems, ParseError> {
    let compressor = bytes.u16(at, "the compressor")?;
    let chunk_points = bytes.u32(at + 12, "the points of a chunk")?;
    let count = u64::from(bytes.u16(at + 32, "the number of items")?);
    let wrong = |problem: String| Err(ParseError::new(PlaceInFile::Byte(at), problem));
    if !(1..=3).contains(&compressor) || count == 0 || 34 + 6 * count > size {
        return wrong(format!("compressor {compressor} with {count} items in {size} bytes"));
    }
    let (mut total, mut layers) = (0_u32, 0_u64);
    for item in 0..count {
        let item_at = at + 34 + 6 * item;
        let kind = bytes.u16(item_at, "an item")?;
        let item_bytes = bytes.u16(item_at + 2, "an item")?;
        let version = bytes.u16(item_at + 4, "an item")?;
        // Layered items (10 to 14) only in the layered compressor, versions 3 and 4; the others not.
        let layered = compressor == 3;
        let (expected, item_layers) = match (kind, layered) {
            (0, false) | (14, true) if item_bytes <= MAX_EXTRA_BYTES => (item_bytes, u64::from(item_bytes)),
            (6, false) => (20, 0),
            (7, false) => (8, 0),
            (8, false) => (6, 0),
            (9, false) => (29, 0),
            (10, true) => (30, 9),
            (11, true) => (6, 1),
            (12, true) => (8, 2),
            (13, true) => (29, 1),
            _ => {
                return wrong(format!(
                    "an item of type {kind} and {item_bytes} bytes in compressor {compressor}"
                ));
            }
        };
        let versions = if layered { 3..=4 } else { 1..=2 };
        if item_bytes != expected || !versions.contains(&version) {
            return wrong(format!("an item of type {kind} with {item_bytes} bytes in version {version}"));
        }
        total += u32::from(item_bytes);
        layers += item_layers;
    }
    if total != u32::from(record_bytes) {
        return wrong(format!("items of {total} bytes for points of {record_bytes} bytes"));
    }
    Ok(LazItems { compressor, chunk_points, layers })
}
