//! Trajectories in files.

mod described;
mod error;
mod euroc;
mod format;
mod g2o;
mod kitti;
mod matrices;
mod named;
mod npy;
mod raw;
mod read;
mod redwood;
mod stamps;
mod topic;
mod tree;
mod tum;

pub use error::TrajectoryParseError;
pub use euroc::{parse_euroc, write_euroc};
pub use format::TrajectoryFormat;
pub use g2o::{GraphVertices, parse_g2o};
pub use kitti::{parse_kitti, write_kitti};
pub use npy::parse_npy;
pub use raw::{RawTrajectory, parse_raw, read_raw_trajectory, read_raw_trajectory_as};
pub use read::{TrajectoryFile, poses_at_most, read_trajectory, read_trajectory_as};
pub use redwood::{parse_redwood_log, write_redwood_log};
pub use topic::{PoseTopic, TopicTrajectory, is_bag, read_topic_trajectory};
pub use tum::{parse_tum, write_tum, write_tum_poses};
