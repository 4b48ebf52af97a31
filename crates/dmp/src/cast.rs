use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use crossbeam_channel::bounded;
use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Query, TileCache};
use dmp_log::ScanLog;
use dmp_map::{Lattice, TileId, TileTable};
use dmp_reduce::{Basis, FrameSums, Layout, Reducer, Residuals, RunSums};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::checkpoint::{Casting, Fused, Round, Work};
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{FrameSet, Pauses, PlannedFrame, Worker, each_frame_in_parts, jobs_of};
use crate::fuse::{self, RunMap};
use crate::memory::Budget;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::schedule::{RunTile, Schedule};
use crate::watch::{ScoredReturns, Stage, Watch};

/// Share of the memory that the tiles of all maps may take while rays are cast.
const CAST_SHARE: f64 = 0.75;
/// Most tiles that wait to be loaded before they are needed.
const PREFETCHED_TILES: usize = 256;
/// Most jobs for each thread that are handed out and not done: those that wait and the one at work.
const JOBS_AT_WORK: usize = 3;
/// Predictions are looked for up to this many times the largest range used: further, a sensor would
/// see nothing.
pub(crate) const HORIZON: f64 = 2.0;

/// Everything that comes of casting a log.
#[derive(Debug)]
pub(crate) struct Scored {
    pub(crate) reducer: Reducer,
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

struct CastWorker<'a> {
    poser: Poser<'a>,
    runs: &'a [Run],
    casters: &'a [Caster],
    watch: &'a dyn Watch,
    bases: &'a [Basis],
    queries: Vec<Query>,
    answers: Vec<Vec<Answer>>,
    buffers: CastBuffers,
    /// Of the returns at hand, for every run.
    residuals: Vec<Vec<Residuals>>,
    /// Of one return, for every run.
    of_return: Vec<Residuals>,
    /// Of the frame's returns, for every run.
    frame_tiles: Vec<TileTable<RunSums>>,
    frame: FrameSums,
    reducer: Reducer,
    tiles: HashMap<(usize, TileId), RunSums>,
    counts: ReturnCounts,
}

impl Worker for CastWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self {
            poser,
            runs,
            casters,
            watch,
            bases,
            queries,
            answers,
            buffers,
            residuals,
            of_return,
            frame_tiles,
            ..
        } = self;
        self.frame.clear();
        let sums = &mut self.frame;
        let counts = poser.blocks(frame, scan, |rays| {
            for (run, caster) in casters.iter().enumerate() {
                let segment = (bases[run] == Basis::CrossValidated).then_some(frame.segment);
                queries.clear();
                queries.extend(rays[run].iter().map(|ray| query_of(ray, segment)));
                caster
                    .cast(queries, &mut answers[run], buffers)
                    .map_err(EvaluateError::map_of(&runs[run].name))?;
            }
            for (run, rays) in rays.iter().enumerate() {
                let of_answer = |(ray, answer): (&Ray, &Answer)| residuals_of(ray.range_m, answer);
                residuals[run].clear();
                residuals[run].extend(rays.iter().zip(&answers[run]).map(of_answer));
                let lattice = casters[run].map().lattice();
                for (ray, residuals) in rays.iter().zip(&residuals[run]) {
                    let tile = lattice.tile_of(ray.endpoint_in_world());
                    let tile = tile.map_err(EvaluateError::map_of(&runs[run].name))?;
                    frame_tiles[run].entry(tile).add(residuals);
                }
            }
            if runs.len() > 1 {
                for index in 0..rays[0].len() {
                    of_return.clear();
                    of_return.extend(residuals.iter().map(|of_run| of_run[index]));
                    sums.add_to_pairs(of_return);
                }
            }
            watch.returns_scored(&ScoredReturns { frame: frame.frame, rays, residuals });
            Ok::<(), EvaluateError>(())
        })?;
        // A frame's sums are those of its tiles.
        for (run, of_run) in self.frame_tiles.iter_mut().enumerate() {
            for (tile, of_tile) in of_run.drain() {
                self.frame.add_to_run(run, &of_tile);
                self.tiles.entry((run, tile)).or_default().merge(&of_tile);
            }
        }
        self.reducer.add_frame(ordinal as u64, &self.frame)?;
        self.watch.frame_scored(frame.frame, self.frame.runs());
        self.counts.merge(&counts);
        self.watch.advance(counts.total());
        Ok(())
    }
}

pub(crate) fn query_of(ray: &Ray, segment: Option<i32>) -> Query {
    Query {
        origin_in_world_m: ray.origin_in_world,
        direction_in_world: ray.direction_in_world,
        measured_m: ray.range_m,
        segment,
    }
}

/// Zhang & Chen 2021, eq. 7: z − z', for each of the three z'.
fn residuals_of(range_m: f64, answer: &Answer) -> Residuals {
    let residual = |predicted_m: Option<f64>| predicted_m.map(|z| range_m - z);
    Residuals {
        first_m: residual(answer.first_m),
        nearest_m: residual(answer.nearest_m),
        independent_m: residual(answer.independent_m),
        independent_cos: answer.independent_cos,
        revisited: answer.revisited,
    }
}

