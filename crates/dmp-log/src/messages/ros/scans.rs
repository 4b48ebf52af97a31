//! The messages that hold a scan, by type and encoding.

use super::cloud::Cloud;
use super::wire::{Encoding, WireError, WireReader};
use super::{livox, point_cloud2};
use crate::messages::bag::Channel;

/// The messages that hold a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
    /// Reads and checks a message. What is wrong is said with its value.
    pub(crate) fn parse(self, message: &[u8]) -> Result<Cloud<'_>, String> {
        let cloud = WireReader::new(self.encoding, message).and_then(|message| match self.scan_type {
            ScanType::PointCloud2 => point_cloud2::parse(message),
            ScanType::LivoxCustom => livox::parse(message),
        });
        cloud.map(Cloud::stamped).map_err(|WireError(problem)| problem)
    }
}
