//! Measures a run's drift at revisits in metres, from its own scans.
//!
//! Where two visits see the same surfaces, the motion that aligns them is the drift between the visits. All
//! runs use the same pairs of visits and the same scans.

mod constraint;
mod displacement;
mod how_many;
mod patches;
mod register;
mod report;
mod summary;
mod visits;

use dmp_log::ScanLog;
use dmp_reduce::FrameSet;
use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::evaluation::{Evaluation, Task};
use crate::heads::Heads;
use crate::own_frame;
use crate::plan::spread;
use crate::progress::Stage;
use crate::run_state::RunState;
use crate::seven::seven;
use crate::watch::Watch;
use crate::work::pool;
use constraint::{covariance_in, upper_triangle};
use displacement::Axes;
pub use displacement::Displacement;
pub use how_many::{DriftPairs, DriftReach};
use patches::Visits;
use register::{Seen, register};
pub use report::{
    DriftBin, DriftComparison, DriftReport, Measured, RunDrift, VisitPairOfRun, VisitPairReport, VisitReport,
};
use summary::PairFacts;
pub(crate) use visits::VisitPair;
use visits::{Places, Visit};

/// Approximate memory for the surfaces of a visit in one run, bytes.
const PYRAMID_BYTES: usize = 600 << 10;

/// Measures the drift of `runs` at revisits, on as many pairs of visits as [`Config::drift`] allows, evenly
/// spread.
///
/// Reads only the scans of these visits. The report is bit-identical for every number of threads and memory
/// budget. A log without a revisit has an empty report.
///
/// # Errors
/// As [`evaluate`](crate::evaluate) where log and runs do not belong together, and when a scan cannot be read.
pub fn measure_drift<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<DriftReport, EvaluateError> {
    let config = Config { checkpoint_every: None, resume: false, ..config.clone() };
    let task = Task::open(log, runs, &config, watch.into())?;
    // There is no map whose voxels need choosing.
    let voxel_m = task.settings.voxel_m.unwrap_or(task.settings.scales.lengths().voxels_m[0]);
    let stores = runs.iter().map(|_| None).collect();
    let runs = own_frame::place(Heads::Log(log), runs, stores, &task.settings)?;
    let planned = task.plan_placed(runs, Some(voxel_m))?;
    planned.drift(planned.drift_pairs())
}

impl<M: Sync> Evaluation<'_, M> {
    /// Limit of visit pairs on which drift is measured.
    pub(crate) fn drift_pairs(&self) -> usize {
        self.settings.drift.most(self.plan.segments.starts.len(), self.plan.looks.is_sampled())
    }

    /// Measures the drift of the runs on at most this many pairs of visits.
    pub(crate) fn drift(&self, most_pairs: usize) -> Result<DriftReport, EvaluateError> {
        let revisits = Revisits::new(self, most_pairs);
        let reports = revisits.measure(&revisits.pairs)?;
        Ok(revisits.summed_up(reports))
    }

    /// As many pairs as fit a part of the memory.
    fn pairs_at_a_time(&self) -> usize {
        (self.means.memory_bytes / 4 / (2 * self.runs.len() * PYRAMID_BYTES)).max(1)
    }
}

/// The visits of a drive, their poses in each run, and the pairs that are measured.
pub(crate) struct Revisits<'e, M> {
    evaluation: &'e Evaluation<'e, M>,
    visits: Vec<Visit>,
    places: Places,
    /// From the sensor's frame to that of a place: tilted, so that level ground and walls along the path
    /// cross their voxels.
    tilt: UnitQuaternion<f64>,
    pairs_found: usize,
    pairs: Vec<VisitPair>,
}

