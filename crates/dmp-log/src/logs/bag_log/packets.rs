//! Packets of a sensor as they came over the network: their points need the sensor's calibration, which its driver has.

use crate::TopicInfo;
use crate::file::shorten;

/// Beginning of the messages' type, what makes clouds of them in ROS 1 and in ROS 2, and the topic of these.
const PACKETS: [(&str, [&str; 2], &str); 2] = [
    (
        "velodyne_msgs/",
        [
            "roslaunch velodyne_pointcloud VLP16_points.launch` beside `rosbag play BAG",
            "ros2 launch velodyne_pointcloud velodyne_transform_node-VLP16-launch.py` beside `ros2 bag play BAG",
        ],
        "/velodyne_points",
    ),
    (
        "ouster_",
        [
            "roslaunch ouster_ros replay.launch bag_file:=BAG metadata:=FILE.json",
            "ros2 launch ouster_ros replay.composite.launch.xml bag_file:=BAG metadata:=FILE.json",
        ],
        "/ouster/points",
    ),
];

/// What to do where a log has packets of the sensor and no clouds; nothing where it has none.
pub(super) fn advice(topics: &[TopicInfo]) -> String {
    for topic in topics {
        let is_packet = |end: &str| topic.message_type.contains(end);
        let Some((_, commands, points)) = PACKETS.iter().find(|(begin, ..)| {
            topic.message_type.starts_with(begin) && (is_packet("/VelodyneScan ") || is_packet("/PacketMsg "))
        }) else {
            continue;
        };
        let command = commands[usize::from(!topic.message_type.ends_with("(ros1)"))];
        let name = shorten(&topic.name);
        return format!(": {name} holds packets, no points: run `{command}` and record {points}");
    }
    String::new()
}
