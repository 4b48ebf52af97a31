//! Merges the voxels of patches into those of a tile.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use dmp_disk::TileId;

use super::block::{Block, PatchVoxel, block_edge_m, covariance_step_units2};
use super::placement::Placement;
use crate::MapError;
use crate::grid::{InVoxel, Lattice, MixHasher, UNITS_PER_M, Voxel, rounded};
use crate::surfels::{TileSurfels, surfels_of_cells};
use crate::voxels::{Moments, VoxelRecord};

/// Voxels around a tile that are merged with it: one cell, for discs from there that reach into it.
pub(super) const MARGIN_VOXELS: i32 = 2;
/// Voxels along the edge of a brick: two cells.
const BRICK_EDGE: u32 = 4;
const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;
const EMPTY: u32 = u32::MAX;

/// Voxels of a tile and around it while they are merged, with memory that is reused.
///
/// They are in bricks, as in a map under construction: neighbouring voxels of a patch are neighbours in the map, and
/// the last brick is found without a search.
#[derive(Debug, Default)]
pub(crate) struct Gathered {
    by_place: HashMap<u64, u32, BuildHasherDefault<MixHasher>>,
    /// The index of a brick's voxels among the records, cell by cell.
    bricks: Vec<[u32; BRICK_VOXELS]>,
    records: Vec<VoxelRecord>,
    /// The last brick.
    last: Option<(u64, u32)>,
    /// The voxels read from patches.
    pub(super) read: Vec<PatchVoxel>,
}

impl Gathered {
    pub(super) fn clear(&mut self) {
        self.by_place.clear();
        self.bricks.clear();
        self.records.clear();
        self.last = None;
        self.read.clear();
    }

    #[inline]
    fn record(&mut self, voxel: Voxel) -> &mut VoxelRecord {
        let Voxel { z, y, x } = voxel;
        let brick = |n: u32| u64::from(n / BRICK_EDGE);
        let key = brick(z as u32) << 32 | brick(y.into()) << 16 | brick(x.into());
        let number = match self.last {
            Some((last, number)) if last == key => number,
            _ => {
                let bricks = &mut self.bricks;
                let number = *self.by_place.entry(key).or_insert_with(|| {
                    bricks.push([EMPTY; BRICK_VOXELS]);
                    (bricks.len() - 1) as u32
                });
                self.last = Some((key, number));
                number
            }
        };
        let slot = &mut self.bricks[number as usize][place_in_brick(voxel)];
        if *slot == EMPTY {
            *slot = self.records.len() as u32;
            self.records.push(VoxelRecord::new(voxel, Moments::default()));
        }
        &mut self.records[*slot as usize]
    }

    /// The voxels, ordered by cell.
    pub(super) fn by_cell(&self) -> impl Iterator<Item = &VoxelRecord> {
        let slots = self.bricks.iter().flatten().filter(|&&slot| slot != EMPTY);
        slots.map(|&slot| &self.records[slot as usize])
    }

    /// Their surfels, in the order of the voxels.
    pub(super) fn surfels(&self, lattice: &Lattice) -> TileSurfels {
        // The height of one of the first voxels: a tile has no typical height.
        let base_voxel_z = self.records.get(self.records.len() / 2).map_or(0, |record| record.voxel().z);
        TileSurfels { base_voxel_z, ..surfels_of_cells(lattice, self.by_cell()) }
    }
}

/// The number of a voxel in its brick: its cell, then the voxel there.
#[inline]
fn place_in_brick(Voxel { z, y, x }: Voxel) -> usize {
    let [x, y, z] = [u32::from(x), u32::from(y), z as u32];
    let cell = (z >> 1 & 1) << 2 | (y >> 1 & 1) << 1 | x >> 1 & 1;
    (cell << 3 | (z & 1) << 2 | (y & 1) << 1 | x & 1) as usize
}

/// A tile and its surroundings.
pub(super) struct Around {
    lattice: Lattice,
    block_edge_m: f64,
    step_units2: f64,
    /// The lowest voxel around the tile, from the origin of voxel indices.
    corner: [u32; 2],
    origin_z: u32,
    /// Voxels along the edge.
    edge: u32,
}

impl Around {
    pub(super) fn of(lattice: Lattice, tile: TileId) -> Result<Self, MapError> {
        let [x, y] = lattice.tile_corner_m(tile);
        // The middle of the tile's first voxel lies in the tile however the corner is rounded.
        let half_m = lattice.voxel_m() / 2.0;
        let [x, y, _] = lattice.in_voxel([x + half_m, y + half_m, 0.0])?.voxel;
        let [_, _, origin_z] = lattice.in_voxel([0.0; 3])?.voxel;
        Ok(Self {
            lattice,
            block_edge_m: block_edge_m(&lattice),
            step_units2: covariance_step_units2(&lattice),
            corner: [x, y].map(|c| c - MARGIN_VOXELS as u32),
            origin_z,
            edge: lattice.tile_voxels() + 2 * MARGIN_VOXELS as u32,
        })
    }

    /// Adds the voxels of a block whose means fall into or around the tile.
    pub(super) fn add(
        &self,
        placement: &Placement,
        block: &Block,
        voxels: &[PatchVoxel],
        gathered: &mut Gathered,
    ) -> Result<(), MapError> {
        let corner_in_world_m = placement.place(block.corner_m(self.block_edge_m));
        let from_corner = Placement { origin_in_world_m: corner_in_world_m, ..*placement };
        for voxel in voxels {
            let mean = from_corner.place(voxel.mean_units.map(|c| f64::from(c) / UNITS_PER_M));
            let InVoxel { voxel: [x, y, z], offset_units } = self.lattice.in_voxel(mean)?;
            let (x, y) = (x.wrapping_sub(self.corner[0]), y.wrapping_sub(self.corner[1]));
            if x >= self.edge || y >= self.edge {
                continue;
            }
            let place = Voxel { z: z.wrapping_sub(self.origin_z) as i32, y: y as u16, x: x as u16 };
            let moments = &mut gathered.record(place).moments;
            let (n, offset) = (i64::from(voxel.count), offset_units.map(i64::from));
            let [x, y, z] = offset;
            moments.count += u64::from(voxel.count);
            for (sum, offset) in moments.sum.iter_mut().zip(offset) {
                *sum += n * offset;
            }
            let squares = [x * x, x * y, x * z, y * y, y * z, z * z];
            for (sum, square) in moments.products.iter_mut().zip(squares) {
                *sum += n * square;
            }
            if voxel.count > 1 {
                let units2 = f64::from(voxel.count) * self.step_units2;
                let covariance = voxel.covariance_steps.map(|c| f64::from(c) * units2);
                for (sum, c) in moments.products.iter_mut().zip(placement.rotate(covariance)) {
                    *sum += rounded(c);
                }
            }
        }
        Ok(())
    }
}
