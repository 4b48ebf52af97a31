//! How densely points fill the voxels of a grid.

use dmp_disk::TileId;

use crate::lattice::Voxel;
use crate::{Lattice, MapError};

/// Returns a voxel needs to count as filled.
const FILLED: usize = 3;

/// How many points share their voxel with enough others: what decides the voxel edge.
///
/// Points are gathered in blocks; a block is a stretch of the drive, whose points are counted together.
/// Order-free within a block. 16 bytes a point of one block.
#[derive(Debug, Clone)]
pub struct DensityProbe {
    lattice: Lattice,
    block: Vec<(TileId, Voxel)>,
    points: u64,
    in_filled_voxels: u64,
}

impl DensityProbe {
    /// A probe on `lattice`, for blocks of `block_points`.
    pub fn new(lattice: Lattice, block_points: usize) -> Self {
        Self { lattice, block: Vec::with_capacity(block_points), points: 0, in_filled_voxels: 0 }
    }

    /// Adds a point of the block, world metres.
    ///
    /// # Errors
    /// When the point lies outside the world.
    pub fn add(&mut self, point_in_world_m: [f64; 3]) -> Result<(), MapError> {
        self.block.push(self.lattice.locate(point_in_world_m)?);
        Ok(())
    }

    /// Ends the block and counts it. `O(n log n)`.
    pub fn end_block(&mut self) {
        self.block.sort_unstable();
        let filled = self.block.chunk_by(|a, b| a == b).filter(|voxel| voxel.len() >= FILLED);
        self.in_filled_voxels += filled.map(|voxel| voxel.len() as u64).sum::<u64>();
        self.points += self.block.len() as u64;
        self.block.clear();
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
        for point in [[0.05; 3], [5.05; 3], [0.06; 3], [5.06; 3], [0.07; 3]] {
            probe.add(point).unwrap();
        }
        probe.end_block();
        assert_eq!(probe.filled_share(), 0.6);
        // A third point beside the pair comes too late: it belongs to another block.
        probe.add([5.07; 3]).unwrap();
        probe.end_block();
        assert_eq!(probe.filled_share(), 0.5);
        assert!(probe.add([f64::NAN; 3]).is_err());
    }
}
