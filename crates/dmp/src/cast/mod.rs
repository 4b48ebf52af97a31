mod casters;
mod worker;

use std::collections::HashMap;

use dmp_log::ScanLog;
use dmp_map::{Lattice, TileId};
use dmp_reduce::{Comparison, Layout, Promise, Reducer, RunSums, Verdict};
use dmp_sensor::ReturnCounts;

use crate::checkpoint::{Casting, Fused, Round, Work};
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{FrameSet, Jobs, Pauses, Reading, each_frame_in_parts, each_frame_of, jobs_of};
use crate::fuse;
use crate::plan::Plan;
use crate::report::PlacesReport;
use crate::schedule::Schedule;
use crate::watch::{Stage, Watch};

pub(crate) use casters::{Casters, HORIZON};
use worker::CastWorker;
pub(crate) use worker::query_of;

/// Everything that comes of casting a log.
#[derive(Debug)]
pub(crate) struct Scored {
    pub(crate) reducer: Reducer,
    /// Scans that were scored.
    pub(crate) frames: u64,
    /// Where not scans but places were drawn: what is told of them.
    pub(crate) places: Option<PlacesReport>,
    /// For every unit that the reducer takes its number in the log: of a scan, or of the scan in a place's middle.
    pub(crate) scan_of_unit: Vec<usize>,
    /// How many frames were scored when it was looked whether that decides; where it was asked for, the last is all
    /// that were scored.
    pub(crate) looks: Vec<u64>,
    /// What the verdicts of the last look promise.
    pub(crate) promise: Promise,
    pub(crate) counts: ReturnCounts,
    /// Sums of the returns that lie in a tile, for each run and tile.
    pub(crate) tiles: HashMap<(usize, TileId), RunSums>,
    pub(crate) tile_loads: u64,
    /// Tiles that were ever within the sensor's reach, and how often they came into it.
    pub(crate) tiles_in_reach: u64,
    pub(crate) tile_visits: u64,
    /// The grid of the maps.
    pub(crate) lattice: Lattice,
}

/// One pass over the log in which rays are cast.
pub(crate) struct CastPass<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) plan: &'a Plan<'a>,
    pub(crate) runs: &'a [Run],
    pub(crate) casters: &'a Casters,
    pub(crate) config: &'a Config,
    pub(crate) work: &'a Work,
    pub(crate) watch: &'a dyn Watch,
}

/// What a look adds to the one before.
struct Look {
    /// Frames that are scored when it is done.
    size: u64,
    /// Returns that it adds, and how many of these are done already.
    returns: u64,
    returns_done: u64,
    jobs: Vec<Vec<usize>>,
}

pub(crate) type TileSums = HashMap<(usize, TileId), RunSums>;

