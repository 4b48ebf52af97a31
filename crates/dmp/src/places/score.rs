//! Scores one place: fuses its map from the scans around it and casts its own scans into that map.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use dmp_log::{Damage, MemoryLog, ScanLog};
use dmp_map::{Lattice, Store, TileId};
use dmp_reduce::{Basis, FrameSet, FrameSums, RunSums};
use dmp_report::MapReport;
use dmp_runs::{
    EvaluateError, Means, Note, PlannedFrame, PosedRun, Progress, Run, ScoredReturns, Selection, Settings,
    Sink, Watch,
};
use dmp_sensor::{DropReason, ReturnCounts};

use super::scans::DriveScans;
use super::way::PlaceScans;
use crate::means::{Extent, Work};
use crate::passes::{Plan, Task, tile_bytes};
use crate::results::map_report;

/// The place scorer of one thread.
pub(super) struct PlaceScorer<'a> {
    pub(super) scans: &'a DriveScans<'a>,
    /// The plan common to all places: voxels, filter.
    pub(super) plan: &'a Plan,
    pub(super) asked: &'a [Run],
    pub(super) runs: &'a [PosedRun<'a, Option<Store>>],
    pub(super) settings: &'a Settings,
    /// This thread's share of the memory, and a bound for a place without its scans.
    pub(super) means: &'a Means,
    pub(super) extent: Extent,
    pub(super) watch: Watch<'a>,
}

/// Totals over places.
#[derive(Debug, Clone)]
pub(super) struct PlaceTotals {
    /// Returns of the fused scans, and of the scored scans.
    pub(super) fused: ReturnCounts,
    pub(super) scored: ReturnCounts,
    pub(super) scans_read: u64,
    pub(super) scans_scored: u64,
    /// Returns of scans that, once read, have no pose in some run.
    pub(super) unposed_returns: u64,
    pub(super) tiles: HashMap<(usize, TileId), RunSums>,
    pub(super) maps: Vec<MapReport>,
    pub(super) scratch_bytes: u64,
    pub(super) map_bytes: u64,
    pub(super) tile_loads: u64,
    pub(super) fuse_s: f64,
    pub(super) trails_s: f64,
    pub(super) cast_s: f64,
    /// Damage, and the place at which it was seen.
    pub(super) damage: Vec<(usize, Damage)>,
    pub(super) lattice: Option<Lattice>,
}

impl PlaceTotals {
    pub(super) fn new(runs: usize) -> Self {
        Self {
            fused: ReturnCounts::default(),
            scored: ReturnCounts::default(),
            scans_read: 0,
            scans_scored: 0,
            unposed_returns: 0,
            tiles: HashMap::new(),
            maps: vec![MapReport::default(); runs],
            scratch_bytes: 0,
            map_bytes: 0,
            tile_loads: 0,
            fuse_s: 0.0,
            trails_s: 0.0,
            cast_s: 0.0,
            damage: Vec::new(),
            lattice: None,
        }
    }

    pub(super) fn merge(&mut self, other: Self) {
        self.fused.merge(&other.fused);
        self.scored.merge(&other.scored);
        self.scans_read += other.scans_read;
        self.scans_scored += other.scans_scored;
        self.unposed_returns += other.unposed_returns;
        for (tile, sums) in other.tiles {
            self.tiles.entry(tile).or_default().merge(&sums);
        }
        for (mine, theirs) in self.maps.iter_mut().zip(&other.maps) {
            mine.add(theirs);
        }
        self.scratch_bytes += other.scratch_bytes;
        self.map_bytes += other.map_bytes;
        self.tile_loads += other.tile_loads;
        self.fuse_s += other.fuse_s;
        self.trails_s += other.trails_s;
        self.cast_s += other.cast_s;
        self.damage.extend(other.damage);
        self.lattice = self.lattice.or(other.lattice);
    }
}

