//! The scores and the map of a run, in a report.

use dmp_map::Thickness;
use dmp_reduce::{Basis, Estimate, REVISIT_NEEDED, RunScores};
use serde::{Deserialize, Serialize};

use crate::pair::interval_of;
use crate::scores::ScaleScores;
use crate::withheld::Withheld;

/// The scores of a run; squares in m². Null where there is nothing to divide by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunReport {
    /// Name of the run.
    pub name: String,
    /// Returns scored.
    pub returns: u64,
    /// Returns with a pose that are not scored: the map leaves out their places, since something moved there.
    pub returns_left_out: u64,
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
    /// Interval of R_cv at its largest truncation, by itself as sure as
    /// [`PromiseReport::confidence`](super::PromiseReport::confidence).
    pub r_cv_interval_m2: Option<[f64; 2]>,
    /// Why R_cv is not given; null where it is.
    pub r_cv_withheld: Option<Withheld>,
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

/// What is known of a run beside its sums.
#[derive(Debug)]
pub struct RunFacts {
    /// Its name.
    pub name: String,
    /// Scans scored with a pose.
    pub frames: usize,
    /// What its scores rest on.
    pub basis: Basis,
    /// Whether a depth camera measured.
    pub has_depth: bool,
    /// The raw log-likelihood.
    pub log_likelihood: f64,
    /// What is known of its map.
    pub map: MapReport,
}

impl RunReport {
    /// The scores of a run.
    pub fn of(scores: &RunScores, facts: RunFacts) -> Self {
        let RunFacts { name, frames, basis, has_depth, log_likelihood, map } = facts;
        let sums = &scores.sums;
        let withheld = sums.r_cv_withheld(basis);
        let given = withheld.is_none();
        let value =
            |(scale_m, score): (f64, Option<Estimate>)| (scale_m, score.map(|estimate| estimate.value_m2));
        let cv = ScaleScores::new(scores.r_cv_m2.map(|(m, score)| value((m, score.filter(|_| given)))));
        let cross_validated = |share: Option<f64>| share.filter(|_| basis == Basis::CrossValidated);
        Self {
            name,
            returns: sums.returns(),
            returns_left_out: sums.left_out(),
            frames,
            dmp_sum_m2: sums.dmp_sum_m2(),
            dmp_mean_m2: sums.dmp_mean_m2(),
            dmp_depth_sum_m2: has_depth.then(|| sums.dmp_depth_sum_m2()),
            dmp_depth_mean_m2: sums.dmp_depth_mean_m2().filter(|_| has_depth),
            r_cv_m2: cv,
            r_cv_interval_m2: scores.r_cv_m2[0].1.filter(|_| given).and_then(interval_of),
            r_cv_withheld: withheld.map(Withheld::Known),
            r_near_m2: ScaleScores::new(scores.r_near_m2.map(value)),
            r_near_interval_m2: scores.r_near_m2[0].1.and_then(interval_of),
            miss_rate: sums.miss_rate(),
            blocked_rate: sums.blocked_rate(),
            coverage: cross_validated(sums.coverage()),
            coverage_revisit: cross_validated(sums.coverage_revisit()),
            log_likelihood_raw: log_likelihood,
            map,
            warnings: Vec::new(),
        }
    }

    /// Whether so few returns are seen on another visit that its scores hardly show drift.
    pub fn has_few_revisits(&self) -> bool {
        self.coverage_revisit.is_some_and(|share| share < REVISIT_NEEDED)
    }

    /// Its scores by truncation: `R_cv` or `R_near`.
    pub fn scores(&self, basis: Basis) -> &ScaleScores {
        match basis {
            Basis::CrossValidated => &self.r_cv_m2,
            Basis::Near => &self.r_near_m2,
        }
    }

    /// The first of them, m², with its interval.
    pub fn first_score(&self, basis: Basis) -> (Option<f64>, Option<[f64; 2]>) {
        let interval_m2 = match basis {
            Basis::CrossValidated => self.r_cv_interval_m2,
            Basis::Near => self.r_near_interval_m2,
        };
        (self.scores(basis)[0], interval_m2)
    }
}

/// A run's map; of places, their maps together.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MapReport {
    /// Surfels, before some are left out.
    pub surfels: u64,
    /// Tiles with anything in them.
    pub tiles: u64,
    /// Occupied voxels with too few points for a surfel; null for a store that was given.
    pub thin_voxels: Option<u64>,
    /// Points of a given cloud, or triangles of a given mesh, that are not finite.
    pub map_points_dropped: u64,
    /// How thick its flat places are; null if these are too few, for a given map, for a quick score and for one in parts.
    pub thickness: Option<Thickness>,
    /// How many of them are left out, since rays show that something moved: see `docs/metric.md`. Null for a given map and
    /// for a score in parts.
    pub surfels_contradicted: Option<u64>,
}

impl MapReport {
    /// Adds the map of another place.
    pub fn add(&mut self, other: &Self) {
        let sum = |a: Option<u64>, b: Option<u64>| a.map_or(b, |a| Some(a + b.unwrap_or(0)));
        self.surfels += other.surfels;
        self.tiles += other.tiles;
        self.thin_voxels = sum(self.thin_voxels, other.thin_voxels);
        self.map_points_dropped += other.map_points_dropped;
        self.surfels_contradicted = sum(self.surfels_contradicted, other.surfels_contradicted);
    }
}
