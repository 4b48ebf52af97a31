//! Detects the trails of moving objects: parts of the maps that rays of the log pass through.

use dmp_cast::{CastSettings, CountBuffers, CrossingCounter, Query};
use dmp_map::{FreeVoxels, MarkBuffers, Met, Store, Tally};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::error::EvaluateError;
use crate::evaluation::{Evaluation, FuseTotals};
use crate::frames::{PlannedFrame, Worker, each_frame};
use crate::peak;
use crate::poser::{Block, Poser, query_of};
use crate::progress::Stage;
use crate::run_map::RunMap;
use crate::run_state::poses_of;
use crate::work::TrailFacts;

/// Rays that must pass through a surfel for it to count as free space.
const MIN_THROUGH: u32 = 4;
/// A run votes if its share of contradicted surfels is at most this many times the smallest share.
const VOTE_RATIO: u128 = 2;

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

/// Per-thread buffers of [`Trails::mark`].
#[derive(Debug, Default)]
pub(crate) struct TrailBuffers {
    of_run: Vec<bool>,
    voxels: MarkBuffers,
}

impl Trails {
    /// Marks each return that lies on a trail: its own surfel must be contradicted in every voting run. The
    /// result is the same for all runs.
    pub(crate) fn mark(
        &self,
        block: &Block<'_>,
        marks: &mut Vec<bool>,
        buffers: &mut TrailBuffers,
    ) -> Result<(), EvaluateError> {
        marks.clear();
        marks.resize(block.len(), true);
        let TrailBuffers { of_run, voxels } = buffers;
        for (number, run) in self.of_runs.iter().enumerate().filter(|(_, run)| run.facts.votes) {
            let ends = block.rays(number).iter().map(Ray::endpoint_in_world);
            run.free.mark(ends, of_run, voxels).map_err(EvaluateError::map_of(&run.name))?;
            marks.iter_mut().zip(&*of_run).for_each(|(mark, free)| *mark &= free);
        }
        Ok(())
    }
}

/// Gives a vote to the runs whose maps the rays contradict least, up to the ratio.
///
/// Trails are contradicted in every run alike, doubled walls only where the trajectory doubles them. So a run
/// with far more contradictions is no evidence of motion.
fn give_votes(runs: &mut [TrailFacts]) {
    // a/b ≤ r·c/d as a·d ≤ r·c·b: integers give the same decision everywhere.
    let share_within = |(a, b): (u64, u64), (c, d): (u64, u64), ratio: u128| {
        u128::from(a) * u128::from(d.max(1)) <= ratio * u128::from(c) * u128::from(b.max(1))
    };
    let shares: Vec<(u64, u64)> = runs.iter().map(|run| (run.contradicted, run.surfels)).collect();
    for run in runs {
        let one = (run.contradicted, run.surfels);
        run.votes = shares.iter().all(|&other| share_within(one, other, VOTE_RATIO));
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
    fn frame(&mut self, _: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, evaluation, queries, buffers, .. } = self;
        let counts = poser.blocks(frame, scan, |block| {
            for (number, run) in evaluation.runs.iter().enumerate() {
                queries.clear();
                queries.extend(block.rays(number).iter().map(|ray| query_of(ray, Some(frame.segment))));
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
            let facts = TrailFacts { surfels, contradicted, votes: false };
            trails.of_runs.push(RunTrails { name: run.name().to_owned(), free, facts });
            trails.scratch_bytes += tally.scratch_bytes();
            runs.push(run);
            peak::look();
        }
        let mut facts: Vec<TrailFacts> = trails.of_runs.iter().map(|run| run.facts).collect();
        give_votes(&mut facts);
        trails.of_runs.iter_mut().zip(facts).for_each(|(run, facts)| run.facts = facts);
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
        self.progress.begin(Stage::Trails, self.plan.returns());
        let worker = |_| CountWorker {
            poser: Poser::new(poses_of(&self.runs), &self.plan.filter),
            evaluation: self,
            queries: Vec::new(),
            buffers: CountBuffers::default(),
            counts: ReturnCounts::default(),
        };
        let workers = (0..self.means.threads).map(worker).collect();
        let mut counts = ReturnCounts::default();
        for worker in each_frame(self.plan.reading(self.log, &self.means, self.progress), workers)? {
            counts.merge(&worker.counts);
        }
        Ok(counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn votes_of(contradicted: &[u64], surfels: &[u64]) -> Vec<bool> {
        let facts = |(&contradicted, &surfels)| TrailFacts { surfels, contradicted, votes: false };
        let mut runs: Vec<_> = contradicted.iter().zip(surfels).map(facts).collect();
        give_votes(&mut runs);
        runs.iter().map(|run| run.votes).collect()
    }

    #[test]
    fn far_more_contradictions_than_the_least_cost_the_vote() {
        assert_eq!(votes_of(&[5], &[100]), [true]);
        assert_eq!(votes_of(&[10, 20, 21], &[100, 100, 100]), [true, true, false]);
        // Only the share counts; zero is not far less than zero.
        assert_eq!(votes_of(&[10, 30], &[100, 400]), [true, true]);
        assert_eq!(votes_of(&[0, 0, 1], &[100, 0, 100]), [true, true, false]);
    }
}
