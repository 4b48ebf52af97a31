//! `sensor_msgs/msg/PointCloud2`: its header and the layout of its points.

use super::cloud::Cloud;
use super::wire::{WireError, WireReader};
use crate::points::{Field, Layout, NumberType};
use dmp_lengths::thousands;

/// A type as numbered by `sensor_msgs/msg/PointField`.
fn kind_of(datatype: u8) -> Option<NumberType> {
    Some(match datatype {
        1 => NumberType::I8,
        2 => NumberType::U8,
        3 => NumberType::I16,
        4 => NumberType::U16,
        5 => NumberType::I32,
        6 => NumberType::U32,
        7 => NumberType::F32,
        8 => NumberType::F64,
        _ => return None,
    })
}

/// Reads and checks a message.
pub(super) fn parse(mut message: WireReader<'_>) -> Result<Cloud<'_>, WireError> {
    let (stamp_ns, frame_id) = message.header()?;
    let height = message.u32("height")?;
    let width = message.u32("width")?;
    let mut fields = Vec::new();
    for _ in 0..message.u32("fields")? {
        let name = message.string("a field's name")?;
        let offset = message.u32("a field's offset")?;
        let datatype = message.u8("a field's type")?;
        let _count = message.u32("a field's count")?;
        fields.push((name, offset, datatype));
    }
    let big_endian = message.u8("is_bigendian")? != 0;
    let point_step = message.u32("point_step")?;
    let row_step = message.u32("row_step")?;
    let data = message.bytes("data")?;
    // `is_dense` is often wrong; whether a point is finite is seen from the point.
    let returns = u64::from(height) * u64::from(width);
    let layout = layout_of(&fields, big_endian, point_step, returns == 0).map_err(WireError)?;
    let row_step = check_size(height, width, point_step, row_step, data.len() as u64).map_err(WireError)?;
    let [width, height] = [width, height].map(|count| count as usize);
    Ok(Cloud { stamp_ns, is_stamped_by_points: false, frame_id, layout, width, height, row_step, data })
}

fn layout_of(
    fields: &[(&str, u32, u8)],
    big_endian: bool,
    point_step: u32,
    empty: bool,
) -> Result<Layout, String> {
    if let (false, Some((name, _, datatype))) =
        (empty, fields.iter().find(|(name, _, datatype)| is_axis(name) && kind_of(*datatype).is_none()))
    {
        return Err(format!("field `{name}` has the unknown type {datatype}"));
    }
    let known = fields.iter().filter_map(|&(name, offset, datatype)| {
        let field = Field { offset: offset as usize, kind: kind_of(datatype)? };
        Some((name.to_owned(), field))
    });
    // Drivers send empty clouds without any layout.
    if empty {
        return Ok(Layout::of_nothing(known.collect(), big_endian, point_step));
    }
    Layout::new(known.collect(), big_endian, point_step)
}

fn is_axis(name: &str) -> bool {
    matches!(name, "x" | "y" | "z")
}

/// Compares the claimed size with the bytes that are there; the bytes from row to row.
fn check_size(height: u32, width: u32, point_step: u32, row_step: u32, data: u64) -> Result<usize, String> {
    let row_bytes = u64::from(width) * u64::from(point_step);
    // One row needs no step to the next, and drivers leave it 0.
    let row_step = if height <= 1 { row_bytes } else { u64::from(row_step) };
    if row_step < row_bytes {
        return Err(format!(
            "row_step is {row_step}, less than {} points of {point_step} bytes",
            thousands(width)
        ));
    }
    let needed = match u64::from(height) {
        0 => Some(0),
        height => row_step.checked_mul(height - 1).and_then(|before| before.checked_add(row_bytes)),
    };
    match needed {
        Some(needed) if needed <= data => Ok(row_step as usize),
        _ => Err(format!(
            "{} rows of {} points of {point_step} bytes do not fit in {} bytes of data",
            thousands(height),
            thousands(width),
            thousands(data)
        )),
    }
}
