//! `CustomMsg` of the Livox drivers: points with a time each, in nanoseconds after the
//! message's stamp.
//!
//! Fields as in `livox_ros_driver2/msg/CustomMsg.msg` and `CustomPoint.msg`; those of the older driver are
//! the same.

use super::cloud::Cloud;
use super::wire::{WireError, WireReader};
use crate::TimeUnit;
use crate::file::unit_since_1970;
use crate::points::{Field, Layout, NumberType};
use dmp_lengths::thousands;

/// Bytes of a point. Where numbers are aligned, one more follows it, but not behind the last.
const POINT_BYTES: u32 = 19;
const FIELDS: [(&str, usize, NumberType); 7] = [
    ("offset_time", 0, NumberType::U32),
    ("x", 4, NumberType::F32),
    ("y", 8, NumberType::F32),
    ("z", 12, NumberType::F32),
    ("reflectivity", 16, NumberType::U8),
    ("tag", 17, NumberType::U8),
    ("line", 18, NumberType::U8),
];

/// Reads and checks a message.
pub(super) fn parse(mut message: WireReader<'_>) -> Result<Cloud<'_>, WireError> {
    let (stamp_ns, frame_id) = message.header()?;
    let timebase_ns = i64::try_from(message.u64("timebase")?).unwrap_or(0);
    let _point_num = message.u32("point_num")?;
    let _lidar_id = message.u8("lidar_id")?;
    for _ in 0..3 {
        message.u8("rsvd")?;
    }
    let count = message.u32("points")? as usize;
    let (big_endian, message_is_aligned) = (message.is_big_endian(), message.is_aligned());
    let data = message.rest();
    let step = POINT_BYTES + u32::from(message_is_aligned);
    let needed = count.saturating_mul(step as usize).saturating_sub(usize::from(message_is_aligned));
    if needed > data.len() {
        let [count, bytes] = [count, data.len()].map(thousands);
        let problem = format!("{count} points of {step} bytes do not fit in {bytes} bytes of data");
        return Err(WireError(problem));
    }
    let named = FIELDS.map(|(name, offset, kind)| (name.to_owned(), Field { offset, kind }));
    let layout = Layout::new(named.into(), big_endian, step).map_err(WireError)?;
    let data = data.get(..needed).unwrap_or_default();
    // Times count from the time base, which is the stamp, where the header has one.
    let is_stamped_by_points =
        stamp_ns == 0 && unit_since_1970(timebase_ns as f64) == Some(TimeUnit::Nanoseconds);
    let stamp_ns = if is_stamped_by_points { timebase_ns } else { stamp_ns };
    Ok(Cloud {
        stamp_ns,
        is_stamped_by_points,
        frame_id,
        layout,
        width: count,
        height: 1,
        row_step: data.len(),
        data,
    })
}
