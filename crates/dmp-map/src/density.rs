use std::collections::HashMap;

use crate::{Lattice, MapError};

/// Returns a voxel needs to count as filled.
const FILLED: u32 = 3;

/// How many points of a cloud share their voxel with enough others: what decides the voxel edge.
///
/// Order-free; shares of several blocks of scans add up by [`DensityProbe::merge`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DensityProbe {
    points: u64,
    in_filled_voxels: u64,
}

impl DensityProbe {
    /// Counts the points of one block of scans, world metres, on `lattice`. `O(points)`.
    ///
    /// # Errors
    /// When a point lies outside the world.
    pub fn of_block(
        lattice: &Lattice,
        points_in_world_m: impl Iterator<Item = [f64; 3]>,
    ) -> Result<Self, MapError> {
        let mut voxels = HashMap::new();
        let mut points = 0;
        for point in points_in_world_m {
            let located = lattice.locate(point)?;
            *voxels.entry((located.tile, located.voxel)).or_insert(0u32) += 1;
            points += 1;
        }
        let in_filled_voxels = voxels.values().filter(|&&n| n >= FILLED).map(|&n| u64::from(n)).sum();
        Ok(Self { points, in_filled_voxels })
    }

    /// Adds another block's counts.
    pub fn merge(&mut self, other: &Self) {
        self.points += other.points;
        self.in_filled_voxels += other.in_filled_voxels;
    }

    /// Share of the points that lie in voxels with three or more; `None` without points.
    pub fn filled_share(&self) -> Option<f64> {
        (self.points > 0).then(|| self.in_filled_voxels as f64 / self.points as f64)
    }
}
