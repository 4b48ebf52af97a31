//! Measures how densely points fill the voxels of a grid.

use std::sync::{Mutex, PoisonError};

use dmp_disk::TileId;
use rayon::slice::ParallelSliceMut as _;

use crate::lattice::Voxel;
use crate::{Lattice, MapError};

/// Returns a voxel needs to count as filled.
const FILLED: usize = 3;

/// Measures the share of points in sufficiently filled voxels: it decides the voxel edge.
///
/// Points are collected in blocks; a block is a stretch of the drive whose points are counted together. The order
/// within a block is irrelevant, and any thread may add to it. Needs 16 bytes per point of one block.
#[derive(Debug)]
pub struct DensityProbe {
    lattice: Lattice,
    block: Mutex<Vec<(TileId, Voxel)>>,
    points: u64,
    in_filled_voxels: u64,
}

impl DensityProbe {
    /// A probe on `lattice`, for blocks of `block_points`.
    pub fn new(lattice: Lattice, block_points: usize) -> Self {
        let block = Mutex::new(Vec::with_capacity(block_points));
        Self { lattice, block, points: 0, in_filled_voxels: 0 }
    }

    /// Adds points of the block, world metres.
    ///
    /// # Errors
    /// When a point lies outside the world; then none is added.
    pub fn add(&self, points_in_world_m: impl Iterator<Item = [f64; 3]>) -> Result<(), MapError> {
        let located: Vec<_> =
            points_in_world_m.map(|point| self.lattice.locate(point)).collect::<Result<_, _>>()?;
        self.block.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(&located);
        Ok(())
    }

    /// Ends the block and counts it, on the threads of the current pool. `O(n log n)`.
    pub fn end_block(&mut self) {
        let block = self.block.get_mut().unwrap_or_else(PoisonError::into_inner);
        block.par_sort_unstable();
        let filled = block.chunk_by(|a, b| a == b).filter(|voxel| voxel.len() >= FILLED);
        self.in_filled_voxels += filled.map(|voxel| voxel.len() as u64).sum::<u64>();
        self.points += block.len() as u64;
        block.clear();
    }

    /// Share of the points of all blocks that lie in voxels with three or more; 0 without points.
    pub fn filled_share(&self) -> f64 {
        if self.points == 0 { 0.0 } else { self.in_filled_voxels as f64 / self.points as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_in_company_count_and_blocks_keep_to_themselves() {
        let mut probe = DensityProbe::new(Lattice::new(0.2).unwrap(), 5);
        assert_eq!(probe.filled_share(), 0.0);
        probe.add([[0.05; 3], [5.05; 3], [0.06; 3]].into_iter()).unwrap();
        probe.add([[5.06; 3], [0.07; 3]].into_iter()).unwrap();
        probe.end_block();
        assert_eq!(probe.filled_share(), 0.6);
        // A third point in the voxel comes too late: it belongs to another block.
        probe.add([[5.07; 3]].into_iter()).unwrap();
        probe.end_block();
        assert_eq!(probe.filled_share(), 0.5);
        assert!(probe.add([[0.05; 3], [f64::NAN; 3]].into_iter()).is_err());
        probe.end_block();
        assert_eq!(probe.filled_share(), 0.5);
    }
}
