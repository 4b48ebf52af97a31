//! One pass over the log that casts rays, `z' = S(M, T_z)`, and reduces the residuals.

use std::collections::HashMap;

use dmp_map::{Lattice, TileId};
use dmp_reduce::{Basis, Confidence, FrameSet, Layout, Reducer, RunSums};
use dmp_runs::{EvaluateError, Stage};
use dmp_sensor::ReturnCounts;

use super::casters::{RunCaster, SharedTiles, bases};
use super::checkpoint::Casting;
use super::copies::{CopiedScans, copied_scans};
use super::odd::{OddScans, in_rows, odd_scans};
use super::worker::{CastWorker, OwnTileSums};
use crate::drawn::ScanShape;
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Pauses, Reading, each_frame_in_parts, jobs_of};
use crate::passes::fuse::KeptMaps;
use crate::passes::schedule::Schedule;

/// Everything that casting a log yields.
#[derive(Debug)]
pub(crate) struct Scored {
    pub(crate) reducer: Reducer,
    /// For every unit of the reducer its number in the log: of a scan, or of the scan in a place's middle.
    pub(crate) scan_of_unit: Vec<usize>,
    /// How sure the verdicts are together.
    pub(crate) confidence: Confidence,
    pub(crate) counts: ReturnCounts,
    /// Scans of a log without checksums that are unlike the others.
    pub(crate) odd_scans: Vec<OddScans>,
    /// Scans that repeat another scan.
    pub(crate) copied_scans: Vec<CopiedScans>,
    /// See [`OwnTileSums`].
    pub(crate) tiles: HashMap<(usize, TileId), RunSums>,
    pub(crate) tile_loads: u64,
    /// Tiles that were within the sensor's reach, counted each time they came into it.
    pub(crate) tiles_in_reach: u64,
    pub(crate) tile_visits: u64,
    /// The grid of the maps.
    pub(crate) lattice: Lattice,
}

/// The partial sums of an evaluation.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    pub(super) reducer: Reducer,
    pub(super) counts: ReturnCounts,
    pub(super) tiles: OwnTileSums,
    pub(super) shapes: Vec<(u64, ScanShape)>,
    pub(super) marks: Vec<(u64, u64)>,
}

impl Sums {
    pub(super) fn nothing(layout: &Layout) -> Self {
        let (reducer, counts) = (Reducer::new(layout.clone()), ReturnCounts::default());
        Self { reducer, counts, tiles: HashMap::new(), shapes: Vec::new(), marks: Vec::new() }
    }

    /// Adds the sums of some workers.
    pub(super) fn with(&self, workers: &[CastWorker<'_>]) -> Result<Self, EvaluateError> {
        let mut sums = self.clone();
        for worker in workers {
            sums.reducer.merge(&worker.reducer)?;
            sums.counts.merge(&worker.counts);
            for (tile, of_tile) in &worker.tiles {
                sums.tiles.entry(*tile).or_default().merge(of_tile);
            }
            sums.shapes.extend(&worker.shapes);
            sums.marks.extend(&worker.marks);
        }
        Ok(sums)
    }

    /// The sums for a checkpoint: the same bytes however frames were distributed.
    pub(super) fn kept(self, done: FrameSet) -> Casting {
        let Self { reducer, counts, tiles, mut shapes, mut marks } = self;
        let mut tiles: Vec<_> =
            tiles.into_iter().map(|((run, tile), sums)| (run as u64, tile.x, tile.y, sums)).collect();
        tiles.sort_unstable_by_key(|&(run, x, y, _)| (run, x, y));
        shapes.sort_unstable_by_key(|&(ordinal, _)| ordinal);
        marks.sort_unstable();
        Casting { done, reducer: reducer.seen(), counts, tiles, shapes, marks }
    }

    /// The sums of a checkpoint.
    ///
    /// # Errors
    /// When they are of other runs.
    pub(super) fn of_kept(kept: Casting, layout: &Layout) -> Result<Self, EvaluateError> {
        let Casting { reducer, counts, tiles, shapes, marks, .. } = kept;
        let tiles = tiles.into_iter().map(|(run, x, y, sums)| ((run as usize, TileId { x, y }), sums));
        let reducer = Reducer::resume(layout.clone(), reducer)?;
        Ok(Self { reducer, counts, tiles: tiles.collect(), shapes, marks })
    }
}

impl Evaluation<'_, RunCaster> {
    /// Casts the drawn returns into every run's map and reduces the residuals, in one pass over the log. Resumes from a
    /// checkpoint; `maps` are stored before the first checkpoint of its own.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub(crate) fn cast(&self, tiles: &SharedTiles, maps: &KeptMaps) -> Result<Scored, EvaluateError> {
        let layout = self.layout();
        let (before, done) = self.before(&layout)?;

