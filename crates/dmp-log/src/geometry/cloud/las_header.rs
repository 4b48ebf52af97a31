//! What a LAS header claims, compared with the file before anything is believed or allocated.
//!
//! Offsets are those of the LAS 1.4 R15 specification.

use dmp_lengths::thousands;

use super::las_crs::{self, CrsRecord, EVLR_HEAD_BYTES};
use crate::geometry::laz::fields::PointsHead;
use crate::geometry::laz::las_bytes::Bytes;
use crate::geometry::laz::layout::LazLayout;
use crate::{ParseError, PlaceInFile};
use std::io::{Read, Seek};
use std::sync::Arc;

/// Bytes of records in front of the points up to which a file is read: each of them is looked at.
const MAX_RECORDS_BYTES: u64 = 256 << 20;

/// Bytes of a point of each format, without extra ones.
const FORMAT_BYTES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// From where the times of points count, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GpsTime {
    /// The beginning of the week.
    Week,
    /// The GPS epoch, and 10⁹ more.
    Standard,
}

/// A LAS header that does not lie about sizes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct LasHeader {
    pub(crate) points: u64,
    pub(crate) format: u8,
    pub(crate) record_bytes: u16,
    pub(crate) data_at: u64,
    /// What a step of x, y and z is, and where they begin.
    pub(super) scales_offsets: [(f64, f64); 3],
    /// How the points are compressed, if they are.
    pub(crate) laz: Option<Arc<LazLayout>>,
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
    let magic: [u8; 4] = bytes.at(0, "the first word")?;
    if magic != *b"LASF" {
        return wrong(0, format!("a LAS file starts with LASF, this one with {magic:02x?}"));
    }
    let [major, minor] = bytes.at(24, "the version")?;
    if major != 1 || minor > 4 {
        return wrong(24, format!("LAS version {major}.{minor} is not read, 1.0 to 1.4 are"));
    }
    let header_bytes = u64::from(bytes.u16(94, "the header's size")?);
    let data_at = u64::from(bytes.u32(96, "the offset to the points")?);
    if header_bytes < 227 || header_bytes > data_at || data_at > length {
        return wrong(
            96,
            format!(
                "a header of {header_bytes} bytes, points from byte {data_at}, a file of {} bytes",
                thousands(length)
            ),
        );
    }
    if data_at > MAX_RECORDS_BYTES {
        return wrong(
            96,
            format!(
                "points from byte {data_at} on: records of more than {} bytes",
                thousands(MAX_RECORDS_BYTES)
            ),
        );
    }
    let [format] = bytes.at(104, "the point format")?;
    let record_bytes = bytes.u16(105, "the size of a point")?;
    // The two highest bits of the format mark compression.
    let (format, compressed) = (format & 0x3f, format & 0xc0 != 0);
    let Some(&format_bytes) = FORMAT_BYTES.get(usize::from(format)) else {
        return wrong(104, format!("point format {format} is not read, 0 to 10 are"));
    };
    if record_bytes < format_bytes {
        return wrong(
            105,
            format!("a point of {record_bytes} bytes is less than format {format} has, {format_bytes}"),
        );
    }
    let mut transforms = [0.0; 6];
    for (k, transform) in (0..).zip(&mut transforms) {
        let value = f64::from_bits(bytes.u64(131 + 8 * k, "scales and offsets")?);
        if !value.is_finite() || (k < 3 && value == 0.0) {
            return wrong(
                131 + 8 * k,
                format!("a {} of {value}", if k < 3 { "scale" } else { "coordinate offset" }),
            );
        }
        *transform = value;
    }
    let [sx, sy, sz, ox, oy, oz] = transforms;
    let mut points = u64::from(bytes.u32(107, "the number of points")?);
    if minor == 4 && points == 0 {
        points = bytes.u64(247, "the number of points")?;
    }
    let points_bytes = points.checked_mul(record_bytes.into());
    match points_bytes.and_then(|size| size.checked_add(data_at)) {
        Some(end) if compressed || end <= length => {}
        _ => {
            let [points, length] = [points, length].map(thousands);
            return wrong(
                107,
                format!(
                    "{points} points of {record_bytes} bytes from byte {data_at} do not fit in {length} bytes"
                ),
            );
        }
    }
    if minor == 4 {
        check_evlr(&mut bytes)?;
    }
    let head = PointsHead { header_bytes, data_at, format, record_bytes, points };
    let laz = if compressed { Some(Arc::new(LazLayout::of(&mut bytes, &head)?)) } else { None };
    let crs = las_crs::records(&mut bytes, header_bytes, data_at, minor)?;
    let encoding = bytes.u16(6, "the global encoding")?;
    let says_wkt = encoding & 16 != 0;
    let kind = if encoding & 1 == 0 { GpsTime::Week } else { GpsTime::Standard };
    let gps_time = (!matches!(format, 0 | 2)).then_some(kind);
    let mut extent = 0.0_f64;
    for k in 0..4 {
        let bound = f64::from_bits(bytes.u64(179 + 8 * k, "the bounds")?).abs();
        // A bound that is no number makes no sense of the others either.
        extent = if bound.is_finite() { extent.max(bound) } else { f64::INFINITY };
    }
    let extent = Some(extent).filter(|extent| extent.is_finite());
    let scales_offsets = [(sx, ox), (sy, oy), (sz, oz)];
    Ok(LasHeader {
        points,
        format,
        record_bytes,
        data_at,
        scales_offsets,
        laz,
        gps_time,
        crs,
        says_wkt,
        extent,
    })
}

fn check_evlr<R: Read + Seek>(bytes: &mut Bytes<'_, R>) -> Result<(), ParseError> {
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
    Ok(())
}
