//! Measures a run's drift at revisits in metres, from its own scans.
//!
//! Where two visits see the same surfaces, the motion that aligns them is the drift between the visits. Visits and pairs are
//! each run's own; two runs are compared on the pairs that both have.

mod patches;
mod visits;

use dmp_log::ScanLog;
use dmp_reduce::FrameSet;
use dmp_revisit::drift::{
    Axes, Displacement, DriftReport, PairFacts, RunDrift, RunFacts, Seen, VisitPairReport, VisitReport,
    at_least_m, blocks, compared, covariance_in, of_run, register, searched_m, upper_triangle,
};
pub use dmp_revisit::visits::VisitPair;
use dmp_revisit::visits::Visits;
use dmp_runs::{Config, EvaluateError, PosedRun, Run, Stage, Watch, own_frame, pool};
use dmp_sensor::seven;
use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::drawn::spread;
use crate::passes::evaluation::{Evaluation, Task};
use patches::Source;
use visits::Visit;

/// Approximate memory for the surfaces of a visit in one run, bytes.
const PYRAMID_BYTES: usize = 600 << 10;

/// Measures the drift of `runs` at revisits, each by itself, on as many pairs of visits as [`Config::drift`] allows, evenly
/// spread.
///
/// Reads only the scans of these visits. The report is bit-identical for every number of threads and memory
/// budget. A run without a revisit has no pairs.
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
    let mut task = Task::open(log, runs, &config, watch.into())?;
    // There is no map whose voxels need choosing.
    task.settings.voxel_m.get_or_insert(task.settings.scales.lengths().voxels_m[0]);
    task.plan(runs)?.drift()
}

impl<M> Evaluation<'_, M> {
    /// Whether drift is measured beside a score.
    pub(crate) fn measures_drift(&self) -> bool {
        self.settings.drift.most(usize::MAX) > 0
    }

    /// Measures the drift of every run.
    pub(crate) fn drift(&self) -> Result<DriftReport, EvaluateError> {
        let measured = (0..self.runs.len()).map(|run| {
            let revisits = Revisits::new(self, run);
            Ok((revisits.measure(&revisits.pairs)?, revisits))
        });
        let measured: Vec<_> = measured.collect::<Result<_, EvaluateError>>()?;
        Ok(self.drift_report(measured))
    }

    /// The report, given what was measured on the pairs of each run.
    pub(crate) fn drift_report(&self, measured: Vec<(Vec<VisitPairReport>, Revisits<'_>)>) -> DriftReport {
        let confidence = self.settings.confidence;
        let (mut runs, mut blocks): (Vec<RunDrift>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
        let mut starts: Vec<Vec<usize>> = Vec::new();
        let frames = self.plan.frames();
        for (visits, revisits) in measured {
            let (run, of_pairs) = revisits.summed_up(visits);
            let begins = revisits.run.path.segments.starts.iter();
            starts.push(begins.map(|&ordinal| frames[ordinal].number).collect());
            runs.push(run);
            blocks.push(of_pairs);
        }
        let both = (0..runs.len()).flat_map(|a| (a + 1..runs.len()).map(move |b| (a, b)));
        let pairs = (runs.len() * runs.len().saturating_sub(1) / 2) as u32;
        let confidences = [confidence, confidence.of_each_look(pairs)];
        let compared =
            |(a, b): (usize, usize)| compared([&runs[a], &runs[b]], &blocks[a], &starts[a], confidences);
        let comparisons = both.map(compared).collect();
        DriftReport {
            schema: DriftReport::SCHEMA.to_owned(),
            dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
            voxel_m: patches::voxel_m(&self.settings),
            confidence: confidence.level(),
            runs,
            comparisons,
        }
    }
}

/// The visits of a run, their poses, and the pairs that are measured.
pub struct Revisits<'e> {
    source: Source<'e>,
    run: PosedRun<'e, ()>,
    visits: Vec<Visit>,
    places: Visits,
    /// From the sensor's frame to that of a place: tilted, so that level ground and walls along the path
    /// cross their voxels.
    tilt: UnitQuaternion<f64>,
    pairs_found: usize,
    pairs: Vec<VisitPair>,
}

impl std::fmt::Debug for Revisits<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Revisits").field("pairs", &self.pairs).finish_non_exhaustive()
    }
}

impl<'e> Revisits<'e> {
    /// Finds the pairs of a run and selects as many as the settings allow.
    pub(crate) fn new<M>(evaluation: &'e Evaluation<'_, M>, run: usize) -> Self {
        let Evaluation { plan, settings, means, log, progress, .. } = evaluation;
        let (frames, run) = (plan.frames(), evaluation.runs[run].like(()));
        let is_camera = log.summary().camera.is_some();
        let returns = |ordinal: usize| frames[ordinal].returns;
        let visit = |scans: &Vec<usize>| Visit::of(scans, &run.path.along_m, returns, is_camera);
        let visits = run.path.visits().iter().map(visit).collect();
        let places = run.path.places_of_visits(|ordinal| run.poses.of_frame(&frames[ordinal]));
        let found = places.pairs(settings.drift_near_m(), is_camera);
        let most = settings.drift.most(run.path.segments.starts.len());
        let pairs = spread(found.len(), most).into_iter().map(|k| found[k]).collect();
        let (tilt, pairs_found) = (own_frame::tilt(), found.len());
        let source = Source { log: *log, settings, means, plan, progress: *progress };
        Self { source, run, visits, places, tilt, pairs_found, pairs }
    }

    /// As many pairs as fit a part of the memory.
    fn pairs_at_a_time(&self) -> usize {
        (self.source.means.memory_bytes / 4 / (2 * PYRAMID_BYTES)).max(1)
    }

