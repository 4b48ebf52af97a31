use std::collections::BTreeMap;

use dmp_log::ScanLog;
use dmp_reduce::{
    Basis, Comparison, Estimate, ScaleComparison, Verdict, log_likelihood_ratio_raw, log_likelihood_raw,
};
use dmp_sensor::{DropReason, ReturnCounts};
use serde::Serialize;

use crate::cast::{HORIZON, Scored};
use crate::config::{Config, Ego, MapSource, Run};
use crate::fuse::{Maps, RunMap};
use crate::plan::{Pairing, Plan};
use crate::{memory, warnings};

/// What an evaluation found. Serialised, it is the command's JSON: schema `dmp-score/1`, described in
/// `docs/json.md`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Always `dmp-score/1`.
    pub schema: &'static str,
    /// Version of this program.
    pub dmp_version: &'static str,
    /// The settings as they took effect.
    pub config: ConfigReport,
    /// What was read, used and dropped.
    pub inputs: InputReport,
    /// The runs, in the order given.
    pub runs: Vec<RunReport>,
    /// Names of the runs, best first.
    pub order: Vec<String>,
    /// Neighbours of that order between which nothing is decided.
    pub ties: Vec<[String; 2]>,
    /// Every pair of runs.
    pub pairs: Vec<PairReport>,
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

/// The settings as they took effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    pub ego: &'static str,
    /// Cells of 0.1 m found on the vehicle.
    pub ego_cells: usize,
    /// Every n-th scan was used.
    pub every: usize,
    /// body_from_sensor as x, y, z (metres), qx, qy, qz, qw.
    pub body_from_sensor: [f64; 7],
    /// Added to the log's stamps, seconds.
    pub time_offset_s: f64,
    /// Range noise behind the raw log-likelihood, metres.
    pub sigma_m: f64,
}

/// How the drive was cut into segments, the same for all runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SegmentReport {
    /// Length of a segment, metres; null where every scan is a segment of its own.
    pub length_m: Option<f64>,
    /// How many.
    pub count: usize,
    /// Way from scan to scan, the median of the runs, added up, metres.
    pub travel_m: f64,
    /// The stamps at which segments begin, nanoseconds; empty for a log without stamps.
    pub starts_ns: Vec<i64>,
    /// The scans (index in the log) with which segments begin.
    pub starts_scan: Vec<usize>,
}

/// What was read, used and dropped.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct DropReport(pub BTreeMap<&'static str, u64>);

/// A run's inputs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RunInputReport {
    /// Name of the run.
    pub name: String,
    /// Poses of the trajectory.
    pub poses: usize,
    /// `by stamp` or `line by line`.
    pub pairing: &'static str,
    /// Scans without a pose in this run.
    pub scans_without_pose: usize,
    /// Its map: `fused`, or the file given.
    pub map: String,
}

/// The scores of a run; squares in m². Null where there is nothing to divide by.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// R_cv, by truncation.
    pub r_cv_m2: CvScores,
    /// 99 % interval of R_cv at 10 m.
    pub r_cv_10_ci99_m2: Option<[f64; 2]>,
    /// Why R_cv is not given; null where it is.
    pub r_cv_withheld: Option<String>,
    /// R_near, by truncation.
    pub r_near_m2: NearScores,
    /// Share of returns without any crossing.
    pub miss_rate: Option<f64>,
    /// Share of returns with a surfel more than 0.5 m in front.
    pub blocked_rate: Option<f64>,
    /// Share of returns with an independent crossing.
    pub coverage: Option<f64>,
    /// The same, five segments to either side left out: places seen on another visit.
    pub coverage_revisit: Option<f64>,
    /// −DMP / (2 s²): a raw sum, not a probability.
    pub log_likelihood_raw: f64,
    /// The map.
    #[serde(flatten)]
    pub map: MapReport,
    /// What to know of this run.
    pub warnings: Vec<String>,
}

/// R_cv by truncation, m²; the keys are metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CvScores {
    /// Over all returns, misses at 25 m².
    #[serde(rename = "10")]
    pub at_10: Option<f64>,
    /// Over returns with an independent crossing.
    #[serde(rename = "2")]
    pub at_2: Option<f64>,
    /// The same.
    #[serde(rename = "0.5")]
    pub at_0_5: Option<f64>,
    /// The same.
    #[serde(rename = "0.2")]
    pub at_0_2: Option<f64>,
}