impl<'e, M: Sync> Revisits<'e, M> {
    /// Finds the pairs and selects at most this many.
    pub(crate) fn new(evaluation: &'e Evaluation<'_, M>, most_pairs: usize) -> Self {
        let Evaluation { plan, settings, log, .. } = evaluation;
        let is_camera = log.summary().camera.is_some();
        let visits = visits::visits(plan, &plan.along_m, is_camera);
        let places = Places::new(&visits, plan.frames(), evaluation.runs.iter().map(|run| &run.poses));
        let near_m = settings.drift_reach.near_m() * settings.metre_m();
        let found = visits::pairs(&visits, &places, &plan.along_m, near_m, is_camera);
        let pairs = spread(found.len(), most_pairs).into_iter().map(|k| found[k]).collect();
        Self { evaluation, visits, places, tilt: own_frame::tilt(), pairs_found: found.len(), pairs }
    }

    /// The pairs that are measured.
    pub(crate) fn pairs(&self) -> &[VisitPair] {
        &self.pairs
    }

    /// The scans of some pairs.
    pub(crate) fn scans(&self, pairs: &[VisitPair]) -> FrameSet {
        let visits = pairs.iter().flat_map(|pair| [pair.first, pair.second]);
        visits.flat_map(|visit| self.visits[visit].scans.iter().copied()).collect()
    }

    /// Measures some pairs in every run.
    ///
    /// # Errors
    /// When a scan cannot be read.
    pub(crate) fn measure(&self, pairs: &[VisitPair]) -> Result<Vec<VisitPairReport>, EvaluateError> {
        let Evaluation { progress, means, .. } = self.evaluation;
        progress.begin(Stage::Drift, pairs.len() as u64);
        let pool = pool(means.threads)?;
        let mut reports = Vec::with_capacity(pairs.len());
        for batch in pairs.chunks(self.evaluation.pairs_at_a_time()) {
            let numbers = batch.iter().flat_map(|pair| [pair.first, pair.second]);
            let visits: Visits<'_> = numbers
                .map(|number| (number, (&self.visits[number], self.place_from_world(number))))
                .collect();
            let pyramids = patches::pyramids(self.evaluation, &visits)?;
            let report = |pair: &VisitPair| {
                let report = self.report(pair, &pyramids);
                progress.advance(1);
                report
            };
            reports.extend(pool.install(|| batch.par_iter().map(report).collect::<Vec<_>>()));
        }
        Ok(reports)
    }

    /// The report, given the measurement of each pair.
    pub(crate) fn summed_up(&self, visits: Vec<VisitPairReport>) -> DriftReport {
        let Evaluation { settings, plan, runs, .. } = self.evaluation;
        let blocks =
            summary::blocks(&self.pairs.iter().map(|pair| (pair.first, pair.second)).collect::<Vec<_>>());
        let time_s = |pair: &VisitPairReport| {
            let ns = pair.second.stamp_ns?.saturating_sub(pair.first.stamp_ns?);
            Some(ns as f64 / 1e9)
        };
        let fact = |(pair, block): (&VisitPairReport, usize)| PairFacts {
            block,
            way_m: pair.way_m,
            time_s: time_s(pair),
        };
        let facts: Vec<PairFacts> = visits.iter().zip(blocks).map(fact).collect();
        let confidence = settings.confidence;
        let lengths = (settings.metre_m(), confidence);
        let names: Vec<&str> = runs.iter().map(RunState::name).collect();
        let of_run = |(run, name): (usize, &&str)| summary::of_run(name, run, &visits, &facts, lengths);
        let of_runs: Vec<RunDrift> =
            names.iter().enumerate().map(|(run, name)| of_run((run, name))).collect();
        let both = (0..names.len()).flat_map(|a| (a + 1..names.len()).map(move |b| (a, b)));
        let comparisons = both
            .map(|(a, b)| summary::compared((a, b), [names[a], names[b]], &visits, &facts, confidence))
            .collect();
        DriftReport {
            schema: DriftReport::SCHEMA.to_owned(),
            dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
            voxel_m: patches::voxel_m(settings),
            travel_m: plan.segments.travel_m,
            segments: self.visits.len(),
            pairs_found: self.pairs_found,
            pairs_measured: visits.len(),
            confidence: confidence.level(),
            runs: of_runs,
            comparisons,
            visits,
        }
    }

