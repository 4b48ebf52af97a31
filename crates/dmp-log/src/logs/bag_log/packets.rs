//! Messages with scans that are not read as they are: packets of a sensor, whose points need the calibration that its driver has,
//! compressed clouds, clouds of Foxglove.

use crate::TopicInfo;
use crate::file::shorten;

/// Beginning and end of the messages' type, what they hold, and what makes clouds of them in ROS 1 and in ROS 2.
const UNREAD: [(&str, &str, &str, [&str; 2]); 4] = [
    (
        "velodyne_msgs/",
        "/VelodyneScan",
        "packets, no points",
        [
            "run `roslaunch velodyne_pointcloud VLP16_points.launch` beside `rosbag play BAG` and record /velodyne_points",
            "run `ros2 launch velodyne_pointcloud velodyne_transform_node-VLP16-launch.py` beside `ros2 bag play BAG` and record \
             /velodyne_points",
        ],
    ),
    (
        "ouster_",
        "/PacketMsg",
        "packets, no points",
        [
            "run `roslaunch ouster_ros replay.launch bag_file:=BAG metadata:=FILE.json` and record /ouster/points",
            "run `ros2 launch ouster_ros replay.composite.launch.xml bag_file:=BAG metadata:=FILE.json` and record /ouster/points",
        ],
    ),
    (
        "",
        "/CompressedPointCloud2",
        "compressed points, which are not read",
        [
            "run `rosrun point_cloud_transport republish draco in:=TOPIC raw out:=/points` beside `rosbag play BAG` and record /points",
            "run `ros2 run point_cloud_transport republish --ros-args -p in_transport:=draco -p out_transport:=raw -r \
             in/draco:=TOPIC -r out:=/points` beside `ros2 bag play BAG` and record /points",
        ],
    ),
    (
        "foxglove",
        "PointCloud",
        "points as Foxglove writes them, which are not read",
        ["write them as sensor_msgs/PointCloud2, or each scan as a .pcd"; 2],
    ),
];

/// What to do where a log has such messages and no clouds; nothing where it has none.
pub(super) fn advice(topics: &[TopicInfo]) -> String {
    for topic in topics {
        // Behind the type stands the encoding.
        let name = topic.message_type.rsplit_once(" (").map_or("", |(name, _)| name);
        let is_of = |begin: &str, end: &str| name.starts_with(begin) && name.ends_with(end);
        let Some((.., what, to_do)) = UNREAD.iter().find(|(begin, end, ..)| is_of(begin, end)) else {
            continue;
        };
        let to_do = to_do[usize::from(!topic.message_type.ends_with("(ros1)"))];
        return format!(": {} holds {what}: {to_do}", shorten(&topic.name));
    }
    String::new()
}
