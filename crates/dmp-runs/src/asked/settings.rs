//! The resolved settings of an evaluation, and its resources.

use std::path::PathBuf;
use std::time::Duration;

use dmp_log::{LengthUnit, LogSummary};
use dmp_reduce::{Confidence, MissPrice, Scales};
use dmp_report::{Ego, SegmentLength};
use dmp_sensor::{DepthNoise, Isometry3};
use serde::{Deserialize, Serialize};

use crate::asked::check::check_ranges;
use crate::asked::config::{Config, Frame, FrameOrder, Run};
use crate::asked::drift::{DriftPairs, DriftReach};
use crate::asked::error::EvaluateError;
use crate::asked::returns::CastReturns;

/// Every setting that changes numbers, resolved for a log: what [`Config`] leaves open is decided here. A
/// remaining `None` is decided by the scans.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Settings {
    /// The truncation lengths of the scores.
    pub scales: Scales,
    /// Edge of a voxel, metres; `None`: by the density of the scans.
    pub voxel_m: Option<f64>,
    /// Length of a segment of the drive; `None`: by the length of the drive.
    pub segment: Option<SegmentLength>,
    /// The unit of given clouds and meshes; `None`: that of their files.
    pub map_unit: Option<LengthUnit>,
    /// Smallest range used, metres.
    pub min_range_m: f64,
    /// Largest range used, metres.
    pub max_range_m: f64,
    /// Which returns lie on the vehicle itself.
    pub ego: Ego,
    /// Every n-th scan of the log is used.
    pub every: usize,
    /// How many of the returns of a scored scan are cast.
    pub returns: CastReturns,
    /// Seed of the draws.
    pub seed: u64,
    /// The extrinsic of the sensor on the body, for runs without their own.
    pub body_from_sensor: Isometry3<f64>,
    /// Added to every stamp of the log, nanoseconds.
    pub time_offset_ns: i64,
    /// Longest gap between poses that is interpolated, nanoseconds; `None`: by each trajectory's own
    /// intervals.
    pub max_time_gap_ns: Option<i64>,
    /// The cost of a miss.
    pub miss_price: MissPrice,
    /// Confidence of all verdicts by scores together, and of all by drift.
    pub confidence: Confidence,
    /// Runs are the same that are nowhere further apart within a visit, and twice as far between visits, metres.
    pub same_within_m: f64,
    /// The number of pairs of visits on which drift is measured.
    pub drift: DriftPairs,
    /// The largest drift that this measurement can find.
    pub drift_reach: DriftReach,
    /// The given noise, metres; `None`: 0.02 m, or that of the depth camera.
    pub asked_sigma_m: Option<f64>,
    /// The frame in which each run is scored.
    pub frame: Frame,
}

/// The resources of an evaluation. They change no number.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Means {
    /// Memory to aim for, bytes.
    pub memory_bytes: usize,
    /// Threads that read, fuse and cast.
    pub threads: usize,
    /// Folder in which work folders are made.
    pub work_folder: PathBuf,
    /// Folder for the fused maps; `None`: they are not kept.
    pub save_maps: Option<PathBuf>,
    /// Whether the report has sums by tile.
    pub per_tile: bool,
    /// Time between checkpoints; `None`: there are none.
    pub checkpoint_every: Option<Duration>,
    /// Whether to resume from a checkpoint.
    pub resume: bool,
    /// The reading order of the log.
    pub order: FrameOrder,
}

impl Config {
    /// Resolves the settings for a log: its sensor selects the lengths, unless they are set.
    ///
    /// # Errors
    /// The first invalid setting, with its value and what it must be.
    pub fn on(&self, log: &LogSummary) -> Result<(Settings, Means), EvaluateError> {
        self.on_scales(self.scales_on(log))
    }

    /// The truncation lengths for a log.
    pub fn scales_on(&self, log: &LogSummary) -> Scales {
        self.scales.unwrap_or_else(|| Scales::of_sensor(log.camera.is_some()))
    }

    /// Resolves the settings without a log: `usual` are the lengths, unless they are set.
    ///
    /// # Errors
    /// As [`Self::on`].
    pub fn on_scales(&self, usual: Scales) -> Result<(Settings, Means), EvaluateError> {
        let scales = self.scales.unwrap_or(usual);
        let (min_range_m, max_range_m) = self.ranges_m(scales);
        self.check()?;
        check_ranges(min_range_m, max_range_m)?;
        let settings = Settings {
            scales,
            voxel_m: self.voxel_m,
            segment: self.segment,
            map_unit: self.map_unit,
            min_range_m,
            max_range_m,
            ego: self.ego,
            every: self.every,
            returns: self.returns,
            seed: self.seed,
            body_from_sensor: self.body_from_sensor,
            time_offset_ns: self.time_offset_ns,
            max_time_gap_ns: self.max_time_gap_ns,
            miss_price: self.miss_price,
            confidence: self.confidence,
            same_within_m: self.same_within_m.unwrap_or(scales.lengths().same_within_m),
            drift: self.drift,
            drift_reach: self.drift_reach,
            asked_sigma_m: self.sigma_m,
            frame: self.frame,
        };
        Ok((settings, self.means()))
    }

    /// The resources.
    pub fn means(&self) -> Means {
        Means {
            memory_bytes: self.memory_bytes,
            threads: self.threads,
            work_folder: self.work_folder.clone(),
            save_maps: self.save_maps.clone(),
            per_tile: self.per_tile,
            checkpoint_every: self.checkpoint_every,
            resume: self.resume,
            order: self.order,
        }
    }

