//! Users' files to and from scans, trajectories and point clouds. No other crate knows a foreign format.
//!
//! # Brief overview
//! [`open_log`] looks at a path, opens what is there and gives a [`ScanLog`]: a table of its scans
//! ([`FrameInfo`]), a [`LogSummary`] of what was found, guessed and damaged, and a [`ScanReader`] for each
//! thread, which fills a [`Scan`](dmp_sensor::Scan) with one scan at a time. [`read_trajectory`] reads
//! poses, [`read_pose_graph`] a graph of them and [`read_loop_candidates`] edges that it might have,
//! [`read_loop_labels`] which of those are true and [`read_keyframe_times`] when its vertices were.
//! [`outline_log`] lists the scans of a log from its index and opens a part of them; [`ScanLog::index`] says where they lie, so
//! that [`LogIndex::open`] opens the log again in another process without reading it. [`MemoryLog`] makes a log of
//! scans that a program has already. [`read_cloud`] streams the points of a map, [`read_mesh`] the triangles of a
//! reference.
//! [`McapScanWriter`], [`FolderScanWriter`], [`DepthFolderWriter`], [`write_tum`], [`write_euroc`], [`write_kitti`], [`write_redwood_log`] and [`write_pose_graph`] write what the
//! readers read; [`ResidualWriter`] writes scored returns for people to look at, [`SceneWriter`] maps, ways and returns of all runs for viewers. [`read_calib`] says where a LiDAR sits on a camera.
//!
//! | what | formats |
//! |---|---|
//! | scan log | MCAP, rosbag2 and bags of ROS 1 with `sensor_msgs/msg/PointCloud2` or Livox `CustomMsg`; a folder with one scan a file: KITTI `.bin` (with `times/*.f32`), PCD, PLY, LAS or LAZ, with stamps in a `times.txt`, a `timestamps.txt` or the file names; one LAS or LAZ in world coordinates with `gps_time`, and the trajectory it was made with; a folder of depth images (16-bit PNG): TUM RGB-D, ICL-NUIM, Redwood, with a `camera.json` |
//! | trajectory | TUM; KITTI rows and `.npy`, with `times.txt`; EuRoC csv; vertices of g2o graphs; Redwood `.log`; csv whose columns have names |
//! | pose graph, loop candidates | g2o, in space |
//! | labels of loop candidates, times of vertices | lines of text |
//! | calibration | KITTI `calib.txt`, `calib_velo_to_cam.txt` |
//! | cloud | LAS, LAZ, PLY, PCD |
//! | mesh | PLY, OBJ |
//!
//! Nothing a file says is believed: sizes are compared with the file's length before anything is
//! allocated, checksums are compared before anything is used, and no bytes make a reader panic. A log that
//! is damaged in part is read in the other parts, and each loss is named as a [`Damage`]. Whatever else is
//! wrong is a [`LogError`]: one line with file, place and value.
//!
//! Memory is one chunk or one scan per reader, and a few chunks a thread where a file is opened on several, whatever the size
//! of the log.
//!
//! ```
//! use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, open_log};
//! use dmp_sensor::Scan;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("town.mcap");
//! let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default())?;
//! let points_in_sensor_m = vec![[4.0, 3.0, 0.5], [8.0, -2.0, 1.5]];
//! writer.write_scan(&Scan { stamp_ns: Some(1_000_000_000), points_in_sensor_m, time_offsets_ns: vec![] })?;
//! writer.finish()?;
//!
//! let log = open_log(&path, &LogOptions::default())?;
//! let mut reader = log.reader()?;
//! let mut scan = Scan::default();
//! for frame in 0..log.frames().len() {
//!     reader.read(frame, &mut scan)?;
//!     assert_eq!(scan.points_in_sensor_m[1], [8.0, -2.0, 1.5]);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod file;
mod geometry;
mod logs;
mod messages;
mod points;
mod poses;
mod scans;
mod writers;

pub use error::{LogError, ParseError, PlaceInFile};
pub use file::{Damage, is_printable, printable, shown_path, write_times};
pub use geometry::{
    CloudFormat, CloudSummary, CloudWriter, CrsError, LAS_REACH_M, LengthUnit, MeshFormat, MeshSummary,
    MetricCrs, OrientedPoint, is_mesh, read_cloud, read_mesh,
};
pub use logs::{
    BinLayout, BinLayoutError, Companions, FileRanges, LogIndex, LogOutline, MadeWith, has_bag_name,
    is_of_log, open_log, outline_log, survey_log,
};
pub use messages::{McapCompression, StaticFrames};
pub use points::{PointTime, StampAt, TimeUnit};
pub use poses::{
    Calib, Candidate, CandidateFault, GraphVertices, KeyframeTimes, KeyframeTimesFault, LoopCandidates,
    LoopLabels, PoseGraphFile, PoseTopic, RawTrajectory, SkippedCandidate, TopicTrajectory, TrajectoryFile,
    TrajectoryFormat, TrajectoryParseError, find_calib, is_bag, parse_calib, parse_euroc, parse_g2o,
    parse_keyframe_times, parse_keyframe_times_in, parse_kitti, parse_loop_candidates, parse_loop_labels,
    parse_npy, parse_pose_graph, parse_raw, parse_redwood_log, parse_tum, poses_at_most, read_calib,
    read_keyframe_times, read_keyframe_times_in, read_loop_candidates, read_loop_labels, read_pose_graph,
    read_raw_trajectory, read_raw_trajectory_as, read_topic_trajectory, read_trajectory, read_trajectory_as,
    write_euroc, write_keyframe_times, write_kitti, write_pose_edges, write_pose_graph, write_redwood_log,
    write_tum, write_tum_poses,
};
pub use scans::{
    FieldInfo, FieldMeaning, FrameInfo, LogFormat, LogOptions, LogSetting, LogSummary, LogSurvey, MemoryLog,
    MemoryLogFault, NO_CHECKSUMS, OutlinedScan, ScanLog, ScanReader, ScanStream, StampJump, TopicInfo,
    stamp_jumps,
};
pub use writers::{
    DepthFolderWriter, FolderFormat, FolderScanWriter, KeptPart, KeptReader, KeptWriter, McapScanWriter,
    McapWriterOptions, RETURN_BYTES, ResidualFormat, ResidualHead, ResidualWriter, SceneCloud, SceneHead,
    ScenePlace, ScenePoint, SceneRun, SceneWriter, ScoredPoint, ScoredScan, encode_depth_png, is_kept,
};
