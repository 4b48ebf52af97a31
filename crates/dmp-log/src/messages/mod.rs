//! Bags, and the ROS messages in them.

mod bag;
mod frames;
mod mcap_file;
mod ros;

pub(crate) use bag::{
    Bag, BagFound, BagIndex, BagReader, Channel, IndexedBag, IndexedPlace, Location, Message, in_words,
};
pub use frames::StaticFrames;
pub(crate) use frames::{STATIC_TOPIC, frame_name};
pub use mcap_file::McapCompression;
pub(crate) use mcap_file::McapFile;
pub(crate) use ros::{
    CdrWriter, Cloud, FLOAT32, INT32, LOG_SCHEMA, MARKER_ARRAY_SCHEMA, OpenCloud, PATH_SCHEMA,
    POINT_CLOUD2_SCHEMA, POSE_STAMPED_SCHEMA, PointField, PoseCoding, PoseType, RANGE_SCHEMA, RosStamp,
    ScanCoding, StampedPose, TF_MESSAGE_SCHEMA, TextMarker, UINT8, UINT32, start_cloud, write_log,
    write_path, write_pose, write_range, write_texts, write_transform,
};
