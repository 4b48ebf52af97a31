//! The input of an evaluation: the runs and every setting.

use std::path::PathBuf;
use std::time::Duration;

use dmp_log::LengthUnit;
use dmp_reduce::{Confidence, MissPrice, Scales};
use dmp_report::{Ego, PoseAt, SegmentLength};
use dmp_sensor::transform_of;
use dmp_sensor::{Isometry3, Trajectory};

use crate::asked::drift::{DriftPairs, DriftReach};
use crate::asked::returns::CastReturns;

/// One estimate to be scored: a trajectory and the map that belongs to it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Run {
    /// The run's name in the report.
    pub name: String,
    /// The poses of the body: `world_from_body`.
    pub trajectory: Trajectory,
    /// Its map.
    pub map: MapSource,
    /// The extrinsic of the sensor on the body of this trajectory; `None`: [`Config::body_from_sensor`].
    pub body_from_sensor: Option<Isometry3<f64>>,
    /// The instant of a scan for which a pose with the scan's stamp, or without a stamp, holds. `None`: nothing was chosen;
    /// that is the stamp, unless [`vet`](crate::vet) finds another for poses without stamps.
    pub pose_at: Option<PoseAt>,
    /// Added to every stamp of the log before it is looked up in this trajectory, nanoseconds; `None`:
    /// [`Config::time_offset_ns`].
    pub time_offset_ns: Option<i64>,
    /// Whether an odometry interpolates between the run's poses ([`Trajectory::carried_by`]). Then the pose
    /// format can no longer be corrected.
    pub is_carried: bool,
    /// The origin of the run, for the report.
    pub source: RunSource,
}

/// The origin of a run, in words. No number depends on it.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RunSource {
    /// The file or topic of the trajectory.
    pub file: Option<String>,
    /// Its format.
    pub format: Option<String>,
    /// Why `body_from_sensor` has its value.
    pub body_from_sensor: Option<String>,
    /// Assumptions made.
    pub notes: Vec<String>,
}

impl Run {
    /// A run whose map is fused from the scans, with the extrinsic of the settings.
    pub fn new(name: impl Into<String>, trajectory: Trajectory) -> Self {
        Self {
            name: name.into(),
            trajectory,
            map: MapSource::Fused,
            body_from_sensor: None,
            pose_at: None,
            time_offset_ns: None,
            is_carried: false,
            source: RunSource::default(),
        }
    }

    /// The instant of a scan for which its poses hold.
    pub fn instant(&self) -> PoseAt {
        self.pose_at.unwrap_or_default()
    }
}

/// Where a run's map comes from.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum MapSource {
    /// Fused from the scans with the run's trajectory.
    Fused,
    /// A given file, in the trajectory's world frame: LAS, LAZ, PLY, PCD, a mesh in PLY or OBJ, or a
    /// `.dmpmap` store.
    Given(PathBuf),
}

/// The reading order of the log. It changes no number; tests set it to prove that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameOrder {
    /// In the order of the log.
    Log,
    /// Shuffled by a seed.
    Shuffled(u64),
}

/// The frame in which a run is fused and scored. Results are reported in the run's own frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Frame {
    /// The canonical frame that follows from the path of the sensor, so that a run's own frame has no
    /// influence.
    OfTheWay,
    /// The canonical frame, moved: measures the influence of the voxel grid's position.
    Moved(Isometry3<f64>),
    /// A fixed `world_from_own`, whatever the path: for poses of one graph that share their voxels.
    Fixed(Isometry3<f64>),
}

impl Frame {
    /// The frame that a report names ([`RunInputReport::world_from_own`](dmp_report::RunInputReport)): x, y, z in
    /// metres, qx, qy, qz, qw.
    pub fn of_report(seven: [f64; 7]) -> Self {
        Self::Fixed(transform_of(&seven))
    }
}

