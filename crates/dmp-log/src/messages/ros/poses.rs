//! Messages with poses: `nav_msgs/Odometry`, `geometry_msgs/PoseStamped`, `PoseWithCovarianceStamped`,
//! `TransformStamped`, `nav_msgs/Path`, `tf2_msgs/TFMessage`.

use super::{Encoding, WireError, WireReader};
use crate::messages::bag::Channel;

/// The messages that hold poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseType {
    Odometry,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Path,
    Transforms,
}

impl PoseType {
    /// By the name of a message's type, in ROS 2's spelling or in ROS 1's.
    fn of(message_type: &str) -> Option<Self> {
        match message_type {
            "nav_msgs/msg/Odometry" | "nav_msgs/Odometry" => Some(Self::Odometry),
            "geometry_msgs/msg/PoseStamped" | "geometry_msgs/PoseStamped" => Some(Self::PoseStamped),
            "geometry_msgs/msg/PoseWithCovarianceStamped" | "geometry_msgs/PoseWithCovarianceStamped" => {
                Some(Self::PoseWithCovarianceStamped)
            }
            "geometry_msgs/msg/TransformStamped" | "geometry_msgs/TransformStamped" => {
                Some(Self::TransformStamped)
            }
            "nav_msgs/msg/Path" | "nav_msgs/Path" => Some(Self::Path),
            "tf2_msgs/msg/TFMessage" | "tf2_msgs/TFMessage" | "tf/tfMessage" => Some(Self::Transforms),
            _ => None,
        }
    }

    /// Its name for people.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Odometry => "Odometry",
            Self::PoseStamped => "PoseStamped",
            Self::PoseWithCovarianceStamped => "PoseWithCovarianceStamped",
            Self::TransformStamped => "TransformStamped",
            Self::Path => "Path",
            Self::Transforms => "TFMessage",
        }
    }
}

/// A kind of message with poses, and how it is put into bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PoseCoding {
    pub(crate) pose_type: PoseType,
    encoding: Encoding,
}

/// A pose as a message has it, unchecked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StampedPose<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame: &'a str,
    /// The frame whose pose it is, where the message names it.
    pub(crate) child: Option<&'a str>,
    pub(crate) position_m: [f64; 3],
    /// x, y, z, w.
    pub(crate) quaternion: [f64; 4],
}

impl PoseCoding {
    /// That of a channel's messages; `None` where they hold no poses that are read.
    pub(crate) fn of(channel: &Channel) -> Option<Self> {
        let pose_type = PoseType::of(&channel.message_type)?;
        Some(Self { pose_type, encoding: Encoding::of(&channel.encoding)? })
    }

    /// The poses of a message, in its order.
    pub(crate) fn parse(self, message: &[u8]) -> Result<Vec<StampedPose<'_>>, String> {
        let mut poses = Vec::new();
        let mut read = || -> Result<(), WireError> {
            let mut message = WireReader::new(self.encoding, message)?;
            match self.pose_type {
                PoseType::Odometry | PoseType::TransformStamped => poses.push(pose(&mut message, true)?),
                PoseType::PoseStamped | PoseType::PoseWithCovarianceStamped => {
                    poses.push(pose(&mut message, false)?);
                }
                PoseType::Path => {
                    message.header()?;
                    for _ in 0..message.u32("poses")? {
                        poses.push(pose(&mut message, false)?);
                    }
                }
                PoseType::Transforms => {
                    for _ in 0..message.u32("transforms")? {
                        poses.push(pose(&mut message, true)?);
                    }
                }
            }
            Ok(())
        };
        read().map_err(|WireError(problem)| problem)?;
        Ok(poses)
    }
}

/// A header, perhaps the child's name, a place and a quaternion: how all of these messages begin.
fn pose<'a>(message: &mut WireReader<'a>, with_child: bool) -> Result<StampedPose<'a>, WireError> {
    let (stamp_ns, frame) = message.header()?;
    let child = if with_child { Some(message.string("child_frame_id")?) } else { None };
    let mut numbers = [0.0; 7];
    for (number, what) in numbers.iter_mut().zip(["x", "y", "z", "qx", "qy", "qz", "qw"]) {
        *number = message.f64(what)?;
    }
    let [x, y, z, quaternion @ ..] = numbers;
    Ok(StampedPose { stamp_ns, frame, child, position_m: [x, y, z], quaternion })
}
