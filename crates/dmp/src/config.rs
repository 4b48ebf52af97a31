//! What is asked of an evaluation: the runs, and everything that can be set.

use std::path::PathBuf;
use std::time::Duration;

use dmp_log::LengthUnit;
use dmp_reduce::{Confidence, Margin, MissPrice, Scales};
use dmp_sensor::{Isometry3, Trajectory};

use crate::drift::{DriftPairs, DriftReach};
use crate::ego::Ego;
use crate::pose_at::PoseAt;
use crate::report::SegmentReport;
use crate::sample::{Decide, Sample};
use crate::segment_length::SegmentLength;
use crate::seven::transform_of;

/// One estimate to be scored: a trajectory and the map that belongs to it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Run {
    /// How the run is called in the report.
    pub name: String,
    /// Where the body was: `world_from_body`.
    pub trajectory: Trajectory,
    /// Its map.
    pub map: MapSource,
    /// Where the sensor sits on the body that this trajectory moves; `None`: [`Config::body_from_sensor`].
    pub body_from_sensor: Option<Isometry3<f64>>,
    /// At which instant of its scan a pose holds whose stamp is the scan's; so it is with poses that have no stamps.
    pub pose_at: PoseAt,
    /// Added to every stamp of the log before it is looked up in this trajectory, nanoseconds; `None`:
    /// [`Config::time_offset_ns`].
    pub time_offset_ns: Option<i64>,
    /// Whether an odometry lies between its own poses ([`Trajectory::carried_by`]): then how these are meant cannot be put
    /// right afterwards.
    pub is_carried: bool,
    /// Where all this comes from, for the report.
    pub source: RunSource,
}

/// Where a run comes from, in words. No number depends on it.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RunSource {
    /// The file or topic of the trajectory.
    pub file: Option<String>,
    /// Its format.
    pub format: Option<String>,
    /// Why `body_from_sensor` is what it is.
    pub body_from_sensor: Option<String>,
    /// What was guessed.
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
            pose_at: PoseAt::Stamp,
            time_offset_ns: None,
            is_carried: false,
            source: RunSource::default(),
        }
    }
}

/// Where a run's map comes from.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum MapSource {
    /// Fused from the scans with the run's trajectory.
    Fused,
    /// A file the user gives, in the trajectory's world frame: LAS, LAZ, PLY, PCD, a mesh in PLY or OBJ, or a
    /// store of our own.
    Given(PathBuf),
}

/// In which order the log is read. It changes no number; it can be set so that this can be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameOrder {
    /// As the log has them.
    Log,
    /// Shuffled by a seed.
    Shuffled(u64),
}

/// In which frame a run is fused and scored. Results are reported in the run's own, whichever it is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Frame {
    /// The one that follows from the way of the sensor, so that it makes no difference where a run's own lies.
    OfTheWay,
    /// That one, moved: to see what the place of the voxels is worth.
    Moved(Isometry3<f64>),
    /// `world_from_own`, whatever the way: for poses of one graph that are to share their voxels.
    Fixed(Isometry3<f64>),
}

impl Frame {
    /// Fixed to a frame that a report names ([`RunInputReport::world_from_own`](crate::RunInputReport)): x, y, z in
    /// metres, qx, qy, qz, qw.
    pub fn of_report(seven: [f64; 7]) -> Self {
        Self::Fixed(transform_of(&seven))
    }
}