/// R_near by truncation, m²; the keys are metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NearScores {
    /// Over returns with any crossing.
    #[serde(rename = "5")]
    pub at_5: Option<f64>,
    /// The same.
    #[serde(rename = "2")]
    pub at_2: Option<f64>,
    /// The same.
    #[serde(rename = "0.5")]
    pub at_0_5: Option<f64>,
}

/// A run's map.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MapReport {
    /// Surfels.
    pub surfels: u64,
    /// Tiles with anything in them.
    pub tiles: u64,
    /// Occupied voxels with too few points for a surfel; null for a store that was given.
    pub thin_voxels: Option<u64>,
    /// Points of a given cloud that are not finite.
    pub map_points_dropped: u64,
}

/// Two runs compared on their common returns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairReport {
    /// One run.
    pub a: String,
    /// The other.
    pub b: String,
    /// `R_cv`, or `R_near` where a map was given.
    pub score: &'static str,
    /// Every scale, the largest first, also those after the one that decided.
    pub scales: Vec<ScaleReport>,
    /// The paper's LLR, log p(Z|a) − log p(Z|b): a raw sum, not a probability.
    pub llr_raw: f64,
    /// Name of the better run, `mixed` or `undecided`.
    pub verdict: String,
    /// For `mixed`: the run that is better on the whole.
    pub better_on_the_whole: Option<String>,
    /// The scale that decided, metres.
    pub decided_at_m: Option<f64>,
    /// The verdict in words.
    pub reason: String,
}

/// Two runs at one scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScaleReport {
    /// The truncation τ, metres.
    pub scale_m: f64,
    /// The mean of a over the common returns, m².
    pub mean_a_m2: Option<f64>,
    /// The mean of b over the common returns, m².
    pub mean_b_m2: Option<f64>,
    /// Mean of a minus b over the common returns, m²: negative where a is better.
    pub difference_m2: Option<f64>,
    /// Its 99 % interval.
    pub ci99_m2: Option<[f64; 2]>,
    /// Common returns.
    pub returns: u64,
}

/// How much of the log was scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SamplingReport {
    /// Scans scored.
    pub frames_scored: u64,
    /// Scans that could have been.
    pub frames_total: u64,
    /// Seed of the sample; null where all were scored.
    pub seed: Option<u64>,
}

/// How long it took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PassTimes {
    /// Planning, the survey included, seconds.
    pub plan_s: f64,
    /// Fusing the maps, seconds.
    pub fuse_s: f64,
    /// Casting and reducing, seconds.
    pub cast_s: f64,
    /// All, seconds.
    pub total_s: f64,
    /// By how many threads.
    pub threads: usize,
}

/// What it needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MemoryReport {
    /// The budget, bytes.
    pub budget_bytes: usize,
    /// The largest anonymous memory seen, bytes; null where the system does not tell.
    pub peak_anon_bytes: Option<u64>,
    /// Partial tiles written to the scratch file, bytes.
    pub scratch_bytes: u64,
    /// How often a tile was loaded.
    pub tile_loads: u64,
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

/// The maps as they are before the caster takes them.
pub(crate) fn map_reports(runs: &[Run], maps: &[RunMap]) -> Vec<MapReport> {
    let report = |(_, map): (&Run, &RunMap)| MapReport {
        surfels: map.store.surfels(),
        tiles: map.store.entries().count() as u64,
        thin_voxels: map.thin_voxels,
        map_points_dropped: map.points_dropped,
    };
    runs.iter().zip(maps).map(report).collect()
}

/// Dropped returns by reason, as one line.
pub(crate) fn drops_in_words(counts: &ReturnCounts) -> String {
    let parts: Vec<String> = DropReason::ALL
        .iter()
        .filter(|&&reason| counts.dropped(reason) > 0)
        .map(|&reason| format!("{} {}", counts.dropped(reason), reason.name()))
        .collect();
    if parts.is_empty() { "the scans are empty".to_owned() } else { parts.join(", ") }
}

