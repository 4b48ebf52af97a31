//! Leaves out of the maps what moved: surfels that rays of the same pass go through.

use dmp_cast::{CountBuffers, CrossingCounter, Query};
use dmp_map::{Met, Store, Tally, TileId, thin_map};
use dmp_reduce::FrameSet;
use dmp_runs::{EvaluateError, PlannedFrame, PosedRun, Poser, Progress, Stage, posed, so_far};
use dmp_sensor::Scan;

use crate::drawn::Followed;
use crate::means::peak;
use crate::passes::cast::horizon_m;
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Reading, Worker, each_frame_of};
use crate::passes::fuse::Fused;
use crate::passes::reach::TilesInReach;
use crate::passes::run_map::{MapFacts, RunMap, TrailFacts};

/// Rays that must go through a surfel for it to be left out: these, and more than half of those that end on it.
const MIN_THROUGH: u32 = 2;

/// A tile keeps its surfels where a larger share of the rays that end in it end on what would be left out: what moves is not
/// most of what is seen, and a wrong run may contradict itself everywhere.
const MOST_OUT: f64 = 1.0 / 3.0;

/// Follows rays through the map of one run.
struct CountWorker<'e> {
    run: &'e PosedRun<'e, CrossingCounter>,
    tally: &'e Tally,
    poser: Poser<'e>,
    pass_m: f64,
    progress: &'e dyn Progress,
    queries: Vec<Query>,
    buffers: CountBuffers,
}

impl Worker for CountWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { run, tally, poser, queries, buffers, .. } = self;
        if let Some(pass) = run.path.pass(ordinal, self.pass_m) {
            poser.blocks((ordinal, frame), scan, |block| {
                queries.clear();
                queries.extend(block.posed(0).map(|(_, &ray)| Query { ray, segment: None }));
                let counted = run.map.count(queries, pass.clone(), tally, buffers);
                counted.map_err(EvaluateError::map_of(run.name()))
            })?;
        }
        self.progress.advance(scan.len() as u64);
        Ok(())
    }
}

impl Evaluation<'_, RunMap> {
    /// The maps without what moved: a sample of the log's rays is followed through every map that was fused.
    ///
    /// # Errors
    /// When the log or a map cannot be read, or a map not be written.
    pub(crate) fn without_trails(self) -> Result<Self, EvaluateError> {
        let is_pending = |run: &PosedRun<'_, RunMap>| run.map.facts.fused && run.map.facts.trails.is_none();
        if !self.runs.iter().any(is_pending) {
            return Ok(self);
        }
        self.keep_if_due()?;
        let followed = Followed::of(self.plan.frames()).scans;
        let thinned = self.thinned(&followed, |_, _| true)?;
        // The maps with trails that were kept are replaced at once: nothing that was done is lost.
        if thinned.work.holds::<Fused>() {
            thinned.kept_maps().save(&thinned.work)?;
        }
        Ok(thinned)
    }

    /// The same, of each map the tiles that rays of `scans` may hit.
    ///
    /// # Errors
    /// As [`Self::without_trails`].
    pub(crate) fn without_trails_around(self, scans: &FrameSet) -> Result<Self, EvaluateError> {
        let followed = self.followed_around(scans)?;
        let reaches = (0..self.runs.len()).map(|run| self.reach(run, scans));
        let reaches: Vec<TilesInReach> = reaches.collect::<Result<_, EvaluateError>>()?;
        self.thinned(&followed, |run, tile| reaches[run].contains(tile))
    }

    /// One run after the other: the tiles and counts of one at a time are in memory.
    fn thinned(
        mut self,
        followed: &FrameSet,
        is_wanted: impl Fn(usize, TileId) -> bool + Sync,
    ) -> Result<Self, EvaluateError> {
        let (bytes, on_m) = (self.work.budget().trails(), self.settings.scales.lengths().blocked_m);
        let mut runs = Vec::new();
        for (number, run) in std::mem::take(&mut self.runs).into_iter().enumerate() {
            let (run, RunMap { store, facts }) = run.with_map(());
            let map = if facts.fused {
                let tally = Tally::new(bytes.counts, self.work.path());
                let tally = tally.map_err(EvaluateError::map_of(run.name()))?;
                let counted = run.like(CrossingCounter::new(store, on_m, bytes.tiles));
                self.follow(followed, &counted, &tally)?;
                peak::look();
                self.fused.scratch_bytes += tally.scratch_bytes();
                let with_trails = counted.map.store();
                let store = self.thin(&run, (with_trails, &tally), |tile| is_wanted(number, tile))?;
                let trails = Some(TrailFacts::of(with_trails, &store));
                RunMap { store, facts: MapFacts { trails, ..facts } }
            } else {
                RunMap { store, facts }
            };
            runs.push(run.with_map(map).0);
            peak::look();
        }
        Ok(self.with_runs(runs))
    }

    fn follow(
        &self,
        followed: &FrameSet,
        run: &PosedRun<'_, CrossingCounter>,
        tally: &Tally,
    ) -> Result<(), EvaluateError> {
        let Self { log, plan, settings, means, progress, kept, .. } = self;
        let followed: FrameSet = followed.iter().filter(|&ordinal| run.path.has(ordinal)).collect();
        progress.begin(Stage::Trails, plan.returns_of(&followed));
        let one_in = Followed::of(plan.frames()).one_in;
        let worker = |_| CountWorker {
            run,
            tally,
            poser: Poser::new(posed(std::slice::from_ref(run)), &plan.filter).taking_one_in(one_in),
            pass_m: settings.scales.lengths().pass_m,
            progress: *progress,
            queries: Vec::new(),
            buffers: CountBuffers::default(),
        };
        let workers = (0..means.threads).map(worker).collect();
        let reading = Reading { drawn: kept.to_follow.as_deref(), ..plan.reading(*log, means, *progress) };
        each_frame_of(reading, |ordinal| followed.contains(ordinal), workers).map(|_| ())
    }
}