    /// The pairs that are measured.
    pub fn pairs(&self) -> &[VisitPair] {
        &self.pairs
    }

    /// The scans of some pairs.
    pub fn scans(&self, pairs: &[VisitPair]) -> FrameSet {
        let visits = pairs.iter().flat_map(|pair| [pair.first, pair.second]);
        visits.flat_map(|visit| self.visits[visit].scans.iter().copied()).collect()
    }

    /// Measures some pairs.
    ///
    /// # Errors
    /// When a scan cannot be read.
    pub fn measure(&self, pairs: &[VisitPair]) -> Result<Vec<VisitPairReport>, EvaluateError> {
        let (progress, means) = (self.source.progress, self.source.means);
        progress.begin(Stage::Drift, pairs.len() as u64);
        let pool = pool(means.threads)?;
        let mut reports = Vec::with_capacity(pairs.len());
        for batch in pairs.chunks(self.pairs_at_a_time()) {
            let numbers = batch.iter().flat_map(|pair| [pair.first, pair.second]);
            let visits: patches::Visits<'_> = numbers
                .map(|number| (number, (&self.visits[number], self.world_from_place(number).inverse())))
                .collect();
            let pyramids = patches::pyramids(self.source, &self.run, &visits)?;
            let report = |pair: &VisitPair| {
                let report = self.report(pair, &pyramids);
                progress.advance(1);
                report
            };
            reports.extend(pool.install(|| batch.par_iter().map(report).collect::<Vec<_>>()));
        }
        Ok(reports)
    }

    /// The run's part of the report, given the measurement of each pair; and the blocks of the pairs.
    fn summed_up(&self, visits: Vec<VisitPairReport>) -> (RunDrift, Vec<usize>) {
        let settings = self.source.settings;
        let segments: Vec<(usize, usize)> = self.pairs.iter().map(|pair| (pair.first, pair.second)).collect();
        let blocks = blocks(&segments);
        let time_s = |pair: &VisitPairReport| {
            let ns = pair.second.stamp_ns?.saturating_sub(pair.first.stamp_ns?);
            Some(ns as f64 / 1e9)
        };
        let fact = |(pair, &block): (&VisitPairReport, &usize)| PairFacts {
            block,
            way_m: pair.way_m,
            time_s: time_s(pair),
        };
        let pairs: Vec<PairFacts> = visits.iter().zip(&blocks).map(fact).collect();
        let facts = RunFacts {
            name: self.run.name(),
            travel_m: self.run.path.segments.travel_m,
            segments: self.visits.len(),
            pairs_found: self.pairs_found,
            searched_m: self.searched_m(),
            pairs: &pairs,
        };
        (of_run(&facts, visits, (settings.metre_m(), settings.confidence)), blocks)
    }

    fn searched_m(&self) -> f64 {
        let settings = self.source.settings;
        searched_m(settings.drift_reach.steps()) * settings.metre_m()
    }

    fn world_from_place(&self, visit: usize) -> Isometry3<f64> {
        self.places.poses[visit] * self.tilt.inverse()
    }

    /// Measures a pair of visits.
    fn report(&self, pair: &VisitPair, pyramids: &patches::Pyramids) -> VisitPairReport {
        let settings = self.source.settings;
        let (metre_m, along_m) = (settings.metre_m(), &self.run.path.along_m);
        let world_from_first = self.world_from_place(pair.first);
        let own_from_place = self.run.own_from_world * world_from_first;
        let mut report = VisitPairReport {
            first: self.visit_report(pair.first),
            second: self.visit_report(pair.second),
            apart_m: pair.apart_m,
            way_m: along_m[self.visits[pair.second].middle] - along_m[self.visits[pair.first].middle],
            at_m: own_from_place.translation.vector.into(),
            off: None,
            at_least_m: None,
            why_not: None,
            first_from_second: None,
            covariance: None,
        };
        let (Some(first), Some(second)) = (pyramids.get(&pair.first), pyramids.get(&pair.second)) else {
            return report;
        };
        let claimed = world_from_first.inverse() * self.world_from_place(pair.second);
        match register(&Seen { first, second, claimed }, settings.drift_reach.steps(), metre_m) {
            Ok(measured) => {
                let axes = self.axes(pair.first);
                let off = Displacement::new(&claimed, &measured, &axes, &own_from_place, metre_m);
                report.off = Some(off);
                // The sensor's pose, without the tilt.
                let sensor_from_place = Isometry3::from_parts(Translation3::identity(), self.tilt.inverse());
                let motion = sensor_from_place * measured.target_from_source * sensor_from_place.inverse();
                report.first_from_second = Some(seven(&motion));
                let covariance = covariance_in(&sensor_from_place, &measured.covariance);
                report.covariance = Some(upper_triangle(&covariance));
            }
            Err(why) => {
                report.at_least_m = at_least_m(&why, self.searched_m());
                report.why_not = Some(why.to_string());
            }
        }
        report
    }

    /// Along, left and up in the frame of a place.
    fn axes(&self, visit: usize) -> Axes {
        let place_from_world = self.world_from_place(visit).rotation.inverse();
        let up = place_from_world * (self.tilt * Vector3::z());
        let heading = place_from_world * self.places.heading(visit);
        Axes::new(heading, up, self.tilt * Vector3::x(), self.source.settings.metre_m())
    }

    fn visit_report(&self, visit: usize) -> VisitReport {
        let (frames, visit) = (self.source.plan.frames(), &self.visits[visit]);
        let middle = &frames[visit.middle];
        let scans = visit.scans.iter().map(|&ordinal| frames[ordinal].number).collect();
        VisitReport { scan: middle.number, stamp_ns: middle.stamp_ns, scans }
    }
}