impl Report {
    #[expect(clippy::too_many_arguments, reason = "the report is where everything meets")]
    pub(crate) fn new(
        log: &dyn ScanLog,
        runs: &[Run],
        config: &Config,
        plan: &Plan,
        maps: &Maps,
        map_reports: Vec<MapReport>,
        scored: &Scored,
        timing: PassTimes,
    ) -> Self {
        let reducer = &scored.reducer;
        let comparisons = reducer.comparisons();
        let ranked = reducer.order(&comparisons);
        let name = |run: usize| runs[run].name.clone();
        let ties = ranked
            .windows(2)
            .filter(|pair| pair[0].tied_with_next)
            .map(|pair| [name(pair[0].run), name(pair[1].run)])
            .collect();
        let mut report = Self {
            schema: "dmp-score/1",
            dmp_version: env!("CARGO_PKG_VERSION"),
            config: config_report(config, plan, scored),
            inputs: input_report(log, runs, plan, &scored.counts),
            runs: map_reports
                .into_iter()
                .enumerate()
                .map(|(run, map)| run_report(run, runs, config, scored, map))
                .collect(),
            order: ranked.iter().map(|ranked| name(ranked.run)).collect(),
            ties,
            pairs: comparisons.iter().map(|pair| pair_report(pair, runs, config, plan, scored)).collect(),
            sampling: SamplingReport {
                frames_scored: reducer.layout().frames_scored(),
                frames_total: reducer.layout().frames_total(),
                seed: None,
            },
            warnings: Vec::new(),
            timing,
            memory: MemoryReport {
                budget_bytes: config.memory_bytes,
                peak_anon_bytes: memory::peak_anonymous_bytes(),
                scratch_bytes: maps.scratch_bytes,
                tile_loads: scored.tile_loads,
            },
            tiles: tile_reports(scored),
        };
        warnings::add(&mut report, plan);
        report
    }
}

fn config_report(config: &Config, plan: &Plan, scored: &Scored) -> ConfigReport {
    let lattice = scored.casters[0].store().lattice();
    let extrinsic = &config.body_from_sensor;
    let (t, q) = (extrinsic.translation.vector, extrinsic.rotation.coords);
    let starts = || plan.segments.starts.iter().map(|&ordinal| &plan.frames[ordinal]);
    ConfigReport {
        voxel_m: lattice.voxel_m(),
        voxel_filled_share: plan.voxel.filled_share,
        tile_edge_m: lattice.tile_edge_m(),
        disc_radius_m: lattice.disc_radius_m(),
        segments: SegmentReport {
            length_m: plan.segments.length_m,
            count: plan.segments.starts.len(),
            travel_m: plan.segments.travel_m,
            starts_ns: starts().filter_map(|frame| frame.stamp_ns).collect(),
            starts_scan: starts().map(|frame| frame.frame).collect(),
        },
        min_range_m: config.min_range_m,
        max_range_m: config.max_range_m,
        horizon_m: HORIZON * config.max_range_m,
        ego: match config.ego {
            Ego::Auto => "auto",
            Ego::None => "none",
            Ego::BoxMm(..) => "box",
        },
        ego_cells: plan.filter.ego.cells(),
        every: config.every,
        body_from_sensor: [t.x, t.y, t.z, q.x, q.y, q.z, q.w],
        time_offset_s: config.time_offset_ns as f64 / 1e9,
        sigma_m: config.sigma_m,
    }
}

fn input_report(log: &dyn ScanLog, runs: &[Run], plan: &Plan, counts: &ReturnCounts) -> InputReport {
    let summary = log.summary();
    let run_input = |(k, run): (usize, &Run)| RunInputReport {
        name: run.name.clone(),
        poses: run.trajectory.len(),
        pairing: match plan.pairings[k] {
            Pairing::ByStamp => "by stamp",
            Pairing::ByLine => "line by line",
        },
        scans_without_pose: plan.without_pose[k],
        map: match &run.map {
            MapSource::Fused => "fused".to_owned(),
            MapSource::Given(path) => path.display().to_string(),
        },
    };
    InputReport {
        log: summary.path.display().to_string(),
        format: summary.format.name().to_owned(),
        fingerprint: summary.fingerprint.clone(),
        bytes: summary.bytes,
        topic: summary.topic.clone(),
        point_times: summary.point_times.clone(),
        span_ns: summary.span_ns,
        scans: log.frames().len(),
        scans_used: plan.frames.len(),
        returns: counts.total(),
        returns_used: counts.used(),
        dropped: DropReport(
            DropReason::ALL.iter().map(|&reason| (reason.name(), counts.dropped(reason))).collect(),
        ),
        runs: runs.iter().enumerate().map(run_input).collect(),
        notes: summary.notes.clone(),
        damage: summary.damage.iter().map(|damage| format!("{}: {}", damage.place, damage.what)).collect(),
    }
}

