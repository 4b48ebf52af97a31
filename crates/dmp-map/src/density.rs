use crate::{Lattice, MapError};

/// Returns a voxel needs to count as filled.
const FILLED: usize = 3;

/// How many points of a cloud share their voxel with enough others: what decides the voxel edge.
///
/// Order-free; shares of several blocks of scans add up by [`DensityProbe::merge`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DensityProbe {
    points: u64,
    in_filled_voxels: u64,
}

impl DensityProbe {
    /// Counts the points of one block of scans, world metres, on `lattice`. `O(n log n)`, 16 bytes
    /// a point.
    ///
    /// # Errors
    /// When a point lies outside the world.
    pub fn of_block(
        lattice: &Lattice,
        points_in_world_m: impl Iterator<Item = [f64; 3]>,
    ) -> Result<Self, MapError> {
        let mut voxels = Vec::new();
        for point in points_in_world_m {
            let located = lattice.locate(point)?;
            voxels.push((located.tile, located.voxel));
        }
        voxels.sort_unstable();
        let filled = voxels.chunk_by(|a, b| a == b).filter(|voxel| voxel.len() >= FILLED);
        let in_filled_voxels = filled.map(|voxel| voxel.len() as u64).sum();
        Ok(Self { points: voxels.len() as u64, in_filled_voxels })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_in_company_count() {
        let lattice = Lattice::new(0.2).unwrap();
        let crowd = [[0.05; 3], [0.06; 3], [0.07; 3]];
        let pair = [[5.05; 3], [5.06; 3]];
        let mut probe = DensityProbe::of_block(&lattice, crowd.into_iter().chain(pair)).unwrap();
        assert_eq!(probe.filled_share(), Some(0.6));
        probe.merge(&DensityProbe::of_block(&lattice, crowd.into_iter()).unwrap());
        assert_eq!(probe.filled_share(), Some(0.75));
        assert_eq!(DensityProbe::default().filled_share(), None);
    }
}
