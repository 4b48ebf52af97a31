//! The stored form of a patch: voxels, and the blocks that contain them.

use crate::grid::{Lattice, UNITS_PER_M};

/// The sums of one voxel of a finished patch.
///
/// 20 bytes. A mean is rounded to a lattice unit, a covariance to 2⁻¹⁵ of its largest possible value. More than 65,535
/// points count as that number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PatchVoxel {
    /// Lattice units from the block's lowest corner.
    pub(super) mean_units: [u16; 3],
    pub(super) count: u16,
    /// xx, xy, xz, yy, yz, zz, in [`covariance_step_units2`].
    pub(super) covariance_steps: [i16; 6],
}

/// Neighbouring voxels of a patch: a cube of some eight metres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    /// Its lowest corner, in blocks from the patch's origin: y, x, z, so that the blocks of a column, and of
    /// neighbouring columns, are consecutive.
    pub(super) place: [i32; 3],
    /// Bounds of the means, lattice units from the block's lowest corner.
    pub(super) low_units: [u16; 3],
    pub(super) high_units: [u16; 3],
    /// Its voxels among those of the patch.
    pub(super) first: u32,
    pub(super) voxels: u32,
}

/// Voxels along the edge of a block: as many as 16-bit positions allow.
pub(super) fn block_voxels(lattice: &Lattice) -> i32 {
    ((1u32 << 16) / lattice.voxel_units()) as i32
}

pub(super) fn block_edge_m(lattice: &Lattice) -> f64 {
    f64::from(block_voxels(lattice)) * lattice.voxel_m()
}

/// The rounding step of covariances: points of a voxel of edge v have variances of at most v²/4.
pub(super) fn covariance_step_units2(lattice: &Lattice) -> f64 {
    let half = f64::from(lattice.voxel_units()) / 2.0;
    half * half / f64::from(i16::MAX)
}

impl Block {
    /// Its lowest corner in the patch, metres.
    pub(super) fn corner_m(&self, edge_m: f64) -> [f64; 3] {
        let [y, x, z] = self.place;
        [x, y, z].map(|n| f64::from(n) * edge_m)
    }

    /// Lowest and highest position of a mean in the patch, metres.
    pub(super) fn bounds_m(&self, edge_m: f64) -> [[f64; 3]; 2] {
        let corner = self.corner_m(edge_m);
        [self.low_units, self.high_units]
            .map(|units| std::array::from_fn(|k| corner[k] + f64::from(units[k]) / UNITS_PER_M))
    }
}
