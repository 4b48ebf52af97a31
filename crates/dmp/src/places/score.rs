//! One place: its map, fused from the scans around it, and its own scans cast into that.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use dmp_log::{Damage, ScanLog};
use dmp_map::{Lattice, TileId};
use dmp_reduce::{Basis, FrameSums, RunSums};
use dmp_sensor::{DropReason, ReturnCounts};

use super::scans::DriveScans;
use super::way::PlaceScans;
use crate::cast::{CastPass, Casters};
use crate::checkpoint::Work;
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{FrameSet, PlannedFrame};
use crate::fuse;
use crate::plan::{Plan, Selection};
use crate::report::{MapReport, map_reports};
use crate::watch::{ScoredReturns, Stage, Watch};

/// What scores places: one thread's.
pub(crate) struct PlaceScorer<'a> {
    pub(crate) scans: &'a DriveScans<'a>,
    /// What holds for all places: voxels, filter, poses.
    pub(crate) plan: &'a Plan<'a>,
    pub(crate) runs: &'a [Run],
    /// With this thread's share of the memory.
    pub(crate) config: &'a Config,
    pub(crate) watch: &'a dyn Watch,
}

/// What comes of places.
#[derive(Debug, Clone)]
pub(crate) struct PlaceTotals {
    /// Returns of the scans that were fused, and of those that were scored.
    pub(crate) fused: ReturnCounts,
    pub(crate) scored: ReturnCounts,
    pub(crate) scans_read: u64,
    pub(crate) scans_scored: u64,
    /// Scans that turned out to have no pose in some run.
    pub(crate) unposed_returns: u64,
    pub(crate) tiles: HashMap<(usize, TileId), RunSums>,
    pub(crate) maps: Vec<MapReport>,
    pub(crate) scratch_bytes: u64,
    pub(crate) map_bytes: u64,
    pub(crate) tile_loads: u64,
    pub(crate) fuse_s: f64,
    pub(crate) cast_s: f64,
    /// What is lost, and at which place that was seen.
    pub(crate) damage: Vec<(usize, Damage)>,
    pub(crate) lattice: Option<Lattice>,
}

impl PlaceTotals {
    pub(crate) fn new(runs: usize) -> Self {
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
            cast_s: 0.0,
            damage: Vec::new(),
            lattice: None,
        }
    }

    pub(crate) fn merge(&mut self, other: Self) {
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
        self.cast_s += other.cast_s;
        self.damage.extend(other.damage);
        self.lattice = self.lattice.or(other.lattice);
    }
}

impl PlaceScorer<'_> {
    /// Reads, fuses and casts the place of this number; `totals` take what is not its sums.
    pub(crate) fn score(
        &self,
        number: usize,
        place: &PlaceScans,
        totals: &mut PlaceTotals,
    ) -> Result<FrameSums, EvaluateError> {
        let runs = self.runs;
        let nothing = FrameSums::new(&vec![Basis::CrossValidated; runs.len()]);
        let watch = InPlace { whole: self.watch, sums: Mutex::new(nothing) };
        let log = self.scans.load(&place.read)?;
        let (frames, unposed_returns) = self.scans.frames_of(&log, self.config);
        let mut scored = FrameSet::default();
        for (at, _) in frames.iter().enumerate().filter(|(_, (ordinal, _))| place.scored.contains(ordinal)) {
            scored.insert(at);
            totals.scans_scored += 1;
        }
        let frames: Vec<PlannedFrame> = frames.into_iter().map(|(_, frame)| frame).collect();
        totals.scans_read += frames.len() as u64;
        totals.unposed_returns += unposed_returns;
        totals.damage.extend(log.summary().damage.iter().map(|lost| (number, lost.clone())));
        if !(0..frames.len()).any(|ordinal| scored.contains(ordinal)) {
            // Nothing of the place itself can be read: what lies around it is of no use.
            let returns = frames.iter().map(|frame| frame.returns).sum();
            totals.fused.add_dropped(DropReason::ScanNotSampled, returns);
            return Ok(watch.sums());
        }

        let start = Instant::now();
        let Plan { poses, segments, filter, voxel, looks, own_from_world, .. } = self.plan;
        let plan = Plan {
            selection: Selection { frames, ..Selection::default() },
            poses: poses.clone(),
            segments: segments.clone(),
            filter: filter.clone(),
            voxel: *voxel,
            looks: looks.clone(),
            own_from_world: own_from_world.clone(),
        };
        let work = Work::open(&log, runs, self.config)?;
        let stores = runs.iter().map(|_| None).collect();
        let mut maps = fuse::maps_of(&log, &plan, runs, stores, None, self.config, &work, &watch)?;
        let run_maps = std::mem::take(&mut maps.of_runs);
        let fuse_s = start.elapsed().as_secs_f64();

        let of_maps = map_reports(&run_maps, None);
        let map_bytes = fuse::fused_bytes(&run_maps);
        let casters = Casters::new(run_maps, self.config, work.budget());
        let pass = CastPass {
            log: &log,
            plan: &plan,
            runs,
            casters: &casters,
            config: self.config,
            work: &work,
            watch: &watch,
        };
        let (counts, tiles) = pass.of_frames(&scored)?;
        totals.merge(PlaceTotals {
            fused: maps.counts.unwrap_or_default(),
            scored: counts,
            tiles,
            maps: of_maps,
            scratch_bytes: maps.scratch_bytes,
            map_bytes,
            tile_loads: casters.of_runs.first().map_or(0, dmp_cast::Caster::tile_loads),
            fuse_s,
            cast_s: start.elapsed().as_secs_f64() - fuse_s,
            lattice: casters.of_runs.first().map(|caster| caster.map().lattice()),
            ..PlaceTotals::new(runs.len())
        });
        Ok(watch.sums())
    }
}

/// Watches one place of many, whose stages are those of the whole, and adds up its scans.
struct InPlace<'a> {
    whole: &'a dyn Watch,
    sums: Mutex<FrameSums>,
}

impl InPlace<'_> {
    fn sums(self) -> FrameSums {
        self.sums.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for InPlace<'_> {
    fn begin(&self, _: Stage, _: u64) {}

    fn advance(&self, _: u64) {}

    fn note(&self, text: &str) {
        self.whole.note(text);
    }

    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.whole.returns_scored(returns);
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.sums.lock().unwrap_or_else(PoisonError::into_inner).merge(sums);
        self.whole.frame_scored(frame, sums);
    }

    fn cancelled(&self) -> bool {
        self.whole.cancelled()
    }
}