/// A caster into every run's map, and what can be told of its surfels.
pub(crate) struct Casters {
    pub(crate) of_runs: Vec<Caster>,
    pub(crate) bases: Vec<Basis>,
    /// When tiles are needed, once that is known.
    schedule: Arc<OnceLock<Schedule>>,
    budget_bytes: usize,
}

impl Casters {
    /// Casters that share the memory there is for tiles.
    pub(crate) fn new(maps: Vec<RunMap>, config: &Config, budget: &Budget) -> Self {
        let settings = CastSettings { horizon_m: HORIZON * config.max_range_m, ..CastSettings::default() };
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
}

/// One pass over the log in which rays are cast.
pub(crate) struct CastPass<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) plan: &'a Plan<'a>,
    pub(crate) runs: &'a [Run],
    pub(crate) casters: &'a Casters,
    pub(crate) config: &'a Config,
    pub(crate) work: &'a Work,
    /// The maps, as they are kept.
    pub(crate) maps: &'a (Round, Fused),
    pub(crate) watch: &'a dyn Watch,
}

type TileSums = HashMap<(usize, TileId), RunSums>;

impl<'a> CastPass<'a> {
    /// Casts every return into every run's map and reduces the residuals, in one pass over the log. What an earlier
    /// process kept is taken up.
    pub(crate) fn run(&self) -> Result<Scored, EvaluateError> {
        let frames = self.plan.frames().len() as u64;
        let layout =
            Layout::new(frames, frames, self.casters.bases.clone())?.with_miss_price(self.config.miss_price);
        let (round, fused) = self.maps;
        self.watch.begin(Stage::Cast, self.plan.returns());
        let (before, done) = self.before(&layout, *round)?;
        self.watch.advance(before.1.total());

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
        let workers = (0..self.config.threads).map(|_| self.worker(&layout)).collect();
        let reading = self.plan.reading(self.log, self.config, self.watch);
        let schedule = self.casters.schedule.get_or_init(|| {
            let jobs = jobs_of(reading, &done);
            Schedule::new(self.plan, &self.casters.of_runs, &jobs, self.config.max_range_m)
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
        let (workers, _) = self.with_prefetch(schedule, |ahead| {
            each_frame_in_parts(reading, workers, Pauses { every, done, keep: &mut keep, ahead })
        })?;
        let (reducer, counts, tiles) = state(&workers)?;
        let tile_loads = self.casters.of_runs[0].tile_loads();
        let lattice = self.casters.of_runs[0].map().lattice();
        let (tiles_in_reach, tile_visits) = schedule.tiles_and_visits();
        Ok(Scored { reducer, counts, tiles, tile_loads, tiles_in_reach, tile_visits, lattice })
    }

    /// Has the tiles loaded that come into reach, beside what reads and casts; `pass` is given what to tell of jobs.
    fn with_prefetch<R>(&self, schedule: &Schedule, pass: impl FnOnce(&dyn Fn(usize)) -> R) -> R {
        // Tiles that do not fit beside each other would only drive each other out.
        let fits = schedule.bytes_in_reach() <= self.casters.budget_bytes as u64;
        let (sender, receiver) = bounded::<RunTile>(if fits { PREFETCHED_TILES } else { 0 });
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for (run, tile) in receiver {
                    // A damaged tile is told of by the ray that needs it.
                    let _ = self.casters.of_runs[run].prefetch(tile);
                }
            });
            let at_work = JOBS_AT_WORK * self.config.threads;
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

    /// What is scored already, and which frames that is.
    fn before(
        &self,
        layout: &Layout,
        round: Round,
    ) -> Result<((Reducer, ReturnCounts, TileSums), FrameSet), EvaluateError> {
        let Some(kept) = self.work.load::<Casting>(round)? else {
            let nothing = (Reducer::new(layout.clone()), ReturnCounts::default(), HashMap::new());
            return Ok((nothing, FrameSet::default()));
        };
        let tiles = kept.tiles.into_iter().map(|(run, x, y, sums)| ((run as usize, TileId { x, y }), sums));
        let reducer = Reducer::resume(layout.clone(), kept.reducer)?;
        Ok(((reducer, kept.counts, tiles.collect()), kept.done))
    }

    fn worker(&self, layout: &Layout) -> CastWorker<'a> {
        CastWorker {
            poser: Poser::new(&self.plan.poses, &self.plan.filter),
            runs: self.runs,
            casters: &self.casters.of_runs,
            watch: self.watch,
            bases: &self.casters.bases,
            queries: Vec::new(),
            answers: vec![Vec::new(); self.runs.len()],
            buffers: CastBuffers::default(),
            residuals: vec![Vec::new(); self.runs.len()],
            of_return: Vec::new(),
            frame_tiles: self.runs.iter().map(|_| TileTable::default()).collect(),
            frame: FrameSums::new(&self.casters.bases),
            reducer: Reducer::new(layout.clone()),
            tiles: HashMap::new(),
            counts: ReturnCounts::default(),
        }
    }
}
