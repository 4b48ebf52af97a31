mod build;
mod scores;
mod warnings;

use std::collections::BTreeMap;

use dmp_reduce::Scales;
use serde::{Deserialize, Serialize};

use crate::segment_length::SegmentLength;

pub use scores::ScaleScores;

pub(crate) use build::{Findings, ToldMap, drops_in_words, map_report};

/// What an evaluation found. Serialised, it is the command's JSON: schema `dmp-score/2`, described in
/// `docs/json.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// Always `dmp-score/2`.
    pub schema: String,
    /// Version of this program.
    pub dmp_version: String,
    /// The settings as they took effect.
    pub config: ConfigReport,
    /// What was read, used and dropped.
    pub inputs: InputReport,
    /// What was kept out of all maps; null where trails were not looked for.
    pub free_space: Option<FreeSpaceReport>,
    /// The runs, in the order given.
    pub runs: Vec<RunReport>,
    /// Names of the runs, best first.
    pub order: Vec<String>,
    /// Neighbours of that order between which nothing is decided.
    pub ties: Vec<[String; 2]>,
    /// Every pair of runs.
    pub pairs: Vec<PairReport>,
    /// What the verdicts on them promise, all together.
    pub promise: PromiseReport,
    /// How much of the log was scored.
    pub sampling: SamplingReport,
    /// What a reader must know before believing any of it.
    pub warnings: Vec<String>,
    /// How long it took.
    pub timing: PassTimes,
    /// What it needed.
    pub memory: MemoryReport,
    /// Each run's sums by tile; not part of the JSON.
    #[serde(skip)]
    pub tiles: Vec<TileReport>,
}

impl Report {
    /// What `schema` says.
    pub const SCHEMA: &str = "dmp-score/2";

    /// Sentences that must stand beside the scores: the report's warnings, those of its runs with their names, and why a
    /// run has no `R_cv` where others do.
    pub fn all_warnings(&self) -> Vec<String> {
        let is_cross_validated = self.runs.iter().any(|run| run.coverage.is_some());
        let mut all = self.warnings.clone();
        for run in &self.runs {
            let told = run.warnings.iter().any(|warning| warning.starts_with("R_cv is not given"));
            if let Some(why) = run.r_cv_withheld.as_ref().filter(|_| !told && is_cross_validated) {
                all.push(format!("{}: R_cv is not given: {why}", run.name));
            }
            all.extend(run.warnings.iter().map(|warning| format!("{}: {warning}", run.name)));
        }
        all
    }
}

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
    /// How the drive was cut.
    pub segments: SegmentReport,
    /// Smallest range used, metres.
    pub min_range_m: f64,
    /// Largest range used, metres.
    pub max_range_m: f64,
    /// How far predictions are looked for, metres.
    pub horizon_m: f64,
    /// `auto`, `none` or `box`.
    pub ego: String,
    /// Cells of 0.1 m found on the vehicle.
    pub ego_cells: usize,
    /// The box given for it, smallest and largest corner, metres; null where none was.
    pub ego_box_m: Option<[[f64; 3]; 2]>,
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
    /// Whether returns on the trails of moving objects were kept out of the maps.
    pub free_space: bool,
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

/// How the drive was cut into segments, the same for all runs.
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
    /// Way from scan to scan, the median of the runs, added up, metres.
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

/// What was read, used and dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputReport {
    /// The log.
    pub log: String,
    /// Its format.
    pub format: String,
    /// Identifies the log: see `docs/json.md`.
    pub fingerprint: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// The topic read.
    pub topic: Option<String>,
    /// How the times of points were understood; null where there are none.
    pub point_times: Option<String>,
    /// First and last stamp, nanoseconds.
    pub span_ns: Option<(i64, i64)>,
    /// Scans that can be read.
    pub scans: usize,
    /// Scans used.
    pub scans_used: usize,
    /// Returns of all scans that can be read.
    pub returns: u64,
    /// Returns used.
    pub returns_used: u64,
    /// Returns dropped, by reason. Used and dropped add up to all.
    pub dropped: DropReport,
    /// The runs' trajectories and maps.
    pub runs: Vec<RunInputReport>,
    /// What was guessed about the log.
    pub notes: Vec<String>,
    /// What of the log is lost.
    pub damage: Vec<String>,
}

/// Returns dropped by reason, every reason listed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct DropReport(pub BTreeMap<String, u64>);

