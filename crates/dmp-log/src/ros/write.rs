//! Messages of ROS 2, written.

use super::wire::{CdrWriter, RosStamp};
use dmp_sensor::Isometry3;

/// A field of a point: its name and its type as numbered by `sensor_msgs/msg/PointField`.
pub(crate) type PointField = (&'static str, u8);

/// `UINT8`, `INT32`, `UINT32`, `FLOAT32` of `sensor_msgs/msg/PointField`.
pub(crate) const UINT8: u8 = 2;
pub(crate) const INT32: u8 = 5;
pub(crate) const UINT32: u8 = 6;
pub(crate) const FLOAT32: u8 = 7;

/// Starts a `sensor_msgs/msg/PointCloud2` of one row whose points have these fields one after the other. Its points, of
/// `point_bytes` each, and the byte `is_dense` are to be put behind.
pub(crate) fn start_cloud(
    message: &mut CdrWriter,
    stamp: RosStamp,
    frame_id: &str,
    fields: &[PointField],
    point_bytes: usize,
    points: usize,
) {
    message.start();
    message.header(stamp, frame_id);
    message.u32(1);
    message.u32(points as u32);
    message.u32(fields.len() as u32);
    let mut offset = 0;
    for &(name, datatype) in fields {
        message.string(name);
        message.u32(offset);
        message.u8(datatype);
        message.u32(1);
        offset += if datatype == UINT8 { 1 } else { 4 };
    }
    let data_bytes = (point_bytes * points) as u32;
    message.u8(0);
    message.u32(point_bytes as u32);
    message.u32(data_bytes);
    message.u32(data_bytes);
    message.message().reserve(point_bytes * points);
}

/// A `tf2_msgs/msg/TFMessage` with one transform, `parent_from_child`.
pub(crate) fn write_transform(
    message: &mut CdrWriter,
    stamp: RosStamp,
    [parent, child]: [&str; 2],
    parent_from_child: &Isometry3<f64>,
) {
    message.start();
    message.u32(1);
    message.header(stamp, parent);
    message.string(child);
    let (place, turn) = (parent_from_child.translation.vector, parent_from_child.rotation.coords);
    for number in place.iter().chain(turn.iter()) {
        message.f64(*number);
    }
}
