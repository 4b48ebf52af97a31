//! Detects the trails of moving objects: surfels that rays of the log pass through.

use std::path::Path;

use dmp_cast::{CountBuffers, CrossingCounter, Query};
use dmp_map::{MapError, Met, Store, Tally, thin_map};
use dmp_runs::{EvaluateError, PlannedFrame, PosedRun, Poser, Stage, posed};
use dmp_sensor::Scan;

use crate::means::peak;
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Worker, each_frame_of};
use crate::passes::fuse::{Fused, Life};
use crate::passes::run_map::{MapFacts, RunMap, TrailFacts};
use crate::passes::survey::spread;

/// Rays that must pass through a surfel for it to count as free space.
const MIN_THROUGH: u32 = 4;

/// The rays of one scan in so many are followed, and of no fewer scans than these.
const SCANS_PER_SAMPLED: usize = 8;
const FEWEST_SAMPLED: usize = 100;

/// A run's map while rays are counted in it.
struct Counting {
    counter: CrossingCounter,
    tally: Tally,
    facts: MapFacts,
}

struct CountWorker<'e> {
    poser: Poser<'e>,
    evaluation: &'e Evaluation<'e, Counting>,
    queries: Vec<Query>,
    buffers: CountBuffers,
}

impl Worker for CountWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, evaluation, queries, buffers, .. } = self;
        let counts = poser.blocks((ordinal, frame), scan, |block| {
            for (number, run) in evaluation.runs.iter().enumerate() {
                queries.clear();
                queries.extend(block.posed(number).map(|(_, &ray)| Query { ray, segment: None }));
                let Counting { counter, tally, .. } = &run.map;
                counter.count(queries, tally, buffers).map_err(EvaluateError::map_of(run.name()))?;
            }
            Ok::<(), EvaluateError>(())
        })?;
        self.evaluation.progress.advance(counts.total());
        Ok(())
    }
}

impl<'a> Evaluation<'a, RunMap> {
    /// The maps without trails, if requested: a sample of the log's rays is followed through every map.
    ///
    /// # Errors
    /// When the log or a map cannot be read, or a map not be written.
    pub(crate) fn keep_out_trails(mut self) -> Result<Self, EvaluateError> {
        if !self.settings.free_space || self.runs.iter().any(|run| run.map.facts.trails.is_some()) {
            return Ok(self);
        }
        self.keep_if_due()?;
        let bytes = self.work.budget().trails(self.runs.len());
        let counting = |run: PosedRun<'a, RunMap>| {
            let tally =
                Tally::new(bytes.counts, self.work.path()).map_err(EvaluateError::map_of(run.name()))?;
            let (run, RunMap { store, facts }) = run.with_map(());
            let counter = CrossingCounter::new(store, bytes.tiles);
            Ok(run.with_map(Counting { counter, tally, facts }).0)
        };
        let runs = std::mem::take(&mut self.runs);
        let runs = runs.into_iter().map(counting).collect::<Result<_, EvaluateError>>()?;
        let mut counting = self.with_runs(runs);
        counting.count_crossings()?;
        peak::look();
        let mut runs = Vec::new();
        for run in std::mem::take(&mut counting.runs) {
            let (run, map) = run.with_map(());
            let (path, life) = counting.map_file(&run);
            let (map, scratch_bytes) = map.thinned(&path, life);
            let map = map.map_err(EvaluateError::map_of(run.name()))?;
            counting.fused.scratch_bytes += scratch_bytes;
            runs.push(run.with_map(map).0);
            peak::look();
        }
        let thinned = counting.with_runs(runs);
        // The maps with trails that were kept are replaced at once: nothing that was done is lost.
        if thinned.work.holds::<Fused>() {
            thinned.kept_maps().save(&thinned.work)?;
        }
        Ok(thinned)
    }
}

impl Counting {
    /// The map without contradicted surfels, and the bytes of counts that were spilled.
    fn thinned(self, path: &Path, life: Life) -> (Result<RunMap, MapError>, u64) {
        let Self { counter, tally, facts } = self;
        let map = counter.store();
        let into = (path, map.origin(), life.durability());
        let thinned = thin_map(map, &tally, is_contradicted, into).and_then(|_| life.open(path));
        let found = |store: Store| {
            let surfels = map.surfels();
            let trails = Some(TrailFacts { surfels, contradicted: surfels - store.surfels() });
            RunMap { store, facts: MapFacts { trails, ..facts } }
        };
        (thinned.map(found), tally.scratch_bytes())
    }
}

/// The scans whose rays are followed, evenly spread over those of the log.
fn sample_of(scans: usize) -> Vec<usize> {
    spread(scans, FEWEST_SAMPLED.max(scans / SCANS_PER_SAMPLED))
}

fn is_contradicted(met: Met) -> bool {
    met.through >= MIN_THROUGH && met.through > met.on
}

impl Evaluation<'_, Counting> {
    fn count_crossings(&self) -> Result<(), EvaluateError> {
        let frames = self.plan.frames();
        let sample = sample_of(frames.len());
        let is_sampled = |ordinal: usize| self.uses(ordinal) && sample.binary_search(&ordinal).is_ok();
        let returns = sample.iter().filter(|&&k| self.uses(k)).map(|&k| frames[k].returns).sum();
        self.progress.begin(Stage::Trails, returns);
        let worker = |_| CountWorker {
            poser: Poser::new(posed(&self.runs), &self.plan.filter),
            evaluation: self,
            queries: Vec::new(),
            buffers: CountBuffers::default(),
        };
        let workers = (0..self.means.threads).map(worker).collect();
        let reading = self.plan.reading(self.log, &self.means, self.progress);
        each_frame_of(reading, is_sampled, workers).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eighth_of_the_scans_is_followed_and_of_short_logs_a_hundred() {
        for (scans, followed) in [(0, 0), (22, 22), (101, 100), (800, 100), (808, 101), (80_000, 10_000)] {
            let sample = sample_of(scans);
            assert_eq!(sample.len(), followed, "{scans}");
            assert!(
                sample.windows(2).all(|pair| pair[1] > pair[0]) && sample.iter().all(|&scan| scan < scans)
            );
        }
    }
}
