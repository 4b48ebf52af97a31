//! The settings as they took effect, in a report.

use dmp_reduce::{Confidence, Scales};
use serde::{Deserialize, Serialize};

use super::ego::EgoReport;
use super::segment_length::SegmentLength;

/// The settings as they took effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfigReport {
    /// Voxel edge v, metres.
    pub voxel_m: f64,
    /// Share of returns in voxels with three or more, at that edge; null where the edge was given.
    pub voxel_filled_share: Option<f64>,
    /// Edge of the map's tiles, metres.
    pub tile_edge_m: f64,
    /// Radius of the surfels' discs, metres.
    pub disc_radius_m: f64,
    /// Smallest range used, metres.
    pub min_range_m: f64,
    /// Largest range used, metres.
    pub max_range_m: f64,
    /// How far predictions are looked for, metres.
    pub horizon_m: f64,
    /// What was left out as the vehicle: `ego`, `ego_cells` and `ego_box_m` in the JSON.
    #[serde(flatten)]
    pub ego: EgoReport,
    /// Every n-th scan was used.
    pub every: usize,
    /// body_from_sensor as x, y, z (metres), qx, qy, qz, qw; null where the runs have different ones.
    pub body_from_sensor: Option<[f64; 7]>,
    /// Added to the log's stamps, seconds.
    pub time_offset_s: f64,
    /// Noise behind the raw log-likelihood, metres; null where it grows with depth, `depth_noise`.
    pub sigma_m: Option<f64>,
    /// The noise of a depth camera: σ(z) = `least_m` + `growth_per_m` (z − `nearest_m`)²; null for other sensors, and where
    /// one number was given.
    pub depth_noise: Option<DepthNoiseReport>,
    /// The lengths by which returns are judged: `drive` or `room`.
    pub scales: Scales,
    /// Share of the full square, 100 m² on a drive, that a return without an independent crossing costs in `R_cv` at its largest truncation.
    pub miss_price: f64,
    /// The length of a segment that was given; null where each run's own path decides.
    pub segment: Option<SegmentLength>,
}

/// How the noise of a depth camera grows with depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthNoiseReport {
    /// At `nearest_m`, metres.
    pub least_m: f64,
    /// Per square metre of depth beyond it, 1 / metre.
    pub growth_per_m: f64,
    /// Depth at which the noise is least, metres.
    pub nearest_m: f64,
}

/// How the path of a run was cut into segments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentReport {
    /// Length of a segment, metres; null where they were not cut by the way.
    pub length_m: Option<f64>,
    /// The same in seconds, where they were cut by time.
    pub length_s: Option<f64>,
    /// The same in scans, where they were cut by these. All three are null where every scan is a segment of its own.
    pub length_scans: Option<u64>,
    /// How many.
    pub count: usize,
    /// Length of the path, metres.
    pub travel_m: f64,
    /// The stamps at which segments begin, nanoseconds; empty for a log without stamps.
    pub starts_ns: Vec<i64>,
    /// The scans (index in the log) with which segments begin.
    pub starts_scan: Vec<usize>,
}

impl SegmentReport {
    /// How long a segment is; `None` where every scan is one.
    pub fn length(&self) -> Option<SegmentLength> {
        let by_way = self.length_m.map(SegmentLength::Metres);
        let by_time = || self.length_s.map(SegmentLength::Seconds);
        by_way.or_else(by_time).or_else(|| self.length_scans.map(SegmentLength::Scans))
    }
}

/// What the verdicts on all pairs promise together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PromiseReport {
    /// One minus the family-wise error rate, over all pairs, scales and looks of a command.
    pub confidence: f64,
    /// How sure each interval of a difference is, so that all together keep that.
    pub interval_confidence: f64,
    /// How far apart two runs may be within a visit and still count as the same, metres; between visits twice as far.
    pub same_within_m: f64,
    /// Of results that stand beside each other: whether pairs are from several, each of which promises this by itself.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub of_each_result: bool,
}

impl PromiseReport {
    /// How sure all verdicts by scores together, and all by drift, were asked to be.
    ///
    /// # Errors
    /// When that is no share.
    pub fn asked(&self) -> Result<Confidence, String> {
        let wrong = || format!("promise.confidence is {}, no share from 0.5 to 1", self.confidence);
        Confidence::new(self.confidence).ok_or_else(wrong)
    }
}