fn run_report(run: usize, runs: &[Run], config: &Config, scored: &Scored, map: MapReport) -> RunReport {
    let scores = scored.reducer.scores(run);
    let sums = &scores.sums;
    let basis = scored.reducer.layout().bases()[run];
    let withheld = sums.r_cv_withheld(basis);
    let given = withheld.is_none();
    let cv = |k: usize| scores.r_cv_m2[k].1.filter(|_| given).map(|estimate: Estimate| estimate.value_m2);
    let near = |k: usize| scores.r_near_m2[k].1.map(|estimate| estimate.value_m2);
    let cross_validated = |share: Option<f64>| share.filter(|_| basis == Basis::CrossValidated);
    RunReport {
        name: runs[run].name.clone(),
        returns: sums.returns(),
        frames: scored.reducer.frames_added() as usize,
        dmp_sum_m2: sums.dmp_sum_m2(),
        dmp_mean_m2: sums.dmp_mean_m2(),
        r_cv_m2: CvScores { at_10: cv(0), at_2: cv(1), at_0_5: cv(2), at_0_2: cv(3) },
        r_cv_10_ci99_m2: scores.r_cv_m2[0].1.filter(|_| given).and_then(interval_of),
        r_cv_withheld: withheld.map(|why| why.to_string()),
        r_near_m2: NearScores { at_5: near(0), at_2: near(1), at_0_5: near(2) },
        miss_rate: sums.miss_rate(),
        blocked_rate: sums.blocked_rate(),
        coverage: cross_validated(sums.coverage()),
        coverage_revisit: cross_validated(sums.coverage_revisit()),
        log_likelihood_raw: log_likelihood_raw(sums.dmp_sum_m2(), config.sigma_m),
        map,
        warnings: Vec::new(),
    }
}

fn interval_of(estimate: Estimate) -> Option<[f64; 2]> {
    estimate.interval.map(|interval| [interval.low_m2, interval.high_m2])
}

fn pair_report(pair: &Comparison, runs: &[Run], config: &Config, plan: &Plan, scored: &Scored) -> PairReport {
    let name = |run: usize| runs[run].name.clone();
    let dmp = |run: usize| scored.reducer.scores(run).sums.dmp_sum_m2();
    let scale = |scale: &ScaleComparison| ScaleReport {
        scale_m: scale.scale_m,
        mean_a_m2: scale.mean_a_m2,
        mean_b_m2: scale.mean_b_m2,
        difference_m2: scale.difference.map(|difference| difference.value_m2),
        ci99_m2: scale.difference.and_then(interval_of),
        returns: pair.common_returns,
    };
    let (verdict, better_on_the_whole, decided_at_m) = match &pair.verdict {
        Verdict::Better { which, decided_at_m, .. } => (name(*which), None, Some(*decided_at_m)),
        Verdict::Mixed { which, decided_at_m, .. } => {
            ("mixed".into(), Some(name(*which)), Some(*decided_at_m))
        }
        Verdict::Undecided { .. } => ("undecided".into(), None, None),
    };
    PairReport {
        a: name(pair.a),
        b: name(pair.b),
        score: match pair.basis {
            Basis::CrossValidated => "R_cv",
            Basis::Near => "R_near",
        },
        scales: pair.scales.iter().map(scale).collect(),
        llr_raw: log_likelihood_ratio_raw(dmp(pair.a), dmp(pair.b), config.sigma_m),
        verdict,
        better_on_the_whole,
        decided_at_m,
        reason: pair.verdict.reason_with(|ordinal| plan.frames[ordinal as usize].frame as u64),
    }
}

fn tile_reports(scored: &Scored) -> Vec<TileReport> {
    let mut tiles: Vec<TileReport> =
        scored.tiles.iter().map(|(&(run, tile), &sums)| TileReport { run, tile, sums }).collect();
    tiles.sort_by_key(|tile| (tile.run, tile.tile));
    tiles
}
