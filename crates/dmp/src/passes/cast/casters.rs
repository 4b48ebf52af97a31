//! A caster into every run's map, and the tiles they share.

use std::sync::{Arc, OnceLock};

use crossbeam_channel::bounded;
use dmp_cast::{CastSettings, Caster, TileCache};
use dmp_map::PlacesLeftOut;
use dmp_reduce::Basis;
use dmp_runs::{PosedRun, Settings};

use crate::passes::evaluation::Evaluation;
use crate::passes::run_map::{MapFacts, RunMap};
use crate::passes::schedule::{RunTile, Schedule};

/// Most tiles queued to be loaded before they are needed.
const PREFETCHED_TILES: usize = 256;
/// Most unfinished jobs for each thread: those that wait and the one at work.
const JOBS_AT_WORK: usize = 3;
/// Predictions are searched up to this many times the largest range used: beyond, a sensor would see nothing.
const HORIZON: f64 = 2.0;

/// A run's map, ready to be cast into.
pub(crate) struct RunCaster {
    pub(crate) caster: Caster,
    pub(super) left_out: PlacesLeftOut,
    pub(crate) facts: MapFacts,
}

impl RunCaster {
    /// The report's facts about its surfels.
    pub(crate) fn basis(&self) -> Basis {
        if self.facts.fused { Basis::CrossValidated } else { Basis::Near }
    }
}

/// The report's facts about the surfels of some runs.
pub(super) fn bases(runs: &[PosedRun<'_, RunCaster>]) -> Vec<Basis> {
    runs.iter().map(|run| run.map.basis()).collect()
}

/// How far predictions are searched, metres.
pub(crate) fn horizon_m(settings: &Settings) -> f64 {
    HORIZON * settings.max_range_m
}

/// The tiles of all maps that are in memory.
pub(crate) struct SharedTiles {
    /// When they are needed, once known.
    pub(super) schedule: Arc<OnceLock<Schedule>>,
    pub(super) budget_bytes: usize,
}

impl<'a> Evaluation<'a, RunMap> {
    /// Makes the maps ready for casting: the casters share the memory for tiles.
    pub(crate) fn casters(mut self) -> (Evaluation<'a, RunCaster>, SharedTiles) {
        let lengths = self.settings.scales.lengths();
        let settings = CastSettings {
            horizon_m: horizon_m(&self.settings),
            window_m: lengths.near_m[0],
            return_m: lengths.blocked_m,
            ..CastSettings::default()
        };
        let schedule: Arc<OnceLock<Schedule>> = Arc::default();
        let foreseen = Arc::clone(&schedule);
        let count = self.runs.len();
        // A thread casts into one run after the other and starts over. Of the tiles in reach, those of the
        // run just finished are therefore used last.
        let next_use = move |tile: &RunTile, now: &RunTile| {
            let jobs = foreseen.get().map_or(0, |schedule| schedule.next_use(tile));
            let runs = (tile.0 + count - now.0) % count;
            jobs.saturating_mul(count as u64).saturating_add(runs as u64)
        };
        let budget_bytes = self.work.budget().cast_bytes();
        let left_out_bytes = self.work.budget().left_out_bytes() / count.max(1);
        let tiles = Arc::new(TileCache::foreseeing(budget_bytes, Box::new(next_use)));
        let caster = |(number, run): (usize, PosedRun<'a, RunMap>)| {
            let (run, RunMap { store, facts }) = run.with_map(());
            let left_out = PlacesLeftOut::of(&store, left_out_bytes);
            let caster = Caster::sharing(store, settings, &tiles, number);
            run.with_map(RunCaster { caster, left_out, facts }).0
        };
        let runs = std::mem::take(&mut self.runs).into_iter().enumerate().map(caster).collect();
        (self.with_runs(runs), SharedTiles { schedule, budget_bytes })
    }
}

impl SharedTiles {
    /// Loads tiles that come into reach in parallel with reading and casting; `pass` receives the callback
    /// for job events.
    pub(super) fn with_prefetch<R>(
        &self,
        runs: &[PosedRun<'_, RunCaster>],
        threads: usize,
        schedule: &Schedule,
        pass: impl FnOnce(&dyn Fn(usize)) -> R,
    ) -> R {
        // Without room for all tiles in reach, prefetched ones would evict each other.
        let fits = schedule.bytes_in_reach() <= self.budget_bytes as u64;
        let (sender, receiver) = bounded::<RunTile>(if fits { PREFETCHED_TILES } else { 0 });
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for (run, tile) in receiver {
                    // The ray that needs a damaged tile reports it.
                    let _ = runs[run].map.caster.prefetch(tile);
                }
            });
            let at_work = JOBS_AT_WORK * threads;
            let ahead = move |job: usize| {
                schedule.move_to(job.saturating_sub(at_work));
                for tile in schedule.begin(job) {
                    // A full queue only means that the tile is loaded when needed.
                    let _ = if fits { sender.try_send(*tile) } else { Ok(()) };
                }
            };
            let result = pass(&ahead);
            drop(ahead);
            result
        })
    }
}
