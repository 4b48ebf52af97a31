//! Checks, before any map is fused, that memory has room for the tiles in a sensor's reach.

use std::collections::HashMap;

use dmp_map::{Lattice, Store, TileEntry, TileId};
use dmp_runs::{EvaluateError, MapSource, Note, PlannedFrame, RunPoses};

use super::sounding::{SoundedRun, Sounding};
use crate::passes::evaluation::Evaluation;
use crate::passes::schedule::SURFEL_BYTES;

/// Number of places at which the tiles in reach are summed up.
const PLACES: usize = 64;

/// The expected map of a run: the approximate number of surfels per tile.
struct Tiles<'e> {
    poses: &'e RunPoses,
    edge_m: f64,
    surfels: HashMap<TileId, f64>,
}

impl Evaluation<'_, Option<Store>> {
    /// Warns if the tiles in reach exceed the memory: they would then be loaded again and again during the
    /// cast. Given clouds are not yet known and not counted.
    ///
    /// # Errors
    /// When the voxel edge is invalid.
    pub(crate) fn foresee_tiles(&self, sounding: &Sounding) -> Result<(), EvaluateError> {
        let budget = self.work.budget();
        let needed = self.bytes_in_reach(sounding)?;
        if needed > budget.cast_bytes() as f64 {
            let (needed_bytes, budget_bytes) = (needed as u64, budget.cast_bytes() as u64);
            let memory_bytes = budget.memory_for_tiles(needed_bytes);
            self.progress.note(&Note::TilesBeyondMemory { needed_bytes, budget_bytes, memory_bytes });
        }
        Ok(())
    }

    /// Approximate peak bytes of tiles in the sensor's reach, ready for casting, over all runs.
    fn bytes_in_reach(&self, sounding: &Sounding) -> Result<f64, EvaluateError> {
        let edge_m = Lattice::new(self.plan.surveyed.voxel_m)?.tile_edge_m();
        let mut fused = sounding.runs.iter();
        let mut maps = Vec::new();
        for run in &self.runs {
            let poses = &run.poses;
            if let Some(store) = &run.map {
                let of_tile = |entry: &TileEntry| (entry.tile, f64::from(entry.own.surfels));
                let surfels = store.entries().map(of_tile).collect();
                maps.push(Tiles { poses, edge_m: store.lattice().tile_edge_m(), surfels });
            } else if run.run.map == MapSource::Fused {
                let surfels = fused.next().map(SoundedRun::surfels_of_tiles).unwrap_or_default();
                maps.push(Tiles { poses, edge_m, surfels });
            }
        }
        let reach_m = self.settings.max_range_m;
        let at = |frame: &PlannedFrame| maps.iter().map(|map| map.in_reach(frame, reach_m)).sum::<f64>();
        let frames = self.plan.frames();
        let step = frames.len().div_ceil(PLACES).max(1);
        Ok(frames.iter().step_by(step).map(at).fold(0.0, f64::max) * SURFEL_BYTES as f64)
    }
}

impl Tiles<'_> {
    /// Surfels of the tiles that rays of a scan may hit.
    fn in_reach(&self, frame: &PlannedFrame, reach_m: f64) -> f64 {
        let Some(pose) = self.poses.of_frame(frame) else { return 0.0 };
        let apart = |c: f64, tile: i32| {
            let low_m = f64::from(tile) * self.edge_m;
            (low_m - c).max(c - low_m - self.edge_m).max(0.0)
        };
        let [x, y] = [pose.translation.x, pose.translation.y];
        let is_near = |tile: &TileId| {
            let [x, y] = [apart(x, tile.x), apart(y, tile.y)];
            x * x + y * y <= reach_m * reach_m
        };
        self.surfels.iter().filter(|(tile, _)| is_near(tile)).map(|(_, surfels)| surfels).sum()
    }
}