/// Every setting. The default is `dmp score` without options. [`Settings`](crate::Settings) are its values
/// for a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The truncation lengths of the scores, on which the other defaults depend; `None`: those of a room for
    /// a depth camera, else those of a drive.
    pub scales: Option<Scales>,
    /// Edge of a voxel, metres; `None`: 0.2, 0.3 or 0.5 m by the scans' density, in a room 0.02, 0.03 or 0.05
    /// m.
    pub voxel_m: Option<f64>,
    /// Length of a segment of the drive; `None`: 12 m, or a sixteenth of a shorter drive; in a room a sixteenth of the
    /// scans.
    pub segment: Option<SegmentLength>,
    /// The unit of given clouds and meshes; `None`: the file's own, else the metre.
    pub map_unit: Option<LengthUnit>,
    /// Smallest range used, metres; `None`: 1.5 m, in a room 0.3 m.
    pub min_range_m: Option<f64>,
    /// Largest range used, metres; `None`: 100 m, in a room 10 m. Predictions are searched up to twice as
    /// far.
    pub max_range_m: Option<f64>,
    /// Which returns lie on the vehicle itself.
    pub ego: Ego,
    /// Only every n-th scan of the log is used, for the map and for the score.
    pub every: usize,
    /// How many of the returns of a scored scan are cast; the maps use all of them.
    pub returns: CastReturns,
    /// Seed of the draws: the same number draws the same returns.
    pub seed: u64,
    /// The extrinsic of the sensor on the body of the trajectories, for runs without their own.
    pub body_from_sensor: Isometry3<f64>,
    /// Added to every stamp of the log before it is looked up in a trajectory, nanoseconds, for runs without
    /// their own.
    pub time_offset_ns: i64,
    /// Longest gap between poses that is interpolated, nanoseconds; `None`: 1 s, or three times the
    /// trajectory's median interval if longer.
    pub max_time_gap_ns: Option<i64>,
    /// The cost in `R_cv` of a return that no independent surfel predicts, at its largest truncation.
    pub miss_price: MissPrice,
    /// Confidence of all verdicts by scores together, and of all by drift. Among equal runs, either ranks any two apart with at
    /// most the remaining probability, over all pairs, scales and looks.
    pub confidence: Confidence,
    /// Runs are the same that are nowhere further apart within a visit, and twice as far between visits, metres. `None`: 4 cm,
    /// in a room 4 mm.
    pub same_within_m: Option<f64>,
    /// The number of pairs of visits on which drift is measured in metres, beside the scores.
    pub drift: DriftPairs,
    /// The largest drift that this measurement can find.
    pub drift_reach: DriftReach,
    /// The sensor's noise, metres: scales only the raw log-likelihood. `None`: 0.02 m; for a depth camera it
    /// grows with depth as [`DepthNoise::KINECT`](dmp_sensor::DepthNoise::KINECT).
    pub sigma_m: Option<f64>,
    /// Memory to aim for, bytes. Each run needs a fixed part: the tiles in use and its buffers.
    pub memory_bytes: usize,
    /// Threads that read, fuse and cast.
    pub threads: usize,
    /// Folder of scratch files and of the runs' maps while they are needed.
    pub work_folder: PathBuf,
    /// Folder for the fused maps, as `NAME.dmpmap`; `None` removes them at the end.
    pub save_maps: Option<PathBuf>,
    /// Whether [`Report::tiles`](dmp_report::Report::tiles) has the sums of every run in every tile.
    pub per_tile: bool,
    /// Time between checkpoints in the work folder, from which another process can resume; `None` writes
    /// none.
    pub checkpoint_every: Option<Duration>,
    /// Whether to resume from the checkpoint of the same evaluation in the work folder, if there is one.
    pub resume: bool,
    /// The reading order of the log.
    pub order: FrameOrder,
    /// The frame in which each run is scored.
    pub frame: Frame,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            scales: None,
            voxel_m: None,
            segment: None,
            map_unit: None,
            min_range_m: None,
            max_range_m: None,
            ego: Ego::Auto,
            every: 1,
            returns: CastReturns::ByNumber,
            seed: 0,
            body_from_sensor: Isometry3::identity(),
            time_offset_ns: 0,
            max_time_gap_ns: None,
            miss_price: MissPrice::default(),
            confidence: Confidence::P99,
            same_within_m: None,
            drift: DriftPairs::default(),
            drift_reach: DriftReach::default(),
            sigma_m: None,
            memory_bytes: 2 << 30,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            work_folder: work_folder(),
            save_maps: None,
            per_tile: false,
            checkpoint_every: None,
            resume: false,
            order: FrameOrder::Log,
            frame: Frame::OfTheWay,
        }
    }
}

/// The folder that `TMPDIR` names; else `/var/tmp`, which is a disk where `/tmp` is often memory; else
/// the system's.
fn work_folder() -> PathBuf {
    let disk = PathBuf::from("/var/tmp");
    if std::env::var_os("TMPDIR").is_none() && disk.is_dir() { disk } else { std::env::temp_dir() }
}
