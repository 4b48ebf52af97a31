//! The map of patches at given poses.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use dmp_disk::TileId;

use super::block::block_edge_m;
use super::file::Patches;
use super::gathered::{Around, Gathered, MARGIN_VOXELS};
use super::placement::Placement;
use crate::MapError;
use crate::grid::MixHasher;
use crate::surfels::{Surfel, Tile, TileExtent, TileSource};

/// Most voxels of patches read before they are merged: 20 MB.
const MOST_READ: usize = 1 << 20;

/// A block that was read: its column in the world, its patch and number, and the index of its voxels among those read.
type Read = ([i32; 3], usize, usize, usize);

/// The map of patches at given poses. A tile is computed on demand and not cached.
///
/// As in a fused map, every voxel with enough points has a surfel. But a voxel of a patch goes whole into the map's
/// voxel that its mean falls into. Sums are integers: the same patches at the same poses give the same bits. The map
/// has no segments, so nothing is independent.
#[derive(Debug)]
pub struct PlacedPatches<'a> {
    patches: &'a Patches,
    placements: Vec<Placement>,
    pub(super) tiles: HashMap<TileId, InReach, BuildHasherDefault<MixHasher>>,
    bounds: Option<[TileId; 2]>,
}

/// The blocks that may be in a tile.
#[derive(Debug)]
pub(super) struct InReach {
    z_range_m: [f64; 2],
    /// Numbers of patches, and of their blocks; in order.
    pub(super) blocks: Vec<(u32, u32)>,
}

impl<'a> PlacedPatches<'a> {
    /// Places the patches. `O(blocks)`: no voxel is read.
    ///
    /// # Errors
    /// When a patch lies outside the world.
    ///
    /// # Panics
    /// When the number of placements differs from that of patches.
    pub fn new(patches: &'a Patches, placements: Vec<Placement>) -> Result<Self, MapError> {
        assert_eq!(placements.len(), patches.len(), "a placement for every patch");
        let lattice = patches.lattice();
        let block_edge_m = block_edge_m(&lattice);
        // Also covers a mean that rounding moves over the border.
        let margin_m = f64::from(MARGIN_VOXELS) * lattice.voxel_m() + 1e-3;
        let mut placed = Self { patches, placements, tiles: HashMap::default(), bounds: None };
        for (number, placement) in placed.placements.iter().enumerate() {
            for (index, block) in patches.blocks(number).iter().enumerate() {
                let [low, high] = placement.bounds_m(block.bounds_m(block_edge_m));
                let first = lattice.tile_of([low[0] - margin_m, low[1] - margin_m, low[2]])?;
                let last = lattice.tile_of([high[0] + margin_m, high[1] + margin_m, high[2]])?;
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        let empty = || InReach { z_range_m: [low[2], high[2]], blocks: Vec::new() };
                        let reach = placed.tiles.entry(TileId { y, x }).or_insert_with(empty);
                        let [lowest, highest] = reach.z_range_m;
                        reach.z_range_m = [lowest.min(low[2]), highest.max(high[2])];
                        reach.blocks.push((number as u32, index as u32));
                    }
                }
                let [low, high] = placed.bounds.get_or_insert([first, last]);
                *low = TileId { x: low.x.min(first.x), y: low.y.min(first.y) };
                *high = TileId { x: high.x.max(last.x), y: high.y.max(last.y) };
            }
        }
        Ok(placed)
    }

    /// Merges the voxels in and around a tile: x and y from [`MARGIN_VOXELS`] before the tile's corner.
    pub(super) fn put_together(
        &self,
        tile: TileId,
        blocks: &[(u32, u32)],
        gathered: &mut Gathered,
    ) -> Result<(), MapError> {
        let around = Around::of(self.patches.lattice(), tile)?;
        gathered.clear();
        let together = |a: &(u32, u32), b: &(u32, u32)| a.0 == b.0 && a.1 + 1 == b.1;
        let block_edge_m = block_edge_m(&self.patches.lattice());
        let mut order = Vec::new();
        for run in blocks.chunk_by(together) {
            if gathered.read.len() > MOST_READ {
                self.add(&around, &mut order, gathered)?;
            }
            let (number, first) = (run[0].0 as usize, run[0].1 as usize);
            let mut from = gathered.read.len();
            self.patches.read(number, first..first + run.len(), &mut gathered.read)?;
            for (index, block) in (first..).zip(&self.patches.blocks(number)[first..first + run.len()]) {
                let [x, y, z] = self.placements[number].place(block.corner_m(block_edge_m));
                let column = [y, x, z].map(|c| (c / block_edge_m).floor() as i32);
                order.push((column, number, index, from));
                from += block.voxels as usize;
            }
        }
        self.add(&around, &mut order, gathered)
    }

    /// Merges the voxels read, ordered by position across patches, so that neighbours are still in cache.
    fn add(&self, around: &Around, order: &mut Vec<Read>, gathered: &mut Gathered) -> Result<(), MapError> {
        order.sort_unstable();
        let mut read = std::mem::take(&mut gathered.read);
        let added = order.drain(..).try_for_each(|(_, number, index, from)| {
            let block = &self.patches.blocks(number)[index];
            let voxels = &read[from..from + block.voxels as usize];
            around.add(&self.placements[number], block, voxels, gathered)
        });
        read.clear();
        gathered.read = read;
        added
    }
}

