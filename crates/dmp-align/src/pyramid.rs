//! The surfels of a visit, at three sizes of voxels.

use dmp_map::{PatchBuilder, smallest_eigenvector};

use crate::grid::block_and_bit;
use crate::level::{Level, Surfel};

/// Voxels of the finest level along the edge of one of each level, coarse to fine.
pub(crate) const LEVELS: [i32; 3] = [4, 2, 1];
/// Points that a surfel needs.
const LEAST_POINTS: f64 = 5.0;
/// A surfel is flat: across it there is at most so much of the variance that there is along it, in its narrower direction.
const FLAT: f64 = 0.1;
/// And wide, in parts of its voxel: what is narrower has no direction.
const WIDE: f64 = 0.05;

/// The surfels of a visit to a place, in the place's frame, at voxels of 4, 2 and 1 times the patch's.
#[derive(Debug, Clone)]
pub struct Pyramid {
    /// Edge of the finest voxels, metres.
    pub(crate) voxel_m: f64,
    /// Coarse to fine.
    pub(crate) levels: [Level; LEVELS.len()],
}

/// Sums over the points of a voxel: their number, and of their mean and covariance (xx, xy, xz, yy, yz, zz).
#[derive(Debug, Clone, Copy)]
struct Sums {
    points: f64,
    mean_m: [f64; 3],
    covariance_m2: [f64; 6],
}

impl Pyramid {
    /// Of a patch, whose frame is that of the place. `O(v log v)` time in its voxels.
    pub fn new(patch: &PatchBuilder) -> Self {
        let voxel_m = patch.lattice().voxel_m();
        let fine: Vec<([i32; 3], Sums)> = patch
            .voxels()
            .map(|(voxel, points)| {
                let (mean_m, covariance_m2) = (points.mean_m, points.covariance_m2);
                (voxel, Sums { points: points.points as f64, mean_m, covariance_m2 })
            })
            .collect();
        Self { voxel_m, levels: LEVELS.map(|edge| level(&fine, edge, voxel_m)) }
    }

    /// Surfels at the finest voxels.
    pub fn surfels(&self) -> usize {
        self.finest().surfels.len()
    }

    pub(crate) fn finest(&self) -> &Level {
        &self.levels[LEVELS.len() - 1]
    }
}

/// The surfels of voxels of so many of the finest along their edges.
fn level(fine: &[([i32; 3], Sums)], edge: i32, fine_voxel_m: f64) -> Level {
    let voxel_m = f64::from(edge) * fine_voxel_m;
    let mut parts: Vec<([i32; 3], Sums)> =
        fine.iter().map(|(voxel, sums)| (voxel.map(|n| n.div_euclid(edge)), *sums)).collect();
    // Stable: those of a voxel are summed up in the order of the finest.
    parts.sort_by_key(|(voxel, _)| block_and_bit(*voxel));
    let (mut voxels, mut surfels) = (Vec::new(), Vec::new());
    for of_voxel in parts.chunk_by(|a, b| a.0 == b.0) {
        let sums = of_voxel[1..].iter().fold(of_voxel[0].1, |sums, (_, more)| sums.and(more));
        if let Some(surfel) = sums.surfel(voxel_m) {
            voxels.push(of_voxel[0].0);
            surfels.push(surfel);
        }
    }
    surfels.shrink_to_fit();
    Level::new(voxel_m, &voxels, surfels)
}

impl Sums {
    /// Chan's formula for the sums of two sets of points.
    fn and(self, more: &Self) -> Self {
        let points = self.points + more.points;
        let apart_m: [f64; 3] = std::array::from_fn(|k| more.mean_m[k] - self.mean_m[k]);
        let (mine, theirs) = (self.points / points, more.points / points);
        let [x, y, z] = apart_m;
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        Self {
            points,
            mean_m: std::array::from_fn(|k| self.mean_m[k] + theirs * apart_m[k]),
            covariance_m2: std::array::from_fn(|k| {
                mine * self.covariance_m2[k] + theirs * more.covariance_m2[k] + mine * theirs * products[k]
            }),
        }
    }

    fn surfel(&self, voxel_m: f64) -> Option<Surfel> {
        let (normal, [across, narrow, _]) = smallest_eigenvector(self.covariance_m2);
        let width_m = WIDE * voxel_m;
        let is_flat = narrow > width_m * width_m && across <= FLAT * narrow;
        (self.points >= LEAST_POINTS && is_flat)
            .then(|| Surfel { across_m2: across.max(0.0) as f32, ..Surfel::new(self.mean_m, normal) })
    }
}
