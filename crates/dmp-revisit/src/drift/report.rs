//! The report of the runs' drift.

use serde::{Deserialize, Serialize};

use super::displacement::Displacement;

/// The drift of runs at revisits, measured from their own scans. Serialised, it is the JSON of `dmp drift`:
/// schema `dmp-drift/2`, described in `docs/drift.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftReport {
    /// Always `dmp-drift/2`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// Edge of the voxels of a visit, metres.
    pub voxel_m: f64,
    /// Confidence of each interval.
    pub confidence: f64,
    /// The runs, in the order given. Each is measured by itself.
    pub runs: Vec<RunDrift>,
    /// Every pair of runs, compared on the pairs of visits that both have measured.
    pub comparisons: Vec<DriftComparison>,
}

impl DriftReport {
    /// The value of `schema`.
    pub const SCHEMA: &str = "dmp-drift/2";

    /// Whether any run was looked at where it comes back.
    pub fn is_measured(&self) -> bool {
        self.runs.iter().any(|run| run.pairs_measured > 0)
    }
}

/// The drift of a run at revisits; lengths in metres, null where unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunDrift {
    /// Name of the run.
    pub name: String,
    /// Its path length, metres.
    pub travel_m: f64,
    /// Number of segments of its path.
    pub segments: usize,
    /// Number of pairs of visits found, and number of them that were looked at.
    pub pairs_found: usize,
    /// See [`Self::pairs_found`].
    pub pairs_measured: usize,
    /// Pairs of visits measured in all three directions.
    pub pairs: usize,
    /// Pairs measured in some directions only.
    pub pairs_in_part: usize,
    /// Pairs that the run puts at one place, where their surfaces do not fit; they match better elsewhere, without fitting there.
    /// Each counts with [`VisitPairReport::at_least_m`]: then the three numbers below are at least so large.
    pub pairs_lost: usize,
    /// How far around its poses was searched, metres.
    pub searched_m: f64,
    /// Pairs without an answer: too few surfaces in common, or that hold them.
    pub pairs_refused: usize,
    /// Median distance between a visit in the run and by its surfaces.
    pub median_m: Measured,
    /// Root mean square of the distances, minus measurement noise.
    pub rms_m: Measured,
    /// 95 % quantile of the distances.
    pub p95_m: Measured,
    /// Root mean squares of the parts, minus noise: along the path, sideways, upwards.
    pub along_m: Option<f64>,
    /// See [`Self::along_m`].
    pub sideways_m: Option<f64>,
    /// See [`Self::along_m`].
    pub up_m: Option<f64>,
    /// Root mean squares of the rotations, degrees: about the path, the left axis, up, and in total.
    pub roll_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub pitch_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub yaw_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub angle_deg: Option<f64>,
    /// Median of the distances, in per cent of the distance travelled between the visits.
    pub of_the_way_percent: Option<f64>,
    /// Distances by distance travelled between the visits, metres: each bin is twice as long as the one
    /// before.
    pub over_way: Vec<DriftBin>,
    /// The same by the time between them, seconds.
    pub over_time: Vec<DriftBin>,
    /// The pairs of visits that were looked at, in the order of the drive.
    pub visits: Vec<VisitPairReport>,
}

/// A number with its interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The number.
    pub value: Option<f64>,
    /// Its interval over blocks of neighbouring pairs; null with too few blocks.
    pub interval: Option<[f64; 2]>,
}

/// The pairs of visits in an interval of distance travelled or time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftBin {
    /// Lower bound, inclusive.
    pub from: f64,
    /// Upper bound, exclusive.
    pub to: f64,
    /// Number of measured pairs.
    pub pairs: usize,
    /// Root mean square of the distances, minus noise, metres.
    pub rms_m: f64,
    /// Median, metres.
    pub median_m: f64,
}

/// Two runs compared at revisits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftComparison {
    /// The first run.
    pub a: String,
    /// The second run.
    pub b: String,
    /// Pairs of visits that both have, measured or lost.
    pub pairs: usize,
    /// Root mean squares over these, minus noise, metres.
    pub rms_a_m: Option<f64>,
    /// See [`Self::rms_a_m`].
    pub rms_b_m: Option<f64>,
    /// Mean square of a minus that of b, m²: negative if a is better.
    pub difference_m2: Measured,
    /// The better run, if an interval that holds for all comparisons together excludes 0; else null. A run that is lost at a visit, or has no answer at one where
    /// the other has, is never the better one.
    pub better: Option<String>,
}

/// Two visits of a run to a place, and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitPairReport {
    /// The earlier visit.
    pub first: VisitReport,
    /// The later one.
    pub second: VisitReport,
    /// Distance between them by the run's poses, metres.
    pub apart_m: f64,
    /// Distance travelled between them, metres.
    pub way_m: f64,
    /// Position of the first visit in the run's own world, metres.
    pub at_m: [f64; 3],
    /// The displacement; null where the surfaces do not determine it.
    pub off: Option<Displacement>,
    /// Where a pair is lost: the distance is at least this, metres.
    pub at_least_m: Option<f64>,
    /// Why there is no displacement.
    pub why_not: Option<String>,
    /// Pose of the second visit's sensor relative to the first's, by the surfaces: x, y, z (metres), qx, qy,
    /// qz, qw.
    pub first_from_second: Option<[f64; 7]>,
    /// Covariance of a rotation vector (radians) and a translation (metres) applied before that, in the frame
    /// of the first visit's sensor: the upper triangle, row by row.
    pub covariance: Option<[f64; 21]>,
}

/// A visit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitReport {
    /// The scan whose pose is that of the visit: its number in the log.
    pub scan: usize,
    /// Its stamp, nanoseconds; null where the log has none.
    pub stamp_ns: Option<i64>,
    /// The scans whose returns were used.
    pub scans: Vec<usize>,
}
