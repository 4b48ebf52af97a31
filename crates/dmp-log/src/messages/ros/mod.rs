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
pub(crate) use write::{
    FLOAT32, INT32, OpenCloud, PointField, TextMarker, UINT8, UINT32, start_cloud, write_log, write_path,
    write_pose, write_range, write_texts, write_transform,
};

/// The definition of `sensor_msgs/msg/PointCloud2`, as a writer has to give it.
pub(crate) const POINT_CLOUD2_SCHEMA: &str = include_str!("point_cloud2_schema.txt");

/// The definition of `tf2_msgs/msg/TFMessage`.
pub(crate) const TF_MESSAGE_SCHEMA: &str = include_str!("tf_message_schema.txt");

/// The definition of `geometry_msgs/msg/PoseStamped`.
pub(crate) const POSE_STAMPED_SCHEMA: &str = include_str!("pose_stamped_schema.txt");

/// The definition of `nav_msgs/msg/Path`.
pub(crate) const PATH_SCHEMA: &str = include_str!("path_schema.txt");

/// The definition of `sensor_msgs/msg/Range`.
pub(crate) const RANGE_SCHEMA: &str = include_str!("range_schema.txt");

/// The definition of `rcl_interfaces/msg/Log`.
pub(crate) const LOG_SCHEMA: &str = include_str!("log_schema.txt");

/// The definition of `visualization_msgs/msg/MarkerArray`.
pub(crate) const MARKER_ARRAY_SCHEMA: &str = include_str!("marker_array_schema.txt");
