use std::sync::{Arc, OnceLock};

use crossbeam_channel::bounded;
use dmp_cast::{CastSettings, Caster, TileCache};
use dmp_reduce::Basis;

use crate::config::Config;
use crate::fuse::RunMap;
use crate::memory::Budget;
use crate::schedule::{RunTile, Schedule};

/// Share of the memory that the tiles of all maps may take while rays are cast.
const CAST_SHARE: f64 = 0.75;
/// Most tiles that wait to be loaded before they are needed.
const PREFETCHED_TILES: usize = 256;
/// Most jobs for each thread that are handed out and not done: those that wait and the one at work.
const JOBS_AT_WORK: usize = 3;
/// Predictions are looked for up to this many times the largest range used: further, a sensor would
/// see nothing.
pub(crate) const HORIZON: f64 = 2.0;

/// A caster into every run's map, and what can be told of its surfels.
pub(crate) struct Casters {
    pub(crate) of_runs: Vec<Caster>,
    pub(crate) bases: Vec<Basis>,
    /// When tiles are needed, once that is known.
    pub(super) schedule: Arc<OnceLock<Schedule>>,
    pub(super) budget_bytes: usize,
}

impl Casters {
    /// Casters that share the memory there is for tiles.
    pub(crate) fn new(maps: Vec<RunMap>, config: &Config, budget: &Budget) -> Self {
        let settings = CastSettings {
            horizon_m: HORIZON * config.max_range_m(),
            window_m: config.scales().lengths().near_m[0],
            return_m: config.scales().lengths().blocked_m,
            ..CastSettings::default()
        };
        let schedule: Arc<OnceLock<Schedule>> = Arc::default();
        let foreseen = Arc::clone(&schedule);
        let next_use = move |tile: &RunTile| foreseen.get().map_or(0, |schedule| schedule.next_use(tile));
        let budget_bytes = budget.share(CAST_SHARE);
        let tiles = Arc::new(TileCache::foreseeing(budget_bytes, Box::new(next_use)));
        let caster = |(number, map): (usize, RunMap)| {
            let basis = if map.fused { Basis::CrossValidated } else { Basis::Near };
            (Caster::sharing(map.store, settings, &tiles, number), basis)
        };
        let (of_runs, bases) = maps.into_iter().enumerate().map(caster).unzip();
        Self { of_runs, bases, schedule, budget_bytes }
    }

    /// Of the runs whose maps were not fused, the casters.
    pub(crate) fn given(&self) -> Vec<Option<&Caster>> {
        let given = |(caster, basis): (_, &Basis)| (*basis == Basis::Near).then_some(caster);
        self.of_runs.iter().zip(&self.bases).map(given).collect()
    }

    /// Has the tiles loaded that come into reach, beside what reads and casts; `pass` is given what to tell of jobs.
    pub(super) fn with_prefetch<R>(
        &self,
        threads: usize,
        schedule: &Schedule,
        pass: impl FnOnce(&dyn Fn(usize)) -> R,
    ) -> R {
        // Tiles that do not fit beside each other would only drive each other out.
        let fits = schedule.bytes_in_reach() <= self.budget_bytes as u64;
        let (sender, receiver) = bounded::<RunTile>(if fits { PREFETCHED_TILES } else { 0 });
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for (run, tile) in receiver {
                    // A damaged tile is told of by the ray that needs it.
                    let _ = self.of_runs[run].prefetch(tile);
                }
            });
            let at_work = JOBS_AT_WORK * threads;
            let ahead = move |job: usize| {
                schedule.move_to(job.saturating_sub(at_work));
                for tile in schedule.begin(job) {
                    // What finds no place in the queue is loaded when it is needed.
                    let _ = if fits { sender.try_send(*tile) } else { Ok(()) };
                }
            };
            let result = pass(&ahead);
            drop(ahead);
            result
        })
    }
}
