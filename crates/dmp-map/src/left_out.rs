//! The places of a map from which surfels were left out.

use std::collections::HashSet;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use dmp_disk::{BudgetCache, TileId, Weight};

use crate::MapError;
use crate::grid::{Lattice, MixHasher, Voxel};
use crate::store::Store;

/// The voxels of which a map leaves out the surfels, loaded tile by tile under a byte budget.
#[derive(Debug)]
pub struct PlacesLeftOut {
    lattice: Lattice,
    tiles: BudgetCache<TileId, Voxels>,
}

/// Voxels of a tile by their cells.
#[derive(Debug, Default)]
struct Voxels(HashSet<u64, BuildHasherDefault<MixHasher>>);

impl Weight for Voxels {
    fn weight_bytes(&self) -> usize {
        // A byte of control for each slot.
        self.0.capacity() * (size_of::<u64>() + 1)
    }
}

impl PlacesLeftOut {
    /// The places that `map` left out, of which at most about `budget_bytes` are in memory.
    pub fn of(map: &Store, budget_bytes: usize) -> Self {
        Self { lattice: map.lattice(), tiles: BudgetCache::new(budget_bytes) }
    }

    /// Leaves in `is_left_out`, for each of the points, whether `map`, which it was made of, left out the surfel of its voxel.
    ///
    /// # Errors
    /// When a tile is damaged.
    pub fn find(
        &self,
        map: &Store,
        points_in_world_m: impl Iterator<Item = [f64; 3]>,
        is_left_out: &mut Vec<bool>,
    ) -> Result<(), MapError> {
        is_left_out.clear();
        let mut last: Option<(TileId, Arc<Voxels>)> = None;
        for point in points_in_world_m {
            let Ok((tile, voxel)) = self.lattice.locate(point) else {
                is_left_out.push(false);
                continue;
            };
            let voxels = match &last {
                Some((id, voxels)) if *id == tile => voxels,
                _ => &last.insert((tile, self.tiles.get(tile, || Voxels::load(map, tile))?)).1,
            };
            is_left_out.push(!voxels.0.is_empty() && voxels.0.contains(&voxel.by_cell()));
        }
        Ok(())
    }
}

impl Voxels {
    fn load(map: &Store, tile: TileId) -> Result<Self, MapError> {
        let by_cell = |[x, y, z]: [i32; 3]| Voxel { z, y: y as u16, x: x as u16 }.by_cell();
        Ok(Self(map.left_out(tile)?.into_iter().map(by_cell).collect()))
    }
}