    fn place_from_world(&self, visit: usize) -> Vec<Option<Isometry3<f64>>> {
        let runs = 0..self.evaluation.runs.len();
        runs.map(|run| Some(self.world_from_place(run, visit)?.inverse())).collect()
    }

    fn world_from_place(&self, run: usize, visit: usize) -> Option<Isometry3<f64>> {
        Some(self.places.of(run, visit)? * self.tilt.inverse())
    }

    /// Measures a pair of visits in every run.
    fn report(&self, pair: &VisitPair, pyramids: &patches::Pyramids) -> VisitPairReport {
        let Evaluation { plan, runs, settings, .. } = self.evaluation;
        let metre_m = settings.metre_m();
        let pyramid = |run: usize, visit: usize| pyramids.get(&visit)?.get(run)?.as_ref();
        let seen: Vec<Option<Seen<'_>>> = (0..runs.len())
            .map(|run| {
                let first_from_world = self.world_from_place(run, pair.first)?.inverse();
                let world_from_second = self.world_from_place(run, pair.second)?;
                let (first, second) = (pyramid(run, pair.first)?, pyramid(run, pair.second)?);
                Some(Seen { first, second, claimed: first_from_world * world_from_second })
            })
            .collect();
        let found = register(&seen, settings.drift_reach.steps(), metre_m);
        let of_runs = found.into_iter().zip(&seen).enumerate().map(|(run, (found, seen))| {
            let own_from_place =
                self.world_from_place(run, pair.first).map(|place| runs[run].own_from_world * place);
            let mut of_run = VisitPairOfRun {
                at_m: own_from_place.map(|place| place.translation.vector.into()),
                off: None,
                why_not: None,
                first_from_second: None,
                covariance: None,
            };
            match (found, seen, own_from_place) {
                (Ok(measured), Some(seen), Some(own_from_place)) => {
                    of_run.off = self.axes(run, pair.first).map(|axes| {
                        Displacement::new(&seen.claimed, &measured, &axes, &own_from_place, metre_m)
                    });
                    // The sensor's pose, without the tilt.
                    let sensor_from_place =
                        Isometry3::from_parts(Translation3::identity(), self.tilt.inverse());
                    let motion =
                        sensor_from_place * measured.target_from_source * sensor_from_place.inverse();
                    of_run.first_from_second = Some(seven(&motion));
                    let covariance = covariance_in(&sensor_from_place, &measured.covariance);
                    of_run.covariance = Some(upper_triangle(&covariance));
                }
                (Err(why), ..) => of_run.why_not = Some(why.to_string()),
                _ => {}
            }
            of_run
        });
        let way_m =
            plan.along_m[self.visits[pair.second].middle] - plan.along_m[self.visits[pair.first].middle];
        VisitPairReport {
            first: self.visit_report(pair.first),
            second: self.visit_report(pair.second),
            apart_m: pair.apart_m,
            way_m,
            runs: of_runs.collect(),
        }
    }

    /// Along, left and up in the frame of a place.
    fn axes(&self, run: usize, visit: usize) -> Option<Axes> {
        let place_from_world = self.world_from_place(run, visit)?.rotation.inverse();
        let up = place_from_world * (self.tilt * Vector3::z());
        let heading = place_from_world * self.places.heading(run, visit);
        let metre_m = self.evaluation.settings.metre_m();
        Some(Axes::new(heading, up, self.tilt * Vector3::x(), metre_m))
    }

    fn visit_report(&self, visit: usize) -> VisitReport {
        let (frames, visit) = (self.evaluation.plan.frames(), &self.visits[visit]);
        let middle = &frames[visit.middle];
        let scans = visit.scans.iter().map(|&ordinal| frames[ordinal].number).collect();
        VisitReport { scan: middle.number, stamp_ns: middle.stamp_ns, scans }
    }
}