impl CastPass<'_> {
    /// Casts every return of the sample into every run's map and reduces the residuals, in one pass over the log. What
    /// an earlier process kept is taken up, and `maps`, as they are kept, go before what this one keeps. Where a decision
    /// is asked for, samples grow until it is made.
    pub(crate) fn run(&self, maps: &(Round, Fused)) -> Result<Scored, EvaluateError> {
        let frames = self.plan.frames().len() as u64;
        let layout = Layout::new(frames, self.casters.bases.clone())
            .with_miss_price(self.config.miss_price)
            .on_scales(self.config.scales());
        let (round, fused) = maps;
        let (before, mut done) = self.before(&layout, *round)?;

        let state = |workers: &[CastWorker<'_>]| {
            let (mut reducer, mut counts, mut tiles) = before.clone();
            for worker in workers {
                reducer.merge(&worker.reducer)?;
                counts.merge(&worker.counts);
                for (tile, sums) in &worker.tiles {
                    tiles.entry(*tile).or_insert_with(RunSums::default).merge(sums);
                }
            }
            Ok::<_, EvaluateError>((reducer, counts, tiles))
        };
        let mut keep = |workers: &[CastWorker<'_>], done: &FrameSet| {
            if !self.work.holds::<Fused>(*round) {
                fuse::keep(self.work, *round, fused)?;
            }
            let (reducer, counts, tiles) = state(workers)?;
            let tiles = tiles.into_iter().map(|((run, tile), sums)| (run as u64, tile.x, tile.y, sums));
            let tiles = tiles.collect();
            self.work.save(*round, &Casting { done: done.clone(), reducer: reducer.seen(), counts, tiles })
        };
        let mut workers = (0..self.config.threads).map(|_| CastWorker::new(self, &layout)).collect();
        let reading = self.plan.reading(self.log, self.config, self.watch);
        let looks: Vec<Look> = self.looks(reading, &done);
        let schedule = self.casters.schedule.get_or_init(|| {
            let jobs = looks.iter().flat_map(|look| &look.jobs);
            Schedule::new(self.plan, &self.casters.of_runs, jobs, self.config.max_range_m())
        });
        let (needed, budget) = (schedule.bytes_in_reach(), self.casters.budget_bytes as u64);
        if needed > budget {
            self.watch.note(&format!(
                "the tiles in reach of the sensor take up to {} MiB, more than the {} MiB there are for them: \
                 some are loaded more than once a visit; more --memory would be faster",
                needed.div_ceil(1 << 20),
                budget >> 20
            ));
        }
        let every = self.work.every();
        let mut first = 0;
        self.casters.with_prefetch(self.config.threads, schedule, |ahead| {
            for look in looks {
                self.watch.begin(Stage::Cast, look.returns);
                self.watch.advance(look.returns_done);
                let jobs = Jobs { first, jobs: look.jobs };
                first += jobs.jobs.len();
                let pauses = Pauses { every, done: std::mem::take(&mut done), keep: &mut keep, ahead };
                (workers, done) = each_frame_in_parts(reading, jobs, std::mem::take(&mut workers), pauses)?;
                let reducer = state(&workers)?.0;
                // What an earlier process went on from was not decided.
                if reducer.frames_added() == look.size && self.is_decided(&reducer) {
                    break;
                }
            }
            Ok::<_, EvaluateError>(())
        })?;
        let (reducer, counts, tiles) = state(&workers)?;
        let promise = self.promise(&reducer);
        let scored = reducer.frames_added();
        let tile_loads = self.casters.of_runs[0].tile_loads();
        let lattice = self.casters.of_runs[0].map().lattice();
        let (tiles_in_reach, tile_visits) = schedule.tiles_and_visits(first);
        Ok(Scored {
            reducer,
            frames: scored,
            places: None,
            scan_of_unit: self.plan.frames().iter().map(|frame| frame.number).collect(),
            looks: self.plan.looks.sizes().iter().copied().filter(|&size| size <= scored).collect(),
            promise,
            counts,
            tiles,
            tile_loads,
            tiles_in_reach,
            tile_visits,
            lattice,
        })
    }

    /// Casts every return of some of the frames, once and with nothing kept; where they went, and their sums by tile.
    pub(crate) fn of_frames(&self, wanted: &FrameSet) -> Result<(ReturnCounts, TileSums), EvaluateError> {
        let layout = Layout::new(self.plan.frames().len() as u64, self.casters.bases.clone())
            .on_scales(self.config.scales());
        let workers = (0..self.config.threads).map(|_| CastWorker::new(self, &layout)).collect();
        let reading = self.plan.reading(self.log, self.config, self.watch);
        let workers = each_frame_of(reading, |ordinal| wanted.contains(ordinal), workers)?;
        let (mut counts, mut tiles) = (ReturnCounts::default(), HashMap::new());
        for worker in workers {
            counts.merge(&worker.counts);
            for (tile, sums) in worker.tiles {
                tiles.entry(tile).or_insert_with(RunSums::default).merge(&sums);
            }
        }
        Ok((counts, tiles))
    }

    /// What is to be read for each look that there may be.
    fn looks(&self, reading: Reading<'_>, done: &FrameSet) -> Vec<Look> {
        let frames = self.plan.frames();
        let look = |(number, &size): (usize, &u64)| {
            let added = self.plan.looks.added(number);
            let returns = |is_in: &dyn Fn(usize) -> bool| {
                (0..frames.len())
                    .filter(|&ordinal| is_in(ordinal))
                    .map(|ordinal| frames[ordinal].returns)
                    .sum()
            };
            Look {
                size,
                returns: returns(&|ordinal| added.contains(ordinal)),
                returns_done: returns(&|ordinal| added.contains(ordinal) && done.contains(ordinal)),
                jobs: jobs_of(reading, |ordinal| added.contains(ordinal) && !done.contains(ordinal)),
            }
        };
        self.plan.looks.sizes().iter().enumerate().map(look).collect()
    }

    /// What verdicts on what a reducer has seen promise: looks share the error that was asked for.
    fn promise(&self, reducer: &Reducer) -> Promise {
        let confidence = self.plan.looks.confidence(reducer.frames_added(), self.config.confidence);
        Promise { confidence, ..self.config.promise() }
    }

    /// Whether everything that was asked for is decided; never where nothing was.
    fn is_decided(&self, reducer: &Reducer) -> bool {
        let Some(decide) = &self.config.decide else { return false };
        let matters = |pair: &Comparison| {
            let names = [&self.runs[pair.a].name, &self.runs[pair.b].name];
            decide.pair.as_ref().is_none_or(|(a, b)| names == [a, b] || names == [b, a])
        };
        let comparisons = reducer.comparisons(self.promise(reducer));
        comparisons
            .pairs
            .iter()
            .filter(|pair| matters(pair))
            .all(|pair| !matches!(pair.verdict, Verdict::Undecided { .. }))
    }

    /// What is scored already, and which frames that is.
    fn before(
        &self,
        layout: &Layout,
        round: Round,
    ) -> Result<((Reducer, ReturnCounts, TileSums), FrameSet), EvaluateError> {
        let kept = if self.watch.wants_every_return() { None } else { self.work.load::<Casting>(round)? };
        let Some(kept) = kept else {
            let nothing = (Reducer::new(layout.clone()), ReturnCounts::default(), HashMap::new());
            return Ok((nothing, FrameSet::default()));
        };
        let tiles = kept.tiles.into_iter().map(|(run, x, y, sums)| ((run as usize, TileId { x, y }), sums));
        let reducer = Reducer::resume(layout.clone(), kept.reducer)?;
        Ok(((reducer, kept.counts, tiles.collect()), kept.done))
    }
}