/// Everything that can be set. The default is what `dmp score` does without options. An evaluation works with what it
/// [comes to](crate::Settings) on a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The lengths by which returns are judged, and which the other defaults go with; `None`: those of a room for
    /// the log of a depth camera, those of a drive else.
    pub scales: Option<Scales>,
    /// Edge of a voxel, metres; `None` chooses 0.2, 0.3 or 0.5 m by the scans' density, in a room 0.02, 0.03 or 0.05 m.
    pub voxel_m: Option<f64>,
    /// Length of a segment of the drive; `None`: 12 m, or a sixteenth of a shorter drive; in a room a sixteenth of the
    /// scans.
    pub segment: Option<SegmentLength>,
    /// The segments as the report of another evaluation has them, of the same scans; `None` cuts the way of the runs.
    pub segments: Option<SegmentReport>,
    /// The unit of given clouds and meshes; `None`: what the file says, else the metre.
    pub map_unit: Option<LengthUnit>,
    /// Smallest range used, metres; `None`: 1.5 m, in a room 0.3 m.
    pub min_range_m: Option<f64>,
    /// Largest range used, metres; `None`: 100 m, in a room 10 m. Predictions are looked for up to twice as far.
    pub max_range_m: Option<f64>,
    /// The vehicle itself.
    pub ego: Ego,
    /// Only every n-th scan of the log is used, for the map and for the score.
    pub every: usize,
    /// How many of the scans in use are scored; the maps are made of all of them.
    pub sample: Sample,
    /// What the sample is drawn by: the same number draws the same scans.
    pub seed: u64,
    /// Whether growing samples are scored, from [`Self::sample`] on, or from 28 scans, until it is decided which run is
    /// better.
    pub decide: Option<Decide>,
    /// Where the sensor sits on the body that the trajectories move, for runs that do not say it themselves.
    pub body_from_sensor: Isometry3<f64>,
    /// Added to every stamp of the log before it is looked up in a trajectory, nanoseconds, for runs that do not say it
    /// themselves.
    pub time_offset_ns: i64,
    /// Poses further apart than this are not interpolated between, nanoseconds; `None`: 1 s, or three
    /// times a trajectory's median interval where that is longer.
    pub max_time_gap_ns: Option<i64>,
    /// Whether returns on the trails of moving objects are kept out of the maps: two more passes over the log.
    /// The maps must be fused from the scans.
    pub free_space: bool,
    /// What a return that no independent surfel predicts costs in `R_cv` at its largest truncation.
    pub miss_price: MissPrice,
    /// How sure the verdicts are to be, all of them together: where runs are equal, the chance that any two of them are
    /// ranked apart is what this leaves, over all pairs, scales and looks.
    pub confidence: Confidence,
    /// How far apart two runs may be and still count as the same.
    pub same_within: Margin,
    /// On how many pairs of visits drift is measured in metres beside the scores.
    pub drift: DriftPairs,
    /// How far runs may be off for that.
    pub drift_reach: DriftReach,
    /// The sensor's noise, metres: scales the raw log-likelihood, nothing else. `None`: 0.02 m, and that of a depth
    /// camera grows with depth as [`DepthNoise::KINECT`](dmp_sensor::DepthNoise::KINECT).
    pub sigma_m: Option<f64>,
    /// Memory to aim for, bytes. Each run takes a part that does not shrink: the tiles in hand and its buffers.
    pub memory_bytes: usize,
    /// Threads that read, fuse and cast.
    pub threads: usize,
    /// Where scratch files and the maps of the runs go while they are needed.
    pub work_folder: PathBuf,
    /// Where to keep the fused maps, as `NAME.dmpmap`; `None` removes them at the end.
    pub save_maps: Option<PathBuf>,
    /// Whether [`Report::tiles`](crate::Report::tiles) holds the sums of every run in every tile.
    pub per_tile: bool,
    /// After how much time what was done is kept in the work folder, so that another process can go on from there;
    /// `None` keeps nothing.
    pub checkpoint_every: Option<Duration>,
    /// Whether to go on from what an evaluation of the same left in the work folder, where there is anything.
    pub resume: bool,
    /// In which order the log is read.
    pub order: FrameOrder,
    /// In which frame each run is scored.
    pub frame: Frame,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            scales: None,
            voxel_m: None,
            segment: None,
            segments: None,
            map_unit: None,
            min_range_m: None,
            max_range_m: None,
            ego: Ego::Auto,
            every: 1,
            sample: Sample::All,
            seed: 0,
            decide: None,
            body_from_sensor: Isometry3::identity(),
            time_offset_ns: 0,
            max_time_gap_ns: None,
            free_space: false,
            miss_price: MissPrice::default(),
            confidence: Confidence::P99,
            same_within: Margin::default(),
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