impl TileSource for PlacedPatches<'_> {
    fn tile_edge_m(&self) -> f64 {
        self.patches.lattice().tile_edge_m()
    }

    fn disc_radius_m(&self) -> f64 {
        self.patches.lattice().disc_radius_m()
    }

    fn tile_bounds(&self) -> Option<[TileId; 2]> {
        self.bounds
    }

    fn tile_extent(&self, tile: TileId) -> Option<TileExtent> {
        let InReach { z_range_m: [low, high], .. } = self.tiles.get(&tile)?;
        // A mean of means lies between them; a disc around it reaches farther.
        let reach_m = self.disc_radius_m() + 0.01;
        Some(TileExtent { z_range_m: [low - reach_m, high + reach_m], ..TileExtent::EMPTY })
    }

    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        let Some(reach) = self.tiles.get(&tile) else { return Ok(None) };
        let lattice = self.patches.lattice();
        let mut gathered = self.patches.take_buffers();
        let put_together = self.put_together(tile, &reach.blocks, &mut gathered);
        let mut content = gathered.surfels(&lattice);
        self.patches.give_back(gathered);
        put_together?;
        for code in &mut content.codes {
            code.voxel[0] -= MARGIN_VOXELS;
            code.voxel[1] -= MARGIN_VOXELS;
        }
        let [x, y] = lattice.tile_corner_m(tile);
        let origin_in_world_m = [x, y, f64::from(content.base_voxel_z) * lattice.voxel_m()];
        let (edge, edge_m) = (lattice.tile_voxels() as i32, lattice.tile_edge_m() as f32);
        let radius_m = lattice.disc_radius_m() as f32;
        let (mut own, mut copies) = (Vec::new(), Vec::new());
        for (code, surfel) in content.codes.iter().zip(content.surfels(&lattice)) {
            if (0..edge).contains(&code.voxel[0]) && (0..edge).contains(&code.voxel[1]) {
                own.push(surfel);
            } else if reaches_into(&surfel, radius_m, edge_m) {
                copies.push(surfel);
            }
        }
        let count = own.len();
        own.append(&mut copies);
        Ok(Some(Tile { id: tile, origin_in_world_m, surfels: own, own: count }))
    }
}

/// Whether a disc reaches into the square from 0 to `edge_m`, or almost.
fn reaches_into(surfel: &Surfel, radius_m: f32, edge_m: f32) -> bool {
    const NEARLY_M: f32 = 1e-3;
    let half = surfel.half_extents_m(radius_m);
    (0..2).all(|k| {
        let centre = surfel.centre_in_tile_m[k];
        centre + half[k] > -NEARLY_M && centre - half[k] < edge_m + NEARLY_M
    })
}
