use dmp_cast::{CastSettings, CountBuffers, CrossingCounter, Query};
use dmp_log::ScanLog;
use dmp_map::{FreeVoxels, MarkBuffers, Met, Tally};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::cast::query_of;
use crate::checkpoint::Work;
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Worker, each_frame};
use crate::fuse::{self, Maps};
use crate::memory;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::watch::{Stage, Watch};

/// Shares of the memory for the tiles that rays are counted in, and for the counts.
const TILE_SHARE: f64 = 0.3;
const COUNT_SHARE: f64 = 0.2;
/// Share of the memory for free voxels while maps are fused without them.
const VOXEL_SHARE: f64 = 0.1;
/// Rays that must have gone through a surfel before it is taken for free space.
const MIN_THROUGH: u32 = 4;
/// A run has a vote where its share of contradicted surfels is at most this many times the smallest.
const VOTE_RATIO: u128 = 2;

/// What the rays of a log say of the space that each run's map fills.
#[derive(Debug)]
pub(crate) struct Trails {
    of_runs: Vec<FreeVoxels>,
    summary: TrailSummary,
    counts: ReturnCounts,
    scratch_bytes: u64,
}

/// What was found, for the report.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct TrailSummary {
    /// Surfels of each run's map with all returns in it.
    pub(crate) surfels: Vec<u64>,
    /// How many of them the run's rays contradict.
    pub(crate) contradicted: Vec<u64>,
    /// Which runs say what a trail is.
    pub(crate) votes: Vec<bool>,
}

/// Per-thread buffers of [`Trails::mark`].
#[derive(Debug, Default)]
pub(crate) struct TrailBuffers {
    of_run: Vec<bool>,
    voxels: MarkBuffers,
}

impl Trails {
    /// Says for each return, given by its rays in every run, whether it lies on a trail: whether its own
    /// surfel is contradicted in every run that has a vote. The answer is one for all runs.
    pub(crate) fn mark(
        &self,
        runs: &[Run],
        rays: &[Vec<Ray>],
        marks: &mut Vec<bool>,
        buffers: &mut TrailBuffers,
    ) -> Result<(), EvaluateError> {
        marks.clear();
        marks.resize(rays.first().map_or(0, Vec::len), true);
        let TrailBuffers { of_run, voxels } = buffers;
        for run in (0..runs.len()).filter(|&run| self.summary.votes[run]) {
            let ends = rays[run].iter().map(Ray::endpoint_in_world);
            self.of_runs[run].mark(ends, of_run, voxels).map_err(EvaluateError::map_of(&runs[run].name))?;
            marks.iter_mut().zip(&*of_run).for_each(|(mark, free)| *mark &= free);
        }
        Ok(())
    }
}

/// The runs that say what a trail is: those whose maps the rays contradict least, up to the ratio.
///
/// Trails are contradicted in every run alike, doubled walls only where the trajectory doubles them. So a run
/// with far more contradictions is no witness for what moved.
fn votes_of(contradicted: &[u64], surfels: &[u64]) -> Vec<bool> {
    // a/b ≤ r·c/d as a·d ≤ r·c·b, which integers decide the same everywhere.
    let share_within = |(a, b): (u64, u64), (c, d): (u64, u64), ratio: u128| {
        u128::from(a) * u128::from(d.max(1)) <= ratio * u128::from(c) * u128::from(b.max(1))
    };
    let shares: Vec<(u64, u64)> = contradicted.iter().copied().zip(surfels.iter().copied()).collect();
    let vote = |&one: &(u64, u64)| shares.iter().all(|&other| share_within(one, other, VOTE_RATIO));
    shares.iter().map(vote).collect()
}

struct CountWorker<'a> {
    poser: Poser<'a>,
    runs: &'a [Run],
    counters: &'a [CrossingCounter],
    tallies: &'a [Tally],
    watch: &'a dyn Watch,
    queries: Vec<Query>,
    buffers: CountBuffers,
    counts: ReturnCounts,
}

