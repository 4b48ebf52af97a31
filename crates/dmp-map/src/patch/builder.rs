//! Builds a patch from points.

use super::block::{Block, PatchVoxel, block_voxels, covariance_step_units2};
use super::voxel_sums::VoxelSums;
use crate::MapError;
use crate::grid::{Lattice, UNITS_PER_M};
use crate::voxels::RecentVoxels;

/// Largest distance of points from the patch's origin, metres: far beyond any sensor.
const REACH_M: f64 = 20_000.0;

/// Sums points of a rigid piece of a map by voxels of the piece's own frame.
///
/// Sums are integers, as in a map: the same points give the same patch in any order.
#[derive(Debug)]
pub struct PatchBuilder {
    lattice: Lattice,
    voxels: VoxelSums,
    points: u64,
}

/// The sums of a patch's voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointsOfVoxel {
    /// Number of points.
    pub points: u64,
    /// Their mean, metres from the patch's origin.
    pub mean_m: [f64; 3],
    /// Their covariance, square metres: xx, xy, xz, yy, yz, zz.
    pub covariance_m2: [f64; 6],
}

/// A finished patch: its blocks by position, with their voxels in the same order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Patch {
    pub(crate) blocks: Vec<Block>,
    pub(crate) voxels: Vec<PatchVoxel>,
}

impl PatchBuilder {
    /// A patch without points.
    pub fn new(lattice: Lattice) -> Self {
        Self { lattice, voxels: VoxelSums::default(), points: 0 }
    }

    /// Removes all points; the memory is kept.
    pub fn clear(&mut self) {
        self.voxels.clear();
        self.points = 0;
    }

    /// Points added so far.
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Adds points, metres in the frame of the patch. `O(n)`.
    ///
    /// # Errors
    /// When a point is not finite or more than 20 km from the patch's origin; then none is added.
    pub fn add(&mut self, points_in_patch_m: &[[f64; 3]]) -> Result<(), MapError> {
        let is_within = |point: &[f64; 3]| point.iter().all(|c| c.abs() <= REACH_M);
        if let Some(&outside) = points_in_patch_m.iter().find(|point| !is_within(point)) {
            return Err(MapError::OutOfWorld { point_in_world_m: outside, limit_m: REACH_M });
        }
        let origin = self.lattice.in_voxel([0.0; 3])?.voxel;
        let Self { lattice, voxels, .. } = self;
        RecentVoxels::default().add(lattice, points_in_patch_m, |voxel, sums| {
            voxels.add(std::array::from_fn(|k| voxel[k].wrapping_sub(origin[k]) as i32), &sums);
        })?;
        self.points += points_in_patch_m.len() as u64;
        Ok(())
    }

    /// The grid of its voxels, whose corner is the patch's origin.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Its voxels, x, y and z from the patch's origin, with their sums. Their order depends on the order in which
    /// points were added.
    pub fn voxels(&self) -> impl ExactSizeIterator<Item = ([i32; 3], PointsOfVoxel)> {
        let edge_units = f64::from(self.lattice.voxel_units());
        self.voxels.iter().map(move |(voxel, moments)| {
            let mean = moments.mean_units();
            let mean_m = std::array::from_fn(|k| (f64::from(voxel[k]) * edge_units + mean[k]) / UNITS_PER_M);
            let covariance_m2 = moments.covariance_units2().map(|c| c / (UNITS_PER_M * UNITS_PER_M));
            (voxel, PointsOfVoxel { points: moments.count, mean_m, covariance_m2 })
        })
    }

    /// Adds the points of another part of the same patch.
    pub fn merge(&mut self, other: Self) {
        self.points += other.points;
        if self.voxels.is_empty() {
            self.voxels = other.voxels;
        } else {
            self.voxels.merge(&other.voxels);
        }
    }

    pub(crate) fn finish(self) -> Patch {
        let Self { lattice, voxels, .. } = self;
        let edge = block_voxels(&lattice);
        let place = |[x, y, z]: [i32; 3]| [y, x, z].map(|n| n.div_euclid(edge));
        let mut voxels: Vec<_> = voxels.iter().map(|voxel| (place(voxel.0), voxel)).collect();
        voxels.sort_unstable_by_key(|&(place, ([x, y, z], _))| (place, [z, y, x]));
        let step_units2 = covariance_step_units2(&lattice);
        let mut patch = Patch { blocks: Vec::new(), voxels: Vec::with_capacity(voxels.len()) };
        for of_block in voxels.chunk_by(|a, b| a.0 == b.0) {
            let first = patch.voxels.len();
            patch.voxels.extend(of_block.iter().map(|(_, (voxel, moments))| {
                let mean = moments.mean_units();
                let [x, y, z] =
                    voxel.map(|n| f64::from(n.rem_euclid(edge)) * f64::from(lattice.voxel_units()));
                PatchVoxel {
                    // A whole number of voxels of whole units: below 2¹⁶.
                    mean_units: [x + mean[0], y + mean[1], z + mean[2]].map(|c| c.round() as u16),
                    count: moments.count.min(u64::from(u16::MAX)) as u16,
                    covariance_steps: moments.covariance_units2().map(|c| (c / step_units2).round() as i16),
                }
            }));
            let means = || patch.voxels[first..].iter().map(|voxel| voxel.mean_units);
            let bound = |start: u16, of: fn(u16, u16) -> u16| {
                means().fold([start; 3], |bound, mean| std::array::from_fn(|k| of(bound[k], mean[k])))
            };
            patch.blocks.push(Block {
                place: of_block[0].0,
                low_units: bound(u16::MAX, u16::min),
                high_units: bound(0, u16::max),
                first: first as u32,
                voxels: of_block.len() as u32,
            });
        }
        patch
    }
}
