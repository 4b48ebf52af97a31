use std::path::PathBuf;
use std::time::Duration;

use dmp_log::{LengthUnit, LogSummary};
use dmp_reduce::{Confidence, Margin, MissPrice, Promise, Scales};
use dmp_sensor::{DepthNoise, Isometry3, Trajectory};

use crate::error::EvaluateError;
use crate::own_frame::Frame;
use crate::report::SegmentReport;
use crate::sample::{Decide, Sample};

/// One estimate to be scored: a trajectory and the map that belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// How the run is called in the report.
    pub name: String,
    /// Where the body was: `world_from_body`.
    pub trajectory: Trajectory,
    /// Its map.
    pub map: MapSource,
    /// Where the sensor sits on the body that this trajectory moves; `None`: [`Config::body_from_sensor`].
    pub body_from_sensor: Option<Isometry3<f64>>,
    /// Where all this comes from, for the report.
    pub source: RunSource,
}

/// Where a run comes from, in words. No number depends on it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
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
            source: RunSource::default(),
        }
    }

    /// Where the sensor sits on the body of this run.
    pub(crate) fn body_from_sensor(&self, config: &Config) -> Isometry3<f64> {
        self.body_from_sensor.unwrap_or(config.body_from_sensor)
    }
}

/// Where a run's map comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MapSource {
    /// Fused from the scans with the run's trajectory.
    Fused,
    /// A file the user gives, in the trajectory's world frame: LAS, LAZ, PLY, PCD, a mesh in PLY or OBJ, or a
    /// store of our own.
    Given(PathBuf),
}

/// What is known of the vehicle that carries the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ego {
    /// Looked for in a sample of scans.
    Auto,
    /// There is none in view.
    None,
    /// A box in the sensor frame, smallest and largest corner in millimetres.
    BoxMm([i64; 3], [i64; 3]),
}

/// How long a segment of the drive is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SegmentLength {
    /// By the way of the sensor, metres.
    Metres(f64),
    /// By the stamps of the scans, seconds.
    Seconds(f64),
    /// By the number of scans in use.
    Scans(u64),
}

/// In which order the log is read. It changes no number; it is here so that this can be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameOrder {
    /// As the log has them.
    Log,
    /// Shuffled by a seed.
    Shuffled(u64),
}

/// Everything that can be set. The default is what `dmp score` does without options.
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
    /// Added to every stamp of the log before it is looked up in a trajectory, nanoseconds.
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
    /// told apart is what this leaves, over all pairs, scales and looks.
    pub confidence: Confidence,
    /// How far apart two runs may be and still count as the same.
    pub same_within: Margin,
    /// The sensor's noise, metres: scales the raw log-likelihood, nothing else. `None`: 0.02 m, and that of a depth
    /// camera grows with depth as [`DepthNoise::KINECT`].
    pub sigma_m: Option<f64>,
    /// Memory to aim for, bytes. Each run takes a part that does not shrink: the tiles in hand and its buffers.
    pub memory_bytes: usize,
    /// Threads that read, fuse and cast.
    pub threads: usize,
    /// Where scratch files and the maps of the runs go while they are needed.
    pub work_folder: PathBuf,
    /// Where to keep the fused maps, as `NAME.dmpmap`; `None` removes them at the end.
    pub save_maps: Option<PathBuf>,
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
            sigma_m: None,
            memory_bytes: 2 << 30,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            work_folder: work_folder(),
            save_maps: None,
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

impl Config {
    /// These settings for a log: its sensor says which lengths they go with, where they do not say it themselves.
    #[must_use]
    pub fn settled(&self, log: &LogSummary) -> Self {
        let scales = self.scales.unwrap_or_else(|| Scales::of_sensor(log.camera.is_some()));
        Self { scales: Some(scales), ..self.clone() }
    }

    /// The lengths by which returns are judged.
    pub fn scales(&self) -> Scales {
        self.scales.unwrap_or_default()
    }

    /// Smallest range used, metres.
    pub fn min_range_m(&self) -> f64 {
        self.min_range_m.unwrap_or(self.scales().lengths().min_range_m)
    }

    /// Largest range used, metres.
    pub fn max_range_m(&self) -> f64 {
        self.max_range_m.unwrap_or(self.scales().lengths().max_range_m)
    }

    /// The range noise of a LiDAR, metres.
    pub fn sigma_m(&self) -> f64 {
        self.sigma_m.unwrap_or(0.02)
    }

    /// The noise of a depth camera.
    pub fn depth_noise(&self) -> DepthNoise {
        self.sigma_m.map_or(DepthNoise::KINECT, DepthNoise::constant)
    }

    /// What the verdicts promise where nothing is looked at twice.
    pub(crate) fn promise(&self) -> Promise {
        Promise { confidence: self.confidence, margin: self.same_within }
    }

    /// How long what is a metre on a drive is here, metres.
    pub(crate) fn metre_m(&self) -> f64 {
        self.scales().lengths().metre_m
    }

    /// Checks every setting by itself, before anything is opened.
    ///
    /// # Errors
    /// The first setting that makes no sense, with its value and what it must be.
    pub fn check(&self) -> Result<(), EvaluateError> {
        let bad = |setting, value: String, why| Err(EvaluateError::Setting { setting, value, why });
        // What one end is where only the other was given, a log may have to say.
        let is_known = self.scales.is_some() || self.min_range_m.is_some() == self.max_range_m.is_some();
        let (min_range_m, max_range_m) = if is_known {
            (self.min_range_m(), self.max_range_m())
        } else {
            (self.min_range_m.unwrap_or(0.0), self.max_range_m.unwrap_or(1000.0))
        };
        let ranges_fit = min_range_m >= 0.0 && min_range_m < max_range_m;
        if !ranges_fit || max_range_m > 1000.0 {
            let value = format!("{min_range_m} to {max_range_m} m");
            return bad("ranges", value, "they must rise from 0 or more to at most 1000 m");
        }
        if let Some(segment) = self.segment {
            let (length, unit) = match segment {
                SegmentLength::Metres(m) => (m, "m"),
                SegmentLength::Seconds(s) => (s, "s"),
                SegmentLength::Scans(scans) => (scans as f64, "scans"),
            };
            if !(length > 0.0 && length.is_finite()) {
                return bad("segment", format!("{length} {unit}"), "it must be positive");
            }
        }
        match self.voxel_m {
            Some(m) if !(0.01..=2.0).contains(&m) => {
                return bad("voxel", format!("{m} m"), "it must lie between 0.01 and 2 m");
            }
            _ => {}
        }
        if let Some(sigma_m) = self.sigma_m.filter(|&m| !(m > 0.0 && m.is_finite())) {
            return bad("sigma", format!("{sigma_m} m"), "it must be positive");
        }
        let (Margin::Share(margin) | Margin::Metres(margin)) = self.same_within;
        if !(margin >= 0.0 && margin.is_finite()) {
            return bad("same-within", margin.to_string(), "it must be 0 or more");
        }
        if self.every == 0 {
            return bad("every", "0".into(), "it must be 1 or more");
        }
        self.sample.check()?;
        if self.threads == 0 || self.threads > 1024 {
            return bad("threads", self.threads.to_string(), "it must lie between 1 and 1024");
        }
        if self.memory_bytes < 32 << 20 {
            return bad("memory", format!("{} bytes", self.memory_bytes), "it must be 32 MiB or more");
        }
        Ok(())
    }
}
