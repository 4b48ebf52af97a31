//! What the report has of the drift of runs.

use serde::{Deserialize, Serialize};

use super::displacement::Displacement;

/// How far runs are off where they come back, by what they saw themselves. Serialised, it is the JSON of `dmp drift`: schema
/// `dmp-drift/1`, described in `docs/drift.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftReport {
    /// Always `dmp-drift/1`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// Edge of the voxels of a visit, metres.
    pub voxel_m: f64,
    /// The way, metres: the median over the runs.
    pub travel_m: f64,
    /// Segments of the way.
    pub segments: usize,
    /// Pairs of visits that there are, and how many of them were looked at.
    pub pairs_found: usize,
    /// See [`Self::pairs_found`].
    pub pairs_measured: usize,
    /// How sure all intervals are, each by itself.
    pub confidence: f64,
    /// The runs, in the order given.
    pub runs: Vec<RunDrift>,
    /// Every pair of runs, compared on the pairs of visits that both have an answer for.
    pub comparisons: Vec<DriftComparison>,
    /// The pairs of visits that were looked at, in the order of the drive.
    pub visits: Vec<VisitPairReport>,
}

impl DriftReport {
    /// What `schema` says.
    pub const SCHEMA: &str = "dmp-drift/1";
}

/// How far a run is off where it comes back; lengths in metres, null where nothing is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunDrift {
    /// Name of the run.
    pub name: String,
    /// Pairs of visits with an answer in all three directions.
    pub pairs: usize,
    /// Pairs whose answer leaves a direction open.
    pub pairs_in_part: usize,
    /// Pairs without an answer.
    pub pairs_refused: usize,
    /// Median distance between where the run put a visit and where its surfaces are.
    pub median_m: Measured,
    /// Root mean square of the distances, less what noise of the measurement adds.
    pub rms_m: Measured,
    /// 95 % of the distances are no longer.
    pub p95_m: Measured,
    /// Root mean squares of the parts, less noise: along the way, to the side of it, upwards.
    pub along_m: Option<f64>,
    /// See [`Self::along_m`].
    pub sideways_m: Option<f64>,
    /// See [`Self::along_m`].
    pub up_m: Option<f64>,
    /// Root mean squares of the rotations, degrees: about the way, about what is to the left of it, about up, and the whole.
    pub roll_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub pitch_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub yaw_deg: Option<f64>,
    /// See [`Self::roll_deg`].
    pub angle_deg: Option<f64>,
    /// Median of the distances in per cent of the way between the visits.
    pub of_the_way_percent: Option<f64>,
    /// Distances by the way between the visits, metres: each bin twice as long as the one before.
    pub over_way: Vec<DriftBin>,
    /// The same by the time between them, seconds.
    pub over_time: Vec<DriftBin>,
}

/// A number with its interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The number.
    pub value: Option<f64>,
    /// Its interval over blocks of neighbouring pairs; null where there are too few of them.
    pub interval: Option<[f64; 2]>,
}

/// The pairs of visits that have so much between them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftBin {
    /// From so much on.
    pub from: f64,
    /// To less than this.
    pub to: f64,
    /// Pairs with an answer.
    pub pairs: usize,
    /// Root mean square of the distances, less noise, metres.
    pub rms_m: f64,
    /// Median, metres.
    pub median_m: f64,
}

/// Two runs compared where they come back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftComparison {
    /// One run.
    pub a: String,
    /// The other.
    pub b: String,
    /// Pairs of visits with an answer in both.
    pub pairs: usize,
    /// Root mean squares over these, less noise, metres.
    pub rms_a_m: Option<f64>,
    /// See [`Self::rms_a_m`].
    pub rms_b_m: Option<f64>,
    /// Mean square of a less that of b, m²: negative where a is better.
    pub difference_m2: Measured,
    /// The one that is better: its interval has one sign alone; null where that is not so.
    pub better: Option<String>,
}

/// Two visits to a place, and what every run makes of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitPairReport {
    /// The earlier visit.
    pub first: VisitReport,
    /// The later one.
    pub second: VisitReport,
    /// How far they lie apart, metres: the median over the runs.
    pub apart_m: f64,
    /// The way between them, metres.
    pub way_m: f64,
    /// Each run, in the order given.
    pub runs: Vec<VisitPairOfRun>,
}

/// A visit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitReport {
    /// The scan whose pose is that of the visit: its number in the log.
    pub scan: usize,
    /// Its stamp, nanoseconds; null where the log has none.
    pub stamp_ns: Option<i64>,
    /// The scans whose returns were looked at.
    pub scans: Vec<usize>,
}

/// What a run makes of a pair of visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VisitPairOfRun {
    /// Where the run has the first visit, in its own world, metres; null where it has no pose there.
    pub at_m: Option<[f64; 3]>,
    /// By how much it is off; null where the surfaces do not tell.
    pub off: Option<Displacement>,
    /// Why they do not.
    pub why_not: Option<String>,
    /// Where the surfaces have the second visit's sensor, seen from that of the first: x, y, z (metres), qx, qy, qz, qw.
    pub first_from_second: Option<[f64; 7]>,
    /// Of a rotation vector (radians) and a translation (metres) put before that, in the frame of the first visit's sensor: the
    /// upper triangle of the covariance, row by row.
    pub covariance: Option<[f64; 21]>,
}
