//! Poses in files: trajectories, graphs, calibrations.

mod calib;
mod g2o;
mod trajectory;

pub use calib::{Calib, find_calib, parse_calib, read_calib};
pub use g2o::{
    Candidate, CandidateFault, KeyframeTimes, KeyframeTimesFault, LoopCandidates, LoopLabels, PoseGraphFile,
    SkippedCandidate, parse_keyframe_times, parse_keyframe_times_in, parse_loop_candidates,
    parse_loop_labels, parse_pose_graph, read_keyframe_times, read_keyframe_times_in, read_loop_candidates,
    read_loop_labels, read_pose_graph, write_keyframe_times, write_pose_edges, write_pose_graph,
};
pub use trajectory::{
    GraphVertices, PoseTopic, RawTrajectory, TopicTrajectory, TrajectoryFile, TrajectoryFormat,
    TrajectoryParseError, is_bag, parse_euroc, parse_g2o, parse_kitti, parse_npy, parse_raw,
    parse_redwood_log, parse_tum, poses_at_most, read_raw_trajectory, read_raw_trajectory_as,
    read_topic_trajectory, read_trajectory, read_trajectory_as, write_euroc, write_kitti, write_redwood_log,
    write_tum, write_tum_poses,
};
