//! Messages of ROS.

mod livox;
mod point_cloud2;
mod poses;
mod wire;
mod write;

use crate::bag::Channel;
use crate::points::{Layout, Rows};
pub(crate) use poses::{PoseCoding, PoseType, StampedPose};
pub(crate) use wire::{CdrWriter, Encoding, RosStamp, WireError, WireReader};
pub(crate) use write::{FLOAT32, INT32, PointField, UINT8, UINT32, start_cloud, write_transform};

/// The definition of `sensor_msgs/msg/PointCloud2`, as a writer has to give it.
pub(crate) const POINT_CLOUD2_SCHEMA: &str = include_str!("point_cloud2_schema.txt");

/// The definition of `tf2_msgs/msg/TFMessage`.
pub(crate) const TF_MESSAGE_SCHEMA: &str = include_str!("tf_message_schema.txt");

/// The messages that hold a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ScanType {
    PointCloud2,
    LivoxCustom,
}

impl ScanType {
    /// By the name of a message's type, in ROS 2's spelling or in ROS 1's.
    fn of(message_type: &str) -> Option<Self> {
        match message_type {
            "sensor_msgs/msg/PointCloud2" | "sensor_msgs/PointCloud2" => Some(Self::PointCloud2),
            "livox_ros_driver2/msg/CustomMsg"
            | "livox_ros_driver/msg/CustomMsg"
            | "livox_interfaces/msg/CustomMsg"
            | "livox_ros_driver2/CustomMsg"
            | "livox_ros_driver/CustomMsg" => Some(Self::LivoxCustom),
            _ => None,
        }
    }
}

/// A kind of message with a scan, and how it is put into bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScanCoding {
    scan_type: ScanType,
    encoding: Encoding,
}

impl ScanCoding {
    /// That of a channel's messages; `None` where they hold no scans that are read.
    pub(crate) fn of(channel: &Channel) -> Option<Self> {
        let scan_type = ScanType::of(&channel.message_type)?;
        Some(Self { scan_type, encoding: Encoding::of(&channel.encoding)? })
    }
}

/// A message with a scan, checked: `data` holds every point that it promises.
#[derive(Debug)]
pub(crate) struct Cloud<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame_id: &'a str,
    pub(crate) layout: Layout,
    width: usize,
    height: usize,
    row_step: usize,
    data: &'a [u8],
}

impl<'a> Cloud<'a> {
    /// Reads and checks a message. What is wrong is said with its value.
    pub(crate) fn parse(coding: ScanCoding, message: &'a [u8]) -> Result<Self, String> {
        let cloud = WireReader::new(coding.encoding, message).and_then(|message| match coding.scan_type {
            ScanType::PointCloud2 => point_cloud2::parse(message),
            ScanType::LivoxCustom => livox::parse(message),
        });
        cloud.map_err(|WireError(problem)| problem)
    }

    pub(crate) fn returns(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    pub(crate) fn rows(&self) -> Rows<'_> {
        let Self { layout, data, .. } = self;
        Rows { layout, data, width: self.width, height: self.height, row_step: self.row_step }
    }
}