        let mut keep = |workers: &[CastWorker<'_>], done: &FrameSet| {
            maps.keep(&self.work)?;
            self.work.save(&before.with(workers)?.kept(done.clone()))
        };
        let workers = (0..self.means.threads).map(|_| CastWorker::new(self, &layout)).collect();
        let reading = self.drawn_reading();
        let jobs = jobs_of(reading, |ordinal| self.uses(ordinal) && !done.contains(ordinal));
        let count = jobs.len();
        let schedule = tiles.schedule.get_or_init(|| self.schedule(&mut jobs.iter()));
        self.progress.begin(Stage::Cast, self.plan.frames().iter().map(|frame| frame.returns).sum());
        self.progress.advance(self.plan.returns_of(&done));
        let (workers, _) = tiles.with_prefetch(&self.runs, self.means.threads, schedule, |ahead| {
            let pauses = Pauses { every: self.work.every(), done, keep: &mut keep, ahead };
            each_frame_in_parts(reading, jobs, workers, pauses)
        })?;
        let (tiles_in_reach, tile_visits) = schedule.tiles_and_visits(count);
        let tile_loads = self.runs[0].map.caster.tile_loads();
        let mut sums = before.with(&workers)?;
        sums.reducer.add_empty_frames(self.unused_frames())?;
        let scored = self.scored(sums)?;
        Ok(Scored { tile_loads, tiles_in_reach, tile_visits, ..scored })
    }

    /// When each tile is needed, for these jobs.
    pub(super) fn schedule(&self, jobs: &mut dyn Iterator<Item = &Vec<usize>>) -> Schedule {
        let runs: Vec<_> = self.runs.iter().map(|run| (&run.poses, run.map.caster.map())).collect();
        Schedule::new(&self.plan, &runs, jobs, self.settings.max_range_m)
    }

    /// The reading of what is cast: of the drawn returns where they were kept, else of the log.
    pub(super) fn drawn_reading(&self) -> Reading<'_> {
        let reading = self.plan.reading(self.log, &self.means, self.progress);
        Reading { drawn: self.kept.to_cast.as_deref(), ..reading }
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout_for(bases(&self.runs))
    }

    /// The sums so far, and the frames they cover.
    fn before(&self, layout: &Layout) -> Result<(Sums, FrameSet), EvaluateError> {
        let kept = if self.sink.wants_every_return() { None } else { self.work.load::<Casting>()? };
        // A tile has at least one return: without stored tile sums, all are computed again.
        let Some(mut kept) = kept.filter(|kept| !self.means.per_tile || !kept.tiles.is_empty()) else {
            return Ok((Sums::nothing(layout), FrameSet::default()));
        };
        if !self.means.per_tile {
            kept.tiles.clear();
        }
        let done = kept.done.clone();
        Ok((Sums::of_kept(kept, layout)?, done))
    }
}

impl<M> Evaluation<'_, M> {
    /// What reducers need from the log, for runs judged by `bases`.
    pub(crate) fn layout_for(&self, bases: Vec<Basis>) -> Layout {
        let layout = Layout::new(self.plan.frames().len() as u64, bases).on_scales(self.settings.scales);
        layout.with_miss_price(self.settings.miss_price)
    }

    /// The scores of these sums; statistics of loaded tiles are not included.
    pub(super) fn scored(&self, sums: Sums) -> Result<Scored, EvaluateError> {
        let Sums { reducer, counts, tiles, shapes, marks } = sums;
        let (odd_scans, copied_scans) = (self.odd_scans(shapes), self.copied_scans(marks));
        Ok(Scored {
            reducer,
            scan_of_unit: self.plan.frames().iter().map(|frame| frame.number).collect(),
            confidence: self.settings.confidence,
            counts,
            odd_scans,
            copied_scans,
            tiles,
            tile_loads: 0,
            tiles_in_reach: 0,
            tile_visits: 0,
            lattice: self.lattice()?,
        })
    }

    /// Frames that no run has a pose for: they have no returns.
    pub(super) fn unused_frames(&self) -> u64 {
        (0..self.plan.frames().len()).filter(|&ordinal| !self.uses(ordinal)).count() as u64
    }

    /// The scans unlike the others, if all were scored.
    fn odd_scans(&self, mut shapes: Vec<(u64, ScanShape)>) -> Vec<OddScans> {
        let frames = self.plan.frames();
        if shapes.len() != frames.len() {
            return Vec::new();
        }
        shapes.sort_unstable_by_key(|&(ordinal, _)| ordinal);
        let shapes: Vec<ScanShape> = shapes.into_iter().map(|(_, shape)| shape).collect();
        in_rows(odd_scans(&shapes).into_iter().map(|(k, oddity)| (frames[k].number, oddity)))
    }

    /// The scored scans that repeat another scan.
    fn copied_scans(&self, mut marks: Vec<(u64, u64)>) -> Vec<CopiedScans> {
        marks.sort_unstable();
        let numbered = |(ordinal, mark): (u64, u64)| (self.plan.frames()[ordinal as usize].number, mark);
        copied_scans(&marks.into_iter().map(numbered).collect::<Vec<_>>())
    }
}
