//! Messages of ROS 2, written.

use super::wire::{CdrWriter, RosStamp};
use dmp_sensor::{Isometry3, UnitQuaternion};

/// A field of a point: its name and its type as numbered by `sensor_msgs/msg/PointField`.
pub(crate) type PointField = (&'static str, u8);

/// `UINT8`, `INT32`, `UINT32`, `FLOAT32` of `sensor_msgs/msg/PointField`.
pub(crate) const UINT8: u8 = 2;
pub(crate) const INT32: u8 = 5;
pub(crate) const UINT32: u8 = 6;
pub(crate) const FLOAT32: u8 = 7;

/// A cloud to which points are being put, and where its message has their number.
#[derive(Debug)]
pub(crate) struct OpenCloud {
    width_at: usize,
    data_at: usize,
    point_bytes: usize,
}

/// Starts a `sensor_msgs/msg/PointCloud2` of one row whose points have these fields one after the other. Its points, of
/// `point_bytes` each and about so many, are to be put behind. More than a message can hold is an error.
pub(crate) fn start_cloud(
    message: &mut CdrWriter,
    stamp: RosStamp,
    frame_id: &str,
    fields: &[PointField],
    (point_bytes, points): (usize, usize),
) -> Result<OpenCloud, String> {
    let data_bytes = bytes_of(points.saturating_mul(point_bytes), point_bytes)?;
    message.start();
    message.header(stamp, frame_id);
    message.u32(1);
    message.u32(0);
    let width_at = message.message().len() - 4;
    message.u32(fields.len() as u32);
    let mut offset = 0;
    for &(name, datatype) in fields {
        message.string(name);
        message.u32(offset);
        message.u8(datatype);
        message.u32(1);
        offset += if datatype == UINT8 { 1 } else { 4 };
    }
    message.u8(0);
    message.u32(point_bytes as u32);
    message.u32(0);
    message.u32(0);
    let data_at = message.message().len();
    message.message().reserve(data_bytes as usize + 1);
    Ok(OpenCloud { width_at, data_at, point_bytes })
}

/// Bytes of a cloud, as its message has them.
fn bytes_of(bytes: usize, point_bytes: usize) -> Result<u32, String> {
    let too_many = |_| format!("{} points are more than 32 bits of bytes", bytes / point_bytes.max(1));
    u32::try_from(bytes).map_err(too_many)
}

impl OpenCloud {
    /// Ends the cloud; returns how many points were put there. `is_dense` says that each has its place.
    pub(crate) fn close(&self, message: &mut CdrWriter, is_dense: bool) -> Result<u32, String> {
        let data_bytes = bytes_of(message.message().len() - self.data_at, self.point_bytes)?;
        let points = data_bytes / self.point_bytes as u32;
        for (at, value) in
            [(self.width_at, points), (self.data_at - 8, data_bytes), (self.data_at - 4, data_bytes)]
        {
            message.message()[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        message.u8(u8::from(is_dense));
        Ok(points)
    }
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
    write_place_and_turn(message, parent_from_child);
}

/// A `geometry_msgs/msg/PoseStamped`: `frame_from_body`.
pub(crate) fn write_pose(
    message: &mut CdrWriter,
    stamp: RosStamp,
    frame_id: &str,
    frame_from_body: &Isometry3<f64>,
) {
    message.start();
    message.header(stamp, frame_id);
    write_place_and_turn(message, frame_from_body);
}

/// A `nav_msgs/msg/Path` of poses in its frame.
pub(crate) fn write_path(
    message: &mut CdrWriter,
    stamp: RosStamp,
    frame_id: &str,
    poses: &[(RosStamp, Isometry3<f64>)],
) {
    message.start();
    message.header(stamp, frame_id);
    message.u32(poses.len() as u32);
    for (stamp, frame_from_body) in poses {
        message.header(*stamp, frame_id);
        write_place_and_turn(message, frame_from_body);
    }
}

/// A `sensor_msgs/msg/Range`: a length from 0 to `most_m`, metres. NaN where there is none.
pub(crate) fn write_range(
    message: &mut CdrWriter,
    stamp: RosStamp,
    frame_id: &str,
    [length_m, most_m]: [f32; 2],
) {
    message.start();
    message.header(stamp, frame_id);
    // Infrared: nothing that lengths of a LiDAR are called is there.
    message.u8(1);
    // The width of a cone that there is not; the least length, the largest one; its variance, which is not known.
    [0.0, 0.0, most_m, length_m, 0.0].into_iter().for_each(|number| message.f32(number));
}

/// An `rcl_interfaces/msg/Log` at the level of warnings.
pub(crate) fn write_log(message: &mut CdrWriter, stamp: RosStamp, name: &str, text: &str) {
    message.start();
    message.stamp(stamp);
    message.u8(30);
    [name, text, "", ""].into_iter().for_each(|text| message.string(text));
    message.u32(0);
}

/// A text at a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextMarker<'a> {
    pub(crate) place_m: [f64; 3],
    pub(crate) text: &'a str,
}

/// A `visualization_msgs/msg/MarkerArray` of texts that face the viewer, so high and in this colour.
pub(crate) fn write_texts(
    message: &mut CdrWriter,
    stamp: RosStamp,
    [frame_id, namespace]: [&str; 2],
    (height_m, rgb): (f64, [u8; 3]),
    texts: &[TextMarker<'_>],
) {
    message.start();
    message.u32(texts.len() as u32);
    for (number, marker) in texts.iter().enumerate() {
        message.header(stamp, frame_id);
        message.string(namespace);
        // Its number; a text that faces the viewer; to be added.
        [number as u32, 9, 0].into_iter().for_each(|number| message.u32(number));
        write_place_and_turn(
            message,
            &Isometry3::from_parts(marker.place_m.into(), UnitQuaternion::identity()),
        );
        [0.0, 0.0, height_m].into_iter().for_each(|number| message.f64(number));
        rgb.into_iter().for_each(|channel| message.f32(f32::from(channel) / 255.0));
        message.f32(1.0);
        // For ever, not fixed to its frame; no points, no colours of theirs, no name of a texture.
        [0, 0].into_iter().for_each(|number| message.u32(number));
        message.u8(0);
        [0, 0].into_iter().for_each(|number| message.u32(number));
        message.string("");
        // An empty texture and where on it; the text; no mesh.
        message.header(RosStamp::ZERO, "");
        message.string("");
        [0, 0].into_iter().for_each(|number| message.u32(number));
        message.string(marker.text);
        message.string("");
        message.string("");
        message.u32(0);
        message.u8(0);
    }
}

/// Three and four numbers, as `geometry_msgs/msg/Pose` and `Transform` have them.
fn write_place_and_turn(message: &mut CdrWriter, pose: &Isometry3<f64>) {
    let (place, turn) = (pose.translation.vector, pose.rotation.coords);
    for number in place.iter().chain(turn.iter()) {
        message.f64(*number);
    }
}
