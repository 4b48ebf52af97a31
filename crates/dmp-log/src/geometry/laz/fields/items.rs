//! How the points of a file are compressed: the record by `LASzip` in front of them, checked against the header.

use crate::geometry::laz::fields::point14;
use crate::geometry::laz::las_bytes::{Bytes, VLR_HEAD_BYTES};
use crate::{ParseError, PlaceInFile};
use std::io::{Read, Seek};

/// Extra bytes of a point up to which files are read; each costs kilobytes of decoder.
const MAX_EXTRA_BYTES: u16 = 1024;

/// What a header says of the points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointsHead {
    pub(crate) header_bytes: u64,
    pub(crate) data_at: u64,
    pub(crate) format: u8,
    pub(crate) record_bytes: u16,
    pub(crate) points: u64,
}

/// Fields of a point that are compressed together, by the names of `LASzip`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ItemKind {
    Byte,
    Point10,
    GpsTime11,
    Rgb12,
    Wavepacket13,
    Point14,
    Rgb14,
    RgbNir14,
    Wavepacket14,
    Byte14,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Item {
    pub(crate) kind: ItemKind,
    pub(crate) bytes: u16,
    pub(crate) version: u16,
}

impl Item {
    fn of(kind: u16, bytes: u16, version: u16) -> Option<Self> {
        let (kind, expected) = match kind {
            0 => (ItemKind::Byte, bytes.min(MAX_EXTRA_BYTES)),
            6 => (ItemKind::Point10, 20),
            7 => (ItemKind::GpsTime11, 8),
            8 => (ItemKind::Rgb12, 6),
            9 => (ItemKind::Wavepacket13, 29),
            10 => (ItemKind::Point14, 30),
            11 => (ItemKind::Rgb14, 6),
            12 => (ItemKind::RgbNir14, 8),
            13 => (ItemKind::Wavepacket14, 29),
            14 => (ItemKind::Byte14, bytes.min(MAX_EXTRA_BYTES)),
            _ => return None,
        };
        (bytes == expected).then_some(Self { kind, bytes, version })
    }

    fn is_layered(&self) -> bool {
        self.layers() > 0 || self.kind == ItemKind::Byte14
    }

    pub(crate) fn layers(&self) -> u64 {
        match self.kind {
            ItemKind::Point14 => point14::LAYERS,
            ItemKind::Rgb14 | ItemKind::Wavepacket14 => 1,
            ItemKind::RgbNir14 => 2,
            ItemKind::Byte14 => self.bytes.into(),
            _ => 0,
        }
    }
}

/// How chunks are cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cutting {
    /// All points are one chunk, and there is no table.
    Whole,
    /// So many points each.
    Fixed(u32),
    /// The table says how many.
    Variable,
}

/// What the record says.
#[derive(Debug)]
pub(crate) struct Compression {
    pub(crate) cutting: Cutting,
    pub(crate) items: Vec<Item>,
    pub(crate) is_layered: bool,
}

/// Where the record is, and its size.
fn find_record<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    head: &PointsHead,
) -> Result<(u64, u64), ParseError> {
    let count = bytes.u32(100, "the number of records")?;
    let mut at = head.header_bytes;
    for _ in 0..count {
        if at + VLR_HEAD_BYTES > head.data_at {
            break;
        }
        let user: [u8; 16] = bytes.at(at + 2, "a record")?;
        let id = bytes.u16(at + 18, "a record")?;
        let size = u64::from(bytes.u16(at + 20, "a record")?);
        if user.starts_with(b"laszip encoded") && id == 22_204 {
            return Ok((at + VLR_HEAD_BYTES, size));
        }
        at += VLR_HEAD_BYTES + size;
    }
    let problem = format!("compressed, but none of {count} records before byte {} says how", head.data_at);
    Err(ParseError::new(PlaceInFile::Byte(head.header_bytes), problem))
}

/// What the record says, compared with the header.
pub(crate) fn compression<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    head: &PointsHead,
) -> Result<Compression, ParseError> {
    const REWRITE: &str = "is not read: rewrite the file with las2las or pdal";
    let (at, size) = find_record(bytes, head)?;
    let compressor = bytes.u16(at, "the compressor")?;
    let cutting = match bytes.u32(at + 12, "the points of a chunk")? {
        _ if compressor == 1 => Cutting::Whole,
        0 | u32::MAX => Cutting::Variable,
        points => Cutting::Fixed(points),
    };
    let count = u64::from(bytes.u16(at + 32, "the number of items")?);
    let wrong = |problem: String| Err(ParseError::new(PlaceInFile::Byte(at), problem));
    if !(1..=3).contains(&compressor) || count == 0 || 34 + 6 * count > size {
        return wrong(format!("compressor {compressor} with {count} items in {size} bytes"));
    }
    let is_layered = compressor == 3;
    let mut items = Vec::new();
    for item_at in (0..count).map(|item| at + 34 + 6 * item) {
        let kind = bytes.u16(item_at, "an item")?;
        let item_bytes = bytes.u16(item_at + 2, "an item")?;
        let version = bytes.u16(item_at + 4, "an item")?;
        let Some(item) = Item::of(kind, item_bytes, version).filter(|item| item.is_layered() == is_layered)
        else {
            return wrong(format!(
                "an item of type {kind} and {item_bytes} bytes in compressor {compressor}"
            ));
        };
        let known = if is_layered { 3..=4 } else { 1..=2 };
        if !known.contains(&version) || (item.kind == ItemKind::Byte && version == 1) {
            return wrong(format!("an item of type {kind} in version {version} {REWRITE}"));
        }
        items.push(item);
    }
    let total: u64 = items.iter().map(|item| u64::from(item.bytes)).sum();
    if total != u64::from(head.record_bytes) {
        return wrong(format!("items of {total} bytes for points of {} bytes", head.record_bytes));
    }
    let expected: &[ItemKind] = match head.format {
        0 | 2 => &[ItemKind::Point10],
        1 | 3..=5 => &[ItemKind::Point10, ItemKind::GpsTime11],
        _ => &[ItemKind::Point14],
    };
    // What follows is passed over, once in each point.
    let kinds: Vec<ItemKind> = items.iter().map(|item| item.kind).collect();
    if !kinds.starts_with(expected) || kinds.iter().skip(1).any(|kind| kinds[0] == *kind) {
        return wrong(format!("items {kinds:?} are not those of point format {}", head.format));
    }
    Ok(Compression { cutting, items, is_layered })
}