/// A run's inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunInputReport {
    /// Name of the run.
    pub name: String,
    /// The file or topic of the trajectory; null where the caller did not say.
    pub file: Option<String>,
    /// Its format; null where the caller did not say.
    pub format: Option<String>,
    /// Poses of the trajectory.
    pub poses: usize,
    /// Where the sensor sits on its body: x, y, z (metres), qx, qy, qz, qw.
    pub body_from_sensor: [f64; 7],
    /// Where that is from, in words.
    pub body_from_sensor_source: String,
    /// The frame that the run is scored in, which follows from its way: takes places of its trajectory's frame
    /// there. x, y, z (metres), qx, qy, qz, qw.
    pub world_from_own: [f64; 7],
    /// `by stamp` or `line by line`.
    pub pairing: String,
    /// Longest gap between poses that is interpolated over, seconds.
    pub max_time_gap_s: f64,
    /// Scans without a pose in this run.
    pub scans_without_pose: usize,
    /// Its map: `fused`, or the file given.
    pub map: String,
    /// What was made of a map that was given: its unit where that is not plainly the metre, the samples of a mesh.
    pub map_notes: Vec<String>,
    /// What was guessed about the trajectory.
    pub notes: Vec<String>,
}

/// The scores of a run; squares in m². Null where there is nothing to divide by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunReport {
    /// Name of the run.
    pub name: String,
    /// Returns scored.
    pub returns: u64,
    /// Scans scored.
    pub frames: usize,
    /// The paper's DMP: Σ (z − z1)² over returns with z1.
    pub dmp_sum_m2: f64,
    /// Its mean over those returns.
    pub dmp_mean_m2: Option<f64>,
    /// The same of a depth camera in its own number, depth along the optical axis: what the paper has for depth images.
    /// Null for other sensors.
    pub dmp_depth_sum_m2: Option<f64>,
    /// Its mean.
    pub dmp_depth_mean_m2: Option<f64>,
    /// R_cv, by truncation.
    pub r_cv_m2: ScaleScores,
    /// Interval of R_cv at its largest truncation, by itself as sure as [`PromiseReport::confidence`].
    pub r_cv_interval_m2: Option<[f64; 2]>,
    /// Why R_cv is not given; null where it is.
    pub r_cv_withheld: Option<String>,
    /// R_near, by truncation.
    pub r_near_m2: ScaleScores,
    /// The same of R_near.
    pub r_near_interval_m2: Option<[f64; 2]>,
    /// Share of returns without any crossing.
    pub miss_rate: Option<f64>,
    /// Share of returns with a surfel more than 0.5 m in front, in a room 0.05 m.
    pub blocked_rate: Option<f64>,
    /// Share of returns with an independent crossing.
    pub coverage: Option<f64>,
    /// The same, five segments to either side left out: places seen on another visit.
    pub coverage_revisit: Option<f64>,
    /// −DMP / (2 s²), or −Σ ((z − z1) / s(z))² / 2 where s grows with depth: a raw sum, not a probability.
    pub log_likelihood_raw: f64,
    /// The map.
    #[serde(flatten)]
    pub map: MapReport,
    /// What to know of this run.
    pub warnings: Vec<String>,
}

/// A run's map; of places, their maps together.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapReport {
    /// Surfels.
    pub surfels: u64,
    /// Tiles with anything in them.
    pub tiles: u64,
    /// Occupied voxels with too few points for a surfel; null for a store that was given.
    pub thin_voxels: Option<u64>,
    /// Points of a given cloud, or triangles of a given mesh, that are not finite.
    pub map_points_dropped: u64,
    /// Surfels with all returns in the map; null where trails were not looked for.
    pub surfels_with_trails: Option<u64>,
    /// How many of those rays pass through: see `docs/metric.md`.
    pub surfels_contradicted: Option<u64>,
}

impl MapReport {
    /// Adds the map of another place.
    pub(crate) fn add(&mut self, other: &Self) {
        let sum = |a: Option<u64>, b: Option<u64>| a.map_or(b, |a| Some(a + b.unwrap_or(0)));
        self.surfels += other.surfels;
        self.tiles += other.tiles;
        self.thin_voxels = sum(self.thin_voxels, other.thin_voxels);
        self.map_points_dropped += other.map_points_dropped;
        self.surfels_with_trails = sum(self.surfels_with_trails, other.surfels_with_trails);
        self.surfels_contradicted = sum(self.surfels_contradicted, other.surfels_contradicted);
    }
}

/// What was kept out of all maps.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FreeSpaceReport {
    /// The runs that say what a trail is.
    pub votes: Vec<String>,
    /// Returns used of all scans that the maps are made of.
    pub returns_fused: u64,
    /// How many of these are in no map; they are scored all the same.
    pub returns_left_out: u64,
}

