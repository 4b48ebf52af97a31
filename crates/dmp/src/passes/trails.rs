//! Detects the trails of moving objects: parts of the maps that rays of the log pass through.

use dmp_cast::{CastSettings, CountBuffers, CrossingCounter, Query};
use dmp_map::{FreeVoxels, MarkBuffers, Met, Store, Tally};
use dmp_runs::{EvaluateError, PlannedFrame, Poser, Stage, posed};
use dmp_sensor::{ReturnCounts, Scan};

use crate::means::peak;
use crate::passes::evaluation::{Evaluation, FuseTotals};
use crate::passes::frames::{Worker, each_frame_of};
use crate::passes::run_map::{RunMap, TrailFacts};

/// Rays that must pass through a surfel for it to count as free space.
const MIN_THROUGH: u32 = 4;
/// The trails in each run's map, by the rays of the log.
#[derive(Debug)]
pub(crate) struct Trails {
    pub(crate) of_runs: Vec<RunTrails>,
    pub(crate) counts: ReturnCounts,
    pub(crate) scratch_bytes: u64,
}

/// The trails in one run's map.
#[derive(Debug)]
pub(crate) struct RunTrails {
    name: String,
    free: FreeVoxels,
    pub(crate) facts: TrailFacts,
}

/// Per-thread buffers of [`Trails::take_out`].
#[derive(Debug, Default)]
pub(crate) struct TrailBuffers {
    marks: Vec<bool>,
    voxels: MarkBuffers,
}

impl Trails {
    /// Takes the points of a run's returns out that lie on its trails: the surfel there is contradicted. Returns their
    /// number.
    pub(crate) fn take_out(
        &self,
        run: usize,
        points: &mut Vec<[f64; 3]>,
        buffers: &mut TrailBuffers,
    ) -> Result<u64, EvaluateError> {
        let (TrailBuffers { marks, voxels }, run) = (buffers, &self.of_runs[run]);
        run.free.mark(points.iter().copied(), marks, voxels).map_err(EvaluateError::map_of(&run.name))?;
        let (before, mut marks) = (points.len(), marks.iter());
        points.retain(|_| marks.next() != Some(&true));
        Ok((before - points.len()) as u64)
    }
}

/// A run's map while rays are counted in it.
struct Counting {
    counter: CrossingCounter,
    tally: Tally,
}

struct CountWorker<'e> {
    poser: Poser<'e>,
    evaluation: &'e Evaluation<'e, Counting>,
    queries: Vec<Query>,
    buffers: CountBuffers,
    counts: ReturnCounts,
}

impl Worker for CountWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, evaluation, queries, buffers, .. } = self;
        let counts = poser.blocks((ordinal, frame), scan, |block| {
            for (number, run) in evaluation.runs.iter().enumerate() {
                let segment = run.path.segment(ordinal);
                queries.clear();
                queries.extend(block.posed(number).map(|(_, &ray)| Query { ray, segment }));
                let Counting { counter, tally } = &run.map;
                counter.count(queries, tally, buffers).map_err(EvaluateError::map_of(run.name()))?;
            }
            Ok::<(), EvaluateError>(())
        })?;
        self.counts.merge(&counts);
        self.evaluation.progress.advance(counts.total());
        Ok(())
    }
}

impl<'a> Evaluation<'a, RunMap> {
    /// Counts how every ray meets every run's map, in one pass over the log, and finds the contradicted
    /// surfels. The maps are removed afterwards.
    ///
    /// # Errors
    /// When the log or a map cannot be read, or the counts cannot be spilled.
    pub(crate) fn find_trails(mut self) -> Result<(Evaluation<'a, Option<Store>>, Trails), EvaluateError> {
        let bytes = self.work.budget().trails(self.runs.len());
        let reach = CastSettings::default().reach;
        let mut runs = Vec::new();
        for run in std::mem::take(&mut self.runs) {
            let tally = Tally::new(bytes.counts, self.work.path());
            let tally = tally.map_err(EvaluateError::map_of(run.name()))?;
            let (run, map) = run.with_map(());
            let counter = CrossingCounter::new(map.store, reach, bytes.tiles);
            runs.push(run.with_map(Counting { counter, tally }).0);
        }
        let mut counting = self.with_runs(runs);
        let counts = counting.count_crossings()?;
        peak::look();

        let mut trails = Trails { of_runs: Vec::new(), counts, scratch_bytes: 0 };
        let (mut runs, work) = (Vec::new(), std::sync::Arc::clone(&counting.work));
        for (run, number) in std::mem::take(&mut counting.runs).into_iter().zip(1..) {
            let (run, Counting { counter, tally }) = run.with_map(None);
            let path = work.file(&format!("free-{number}"));
            let find =
                || FreeVoxels::find(counter.store(), &tally, is_contradicted, &path, bytes.free_voxels);
            let free = work.install(find).map_err(EvaluateError::map_of(run.name()))?;
            let (surfels, contradicted) = (counter.store().surfels(), free.count());
            let facts = TrailFacts { surfels, contradicted, left_out: 0 };
            trails.of_runs.push(RunTrails { name: run.name().to_owned(), free, facts });
            trails.scratch_bytes += tally.scratch_bytes();
            runs.push(run);
            peak::look();
        }
        // The next maps are made anew and counted anew.
        counting.fused = FuseTotals::default();
        Ok((counting.with_runs(runs), trails))
    }
}

fn is_contradicted(met: Met) -> bool {
    met.through >= MIN_THROUGH && met.through > met.on
}

impl Evaluation<'_, Counting> {
    fn count_crossings(&self) -> Result<ReturnCounts, EvaluateError> {
        self.progress.begin(Stage::Trails, self.returns());
        let worker = |_| CountWorker {
            poser: Poser::new(posed(&self.runs), &self.plan.filter),
            evaluation: self,
            queries: Vec::new(),
            buffers: CountBuffers::default(),
            counts: ReturnCounts::default(),
        };
        let workers = (0..self.means.threads).map(worker).collect();
        let mut counts = ReturnCounts::default();
        let reading = self.plan.reading(self.log, &self.means, self.progress);
        for worker in each_frame_of(reading, |ordinal| self.uses(ordinal), workers)? {
            counts.merge(&worker.counts);
        }
        Ok(counts)
    }
}
