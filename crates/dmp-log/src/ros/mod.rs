//! Messages of ROS.

mod cloud;
mod livox;
mod point_cloud2;
mod poses;
mod scans;
mod wire;
mod write;

pub(crate) use cloud::Cloud;
pub(crate) use poses::{PoseCoding, PoseType, StampedPose};
pub(crate) use scans::ScanCoding;
pub(crate) use wire::{CdrWriter, Encoding, RosStamp, WireError, WireReader};
pub(crate) use write::{FLOAT32, INT32, PointField, UINT8, UINT32, start_cloud, write_transform};

/// The definition of `sensor_msgs/msg/PointCloud2`, as a writer has to give it.
pub(crate) const POINT_CLOUD2_SCHEMA: &str = include_str!("point_cloud2_schema.txt");

/// The definition of `tf2_msgs/msg/TFMessage`.
pub(crate) const TF_MESSAGE_SCHEMA: &str = include_str!("tf_message_schema.txt");