/// Two runs compared on their common returns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairReport {
    /// One run.
    pub a: String,
    /// The other.
    pub b: String,
    /// `R_cv`, or `R_near` where a map was given.
    pub score: String,
    /// Every scale, the largest first, also those after the one that decided.
    pub scales: Vec<ScaleReport>,
    /// The paper's LLR, log p(Z|a) − log p(Z|b): a raw sum, not a probability.
    pub llr_raw: f64,
    /// Name of the better run, `mixed`, `same` or `undecided`.
    pub verdict: String,
    /// Whether no difference that matters is left possible at any scale; true also of some pairs in which one run is
    /// better beyond doubt, by too little to matter.
    pub is_same: bool,
    /// For `mixed`: the run that is better on the whole.
    pub better_on_the_whole: Option<String>,
    /// The scale that decided, metres.
    pub decided_at_m: Option<f64>,
    /// The verdict in words.
    pub reason: String,
    /// Where a sample decides nothing: about how many scans would, as far as it shows a difference at all.
    pub frames_needed: Option<u64>,
    /// The same of places, where these were drawn.
    pub places_needed: Option<u64>,
}

/// Two runs at one scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScaleReport {
    /// The truncation τ, metres.
    pub scale_m: f64,
    /// The mean of a over the common returns, m².
    pub mean_a_m2: Option<f64>,
    /// The mean of b over the common returns, m².
    pub mean_b_m2: Option<f64>,
    /// Mean of a minus b over the common returns, m²: negative where a is better.
    pub difference_m2: Option<f64>,
    /// Its interval, as sure as [`PromiseReport::interval_confidence`].
    pub interval_m2: Option<[f64; 2]>,
    /// How far apart the root mean squares of the two may be at most, by that interval, metres.
    pub apart_at_most_m: Option<f64>,
    /// How far apart they may be and still count as the same, metres.
    pub margin_m: Option<f64>,
    /// Common returns.
    pub returns: u64,
}

/// What the verdicts on all pairs promise together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PromiseReport {
    /// Where runs are equal, no two of them are told apart in this share of commands: over all pairs, scales and looks.
    pub confidence: f64,
    /// How sure each interval of a difference is, so that all together keep that.
    pub interval_confidence: f64,
    /// How far apart two runs may be and still count as the same: this share of the better one's root mean square; null
    /// where metres were asked for.
    pub same_within_share: Option<f64>,
    /// So many metres at every scale; null where a share was asked for.
    pub same_within_m: Option<f64>,
}

/// How much of the log was scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingReport {
    /// Scans scored.
    pub frames_scored: u64,
    /// Scans that could have been.
    pub frames_total: u64,
    /// Seed of the sample; null where no sample was asked for.
    pub seed: Option<u64>,
    /// How many scans were scored at each look whether that decides; null where no decision was asked for.
    pub looks: Option<Vec<u64>>,
    /// Where not scans but places were drawn: which; null where not.
    pub places: Option<PlacesReport>,
}

/// The places that a quick score was made at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacesReport {
    /// Places scored.
    pub drawn: u64,
    /// Places along the way.
    pub total: u64,
    /// How many of those scored the way comes back to, in most runs.
    pub revisited: u64,
    /// How many of all it comes back to.
    pub revisited_total: u64,
    /// Places for which not all scans were read, as there were too many.
    pub cut: u64,
    /// Length of a place along the way, metres.
    pub length_m: f64,
    /// Scans so near to a place's middle make its map, metres.
    pub radius_m: f64,
    /// The way from one of them to the next, metres.
    pub spacing_m: f64,
    /// Scans read for places, each counted once for each place.
    pub scans_read: u64,
    /// Whether these are as few as are ever drawn, whatever share of the log they take.
    pub are_fewest: bool,
    /// Share of the log's bytes that was to be read.
    pub share_asked: f64,
    /// Bytes of the log that were read, index and all; null where it is not known.
    pub bytes_read: Option<u64>,
}

/// How long it took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassTimes {
    /// Planning, the survey included, seconds.
    pub plan_s: f64,
    /// Fusing the maps, seconds.
    pub fuse_s: f64,
    /// Finding trails and fusing the maps without them, seconds.
    pub trails_s: f64,
    /// Casting and reducing, seconds.
    pub cast_s: f64,
    /// All, seconds.
    pub total_s: f64,
    /// By how many threads.
    pub threads: usize,
}

/// What it needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemoryReport {
    /// The budget, bytes.
    pub budget_bytes: usize,
    /// The largest anonymous memory seen, bytes; null where the system does not tell.
    pub peak_anon_bytes: Option<u64>,
    /// Partial tiles written to the scratch file, bytes.
    pub scratch_bytes: u64,
    /// That, and the maps that were fused, bytes.
    pub disk_bytes: u64,
    /// What was expected of them before anything was written, bytes.
    pub disk_bytes_estimated: u64,
    /// How often a tile was loaded.
    pub tile_loads: u64,
    /// Tiles of all maps that were ever within the sensor's reach.
    pub tiles_in_reach: u64,
    /// How often they came into it: no tile is loaded more often where the memory holds those in reach at once.
    pub tile_visits: u64,
}

/// The sums of one run's returns that lie in one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct TileReport {
    /// Index of the run.
    pub run: usize,
    /// The tile.
    pub tile: dmp_map::TileId,
    /// The sums.
    pub sums: dmp_reduce::RunSums,
}