impl Worker for CountWorker<'_> {
    fn frame(&mut self, _: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, runs, counters, tallies, queries, buffers, .. } = self;
        let counts = poser.blocks(frame, scan, |rays| {
            for (((counter, tally), rays), run) in counters.iter().zip(*tallies).zip(rays).zip(*runs) {
                queries.clear();
                queries.extend(rays.iter().map(|ray| query_of(ray, Some(frame.segment))));
                counter.count(queries, tally, buffers).map_err(EvaluateError::map_of(&run.name))?;
            }
            Ok::<(), EvaluateError>(())
        })?;
        self.counts.merge(&counts);
        self.watch.advance(counts.total());
        Ok(())
    }
}

/// The maps without the returns that lie on trails, fused once more: two passes over the log.
pub(crate) fn keep_out(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    maps: Maps,
    config: &Config,
    work: &Work,
    watch: &dyn Watch,
) -> Result<Maps, EvaluateError> {
    let (first, scratch_bytes) = (maps.counts, maps.scratch_bytes);
    let trails = find(log, plan, runs, maps, config, work, watch)?;
    let none = runs.iter().map(|_| None).collect();
    let mut maps = fuse::maps_of(log, plan, runs, none, Some(&trails), config, work, watch)?;
    for counts in [Some(trails.counts), maps.counts] {
        if let (Some(first), Some(second)) = (first, counts.filter(|counts| Some(*counts) != first)) {
            return Err(EvaluateError::LogChanged { first: first.used(), second: second.used() });
        }
    }
    maps.scratch_bytes += scratch_bytes + trails.scratch_bytes;
    maps.trails = Some(trails.summary);
    Ok(maps)
}

/// Counts how every ray meets every run's map, in one pass over the log, and finds what the rays contradict.
fn find(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    maps: Maps,
    config: &Config,
    work: &Work,
    watch: &dyn Watch,
) -> Result<Trails, EvaluateError> {
    let share = |share: f64| work.budget().share(share) / runs.len();
    let reach = CastSettings::default().reach;
    let counters: Vec<CrossingCounter> = maps
        .of_runs
        .into_iter()
        .map(|map| CrossingCounter::new(map.store, reach, share(TILE_SHARE)))
        .collect();
    let tallies = runs
        .iter()
        .map(|run| Tally::new(share(COUNT_SHARE), work.path()).map_err(EvaluateError::map_of(&run.name)))
        .collect::<Result<Vec<_>, _>>()?;
    watch.begin(Stage::Trails, plan.returns());
    let worker = |_| CountWorker {
        poser: Poser::new(&plan.poses, &plan.filter),
        runs,
        counters: &counters,
        tallies: &tallies,
        watch,
        queries: Vec::new(),
        buffers: CountBuffers::default(),
        counts: ReturnCounts::default(),
    };
    let workers = (0..config.threads).map(worker).collect();
    let mut counts = ReturnCounts::default();
    for worker in each_frame(plan.reading(log, config, watch), workers)? {
        counts.merge(&worker.counts);
    }
    memory::look();

    let is_contradicted = |met: Met| met.through >= MIN_THROUGH && met.through > met.on;
    let (mut of_runs, mut surfels, mut scratch_bytes) = (Vec::new(), Vec::new(), 0);
    for (((counter, tally), run), number) in counters.into_iter().zip(tallies).zip(runs).zip(1..) {
        let path = work.file(&format!("free-{number}"));
        let free = FreeVoxels::find(counter.store(), &tally, is_contradicted, &path, share(VOXEL_SHARE));
        of_runs.push(free.map_err(EvaluateError::map_of(&run.name))?);
        surfels.push(counter.store().surfels());
        scratch_bytes += tally.scratch_bytes();
        memory::look();
    }
    let contradicted: Vec<u64> = of_runs.iter().map(FreeVoxels::count).collect();
    let votes = votes_of(&contradicted, &surfels);
    let summary = TrailSummary { surfels, contradicted, votes };
    Ok(Trails { of_runs, summary, counts, scratch_bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_more_contradictions_than_the_least_cost_the_vote() {
        assert_eq!(votes_of(&[5], &[100]), [true]);
        assert_eq!(votes_of(&[10, 20, 21], &[100, 100, 100]), [true, true, false]);
        // It is the share that counts, and nothing is not far less than nothing.
        assert_eq!(votes_of(&[10, 30], &[100, 400]), [true, true]);
        assert_eq!(votes_of(&[0, 0, 1], &[100, 0, 100]), [true, true, false]);
    }
}