impl PlaceScorer<'_> {
    /// Reads, fuses and casts the place of this number; adds everything but its sums to `totals`.
    pub(super) fn score(
        &self,
        number: usize,
        place: &PlaceScans,
        totals: &mut PlaceTotals,
    ) -> Result<FrameSums, EvaluateError> {
        let nothing = FrameSums::new(&vec![Basis::CrossValidated; self.runs.len()]);
        let watch = InPlace { whole: self.watch, sums: Mutex::new(nothing) };
        let log = self.scans.load(&place.read)?;
        let (frames, unposed_returns) = self.scans.frames_of(&log, self.settings);
        let mut scored = FrameSet::default();
        for (at, _) in frames.iter().enumerate().filter(|(_, (ordinal, _))| place.scored.contains(ordinal)) {
            scored.insert(at);
            totals.scans_scored += 1;
        }
        let (ordinals, frames): (Vec<usize>, Vec<PlannedFrame>) = frames.into_iter().unzip();
        totals.scans_read += frames.len() as u64;
        totals.unposed_returns += unposed_returns;
        totals.damage.extend(log.summary().damage.iter().map(|lost| (number, lost.clone())));
        if !(0..frames.len()).any(|ordinal| scored.contains(ordinal)) {
            // Nothing of the place itself can be read: its surroundings are of no use.
            let returns = frames.iter().map(|frame| frame.returns).sum();
            totals.fused.add_dropped(DropReason::ScanNotSampled, returns);
            return Ok(watch.sums());
        }
        totals.merge(self.evaluate(&log, (&ordinals, frames), &scored, &watch)?);
        Ok(watch.sums())
    }

    /// Fuses some scans and casts the scored ones.
    fn evaluate(
        &self,
        log: &MemoryLog,
        (ordinals, frames): (&[usize], Vec<PlannedFrame>),
        scored: &FrameSet,
        watch: &InPlace<'_>,
    ) -> Result<PlaceTotals, EvaluateError> {
        let start = Instant::now();
        let (settings, means) = (self.settings.clone(), self.means.clone());
        let work = Arc::new(Work::open(log, self.asked, &settings, &means, self.extent)?);
        let plan = Plan { selection: Selection { frames, ..Selection::default() }, ..self.plan.clone() };
        let in_use = &self.scans.drive().in_use;
        let here = |run: &PosedRun<'_, Option<Store>>| {
            run.path.through(ordinals.iter().map(|&ordinal| Some(in_use[ordinal])))
        };
        let runs = self.runs.iter().map(|run| run.like(None).with_path(here(run))).collect();
        let task = Task { log, settings, means, work, watch: Watch::from((watch, watch)) };
        let fused = task.planned(plan, runs).fuse()?;
        let fuse_s = start.elapsed().as_secs_f64();
        let fused = fused.without_trails()?;
        let trails_s = start.elapsed().as_secs_f64() - fuse_s;
        let (maps, _) = fused.casters();
        let (counts, tiles) = maps.cast_frames(scored)?;
        let stores = || maps.runs.iter().map(|run| (run.map.caster.map(), &run.map.facts));
        let first = &maps.runs[0].map.caster;
        Ok(PlaceTotals {
            fused: maps.fused.counts.unwrap_or_default(),
            scored: counts,
            tiles,
            maps: stores().map(|(store, facts)| map_report(store, facts)).collect(),
            scratch_bytes: maps.fused.scratch_bytes,
            map_bytes: stores().map(|(store, _)| tile_bytes(store)).sum(),
            tile_loads: first.tile_loads(),
            fuse_s,
            trails_s,
            cast_s: start.elapsed().as_secs_f64() - fuse_s - trails_s,
            lattice: Some(first.map().lattice()),
            ..PlaceTotals::new(self.runs.len())
        })
    }
}

/// Watches one place among many and adds up its scans; its stages are not reported.
struct InPlace<'a> {
    whole: Watch<'a>,
    sums: Mutex<FrameSums>,
}

impl InPlace<'_> {
    fn sums(self) -> FrameSums {
        self.sums.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for InPlace<'_> {
    fn note(&self, note: &Note) {
        self.whole.progress.note(note);
    }

    fn cancelled(&self) -> bool {
        self.whole.progress.cancelled()
    }
}

impl Sink for InPlace<'_> {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.whole.sink.returns_scored(returns);
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.sums.lock().unwrap_or_else(PoisonError::into_inner).merge(sums);
        self.whole.sink.frame_scored(frame, sums);
    }
}