    pub(crate) fn ranges_m(&self, scales: Scales) -> (f64, f64) {
        let lengths = scales.lengths();
        let min_range_m = self.min_range_m.unwrap_or(lengths.min_range_m);
        (min_range_m, self.max_range_m.unwrap_or(lengths.max_range_m))
    }
}

/// The one map made of a cloud, of all memory.
const CLOUD_MAP_SHARE: f64 = 0.5;
/// The tiles of a map assembled from patches, of all memory, on all threads.
const PATCHED_TILES_SHARE: usize = 3;

impl Means {
    /// For the one map made of a cloud, bytes.
    pub fn cloud_map_bytes(&self) -> usize {
        (CLOUD_MAP_SHARE * self.memory_bytes as f64) as usize
    }

    /// For the tiles of a map assembled from patches, on each thread, bytes.
    pub fn patched_tiles_bytes(&self) -> usize {
        self.memory_bytes / PATCHED_TILES_SHARE / self.threads
    }
}

impl Settings {
    /// The length that corresponds to one metre of a drive, metres.
    pub fn metre_m(&self) -> f64 {
        self.scales.lengths().metre_m
    }

    /// Visits at most so far apart see one place, metres.
    pub fn drift_near_m(&self) -> f64 {
        self.drift_reach.near_m() * self.metre_m()
    }

    /// The range noise of a LiDAR, metres.
    pub fn sigma_m(&self) -> f64 {
        self.asked_sigma_m.unwrap_or(0.02)
    }

    /// The noise of a depth camera.
    pub fn depth_noise(&self) -> DepthNoise {
        self.asked_sigma_m.map_or(DepthNoise::KINECT, DepthNoise::constant)
    }

    /// The offset of the log's stamps for a run, nanoseconds.
    pub fn time_offset_ns(&self, run: &Run) -> i64 {
        run.time_offset_ns.unwrap_or(self.time_offset_ns)
    }

    /// The extrinsic of the sensor for a run.
    pub fn body_from_sensor(&self, run: &Run) -> Isometry3<f64> {
        run.body_from_sensor.unwrap_or(self.body_from_sensor)
    }
}

/// Checks the runs' names.
///
/// # Errors
/// When there is no run, or two runs share a name.
pub fn check_runs(runs: &[Run]) -> Result<(), EvaluateError> {
    if runs.is_empty() {
        return Err(EvaluateError::NoRuns);
    }
    for (k, run) in runs.iter().enumerate() {
        if runs[..k].iter().any(|other| other.name == run.name) {
            return Err(EvaluateError::SameName { name: run.name.clone() });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `--resume` finds a checkpoint by these bytes: every setting must be in them.
    #[test]
    fn what_changes_a_number_changes_the_bytes_and_nothing_else_does() {
        let bytes =
            |config: &Config| postcard::to_allocvec(&config.on_scales(Scales::Drive).unwrap().0).unwrap();
        let config = Config::default();
        let elsewhere = Config { threads: 7, memory_bytes: 1 << 30, resume: true, ..config.clone() };
        assert_eq!(bytes(&elsewhere), bytes(&config));
        assert_eq!(bytes(&Config { scales: Some(Scales::Drive), ..config.clone() }), bytes(&config));
        let one = Isometry3::translation(1.0, 0.0, 0.0);
        let others = [
            Config { scales: Some(Scales::Room), ..config.clone() },
            Config { voxel_m: Some(0.3), ..config.clone() },
            Config { segment: Some(SegmentLength::Metres(5.0)), ..config.clone() },
            Config { segment: Some(SegmentLength::Seconds(5.0)), ..config.clone() },
            Config { map_unit: Some(LengthUnit::Metre), ..config.clone() },
            Config { same_within_m: Some(0.02), ..config.clone() },
            Config { ego: Ego::None, ..config.clone() },
            Config { returns: CastReturns::OneIn(1), ..config.clone() },
            Config { returns: CastReturns::OneIn(8), ..config.clone() },
            Config { drift: DriftPairs::All, ..config.clone() },
            Config { drift: DriftPairs::AtMost(7), ..config.clone() },
            Config { drift_reach: DriftReach::Far, ..config.clone() },
            Config { frame: Frame::Moved(one), ..config.clone() },
            Config { frame: Frame::Fixed(one), ..config.clone() },
            Config { confidence: Confidence::new(0.95).unwrap(), ..config.clone() },
            Config { body_from_sensor: one, ..config.clone() },
            config,
        ];
        for (k, one) in others.iter().enumerate() {
            for other in &others[..k] {
                assert_ne!(bytes(one), bytes(other), "{one:?} {other:?}");
            }
        }
    }

    #[test]
    fn a_range_that_is_left_open_is_the_sensors() {
        let config = Config { min_range_m: Some(20.0), ..Config::default() };
        config.check().unwrap();
        assert_eq!(config.on_scales(Scales::Drive).unwrap().0.max_range_m, 100.0);
        let error = config.on_scales(Scales::Room).unwrap_err();
        assert_eq!(error.to_string(), "ranges 20 to 10 m: they must rise from 0 or more to at most 1000 m");
        assert!(Config { max_range_m: Some(-1.0), ..Config::default() }.check().is_err());
    }
}