impl<M> Evaluation<'_, M> {
    /// The scans that are followed and whose rays may cross a surfel that rays of `scans` may hit.
    pub(crate) fn followed_around(&self, scans: &FrameSet) -> Result<FrameSet, EvaluateError> {
        let edge_m = self.lattice()?.tile_edge_m();
        let steps = steps(self.settings.max_range_m, edge_m);
        let (all, mut around) = (Followed::of(self.plan.frames()).scans, FrameSet::default());
        for run in 0..self.runs.len() {
            let reach = self.reach(run, scans)?;
            let is_near = |&ordinal: &usize| {
                self.position_m(run, ordinal).is_some_and(|at| reach.is_near(at, steps, edge_m))
            };
            around.extend(all.iter().filter(is_near));
        }
        Ok(around)
    }

    /// The tiles of a run's map that rays from some scans may hit, and those whose discs reach into them.
    pub(crate) fn reach(&self, run: usize, scans: &FrameSet) -> Result<TilesInReach, EvaluateError> {
        let edge_m = self.lattice()?.tile_edge_m();
        let positions_m = scans.iter().filter_map(|scan| self.position_m(run, scan));
        Ok(TilesInReach::of(positions_m, steps(horizon_m(&self.settings), edge_m) + 1, edge_m))
    }

    fn position_m(&self, run: usize, ordinal: usize) -> Option<[f64; 2]> {
        let position = self.runs[run].poses.of_frame(&self.plan.frames()[ordinal])?.translation;
        Some([position.x, position.y])
    }

    /// Writes a run's map without what the rays contradict.
    fn thin(
        &self,
        run: &PosedRun<'_, ()>,
        map: (&Store, &Tally),
        is_wanted: impl Fn(TileId) -> bool + Send,
    ) -> Result<Store, EvaluateError> {
        let (path, life) = self.map_file(run);
        let (into, on_tile) = ((path.as_path(), life.durability()), so_far(self.progress, Stage::Surfels));
        let written =
            self.work.install(|| thin_map(map, is_wanted, (is_contradicted, MOST_OUT), into, &on_tile));
        written.and_then(|_| life.open(&path)).map_err(EvaluateError::map_of(run.name()))
    }
}

/// How many tiles a length reaches, and one more: the sensor moves during a scan.
fn steps(length_m: f64, edge_m: f64) -> i32 {
    (length_m / edge_m).ceil() as i32 + 1
}

fn is_contradicted(met: Met) -> bool {
    met.through >= MIN_THROUGH && met.through > met.on / 2
}
