//! The surfels of a visit, at three sizes of voxels.

use dmp_map::PatchBuilder;

use crate::align::flat::flat;
use crate::align::grid::order_of;
use crate::align::level::{Level, Surfel};

/// Voxels of the finest level along the edge of one of each level, coarse to fine.
pub(crate) const LEVELS: [i32; 3] = [4, 2, 1];
/// Points that a surfel needs.
const LEAST_POINTS: f64 = 5.0;
/// Largest variance across a flat surfel, as a share of that along its narrower direction.
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
    /// Of a patch, whose frame is that of the place. `O(v log v)` time in its voxels; those further than 2²⁰ voxels off along an
    /// axis are excluded.
    pub fn new(patch: &PatchBuilder) -> Self {
        let voxel_m = patch.lattice().voxel_m();
        let of_patch = patch.voxels();
        let mut voxels: Vec<(u64, [i32; 3], Sums)> = Vec::with_capacity(of_patch.len());
        voxels.extend(of_patch.filter_map(|(voxel, points)| {
            let (mean_m, covariance_m2) = (points.mean_m, points.covariance_m2);
            let sums = Sums { points: points.points as f64, mean_m, covariance_m2 };
            Some((order_of(voxel)?, voxel, sums))
        }));
        let mut order: Vec<(u64, u32)> =
            voxels.iter().zip(0..).map(|(voxel, number)| (voxel.0, number)).collect();
        order.sort_unstable();
        let mut sums: Vec<([i32; 3], Sums)> = order
            .iter()
            .map(|&(_, number)| voxels[number as usize])
            .map(|(_, voxel, sums)| (voxel, sums))
            .collect();
        // In this order, what is to be one voxel of twice the edge follows each other.
        let mut levels = Vec::with_capacity(LEVELS.len());
        for (step, &edge) in LEVELS.iter().rev().enumerate() {
            if step > 0 {
                sums = twice_as_coarse(&sums);
            }
            levels.push(level(&sums, f64::from(edge) * voxel_m));
        }
        let [fine, middle, coarse] = [0, 1, 2].map(|k| std::mem::take(&mut levels[k]));
        Self { voxel_m, levels: [coarse, middle, fine] }
    }

    /// Surfels at the finest voxels.
    pub fn surfels(&self) -> usize {
        self.finest().surfels.len()
    }

    pub(crate) fn finest(&self) -> &Level {
        &self.levels[LEVELS.len() - 1]
    }
}

/// The surfels of voxels in the order of the grid.
fn level(sums: &[([i32; 3], Sums)], voxel_m: f64) -> Level {
    let (voxels, surfels): (Vec<_>, Vec<_>) =
        sums.iter().filter_map(|(voxel, sums)| Some((*voxel, sums.surfel(voxel_m)?))).unzip();
    Level::new(voxel_m, &voxels, surfels)
}

/// The sums of voxels of twice the edge, in the order of the grid as well.
fn twice_as_coarse(sums: &[([i32; 3], Sums)]) -> Vec<([i32; 3], Sums)> {
    let twice = |voxel: [i32; 3]| voxel.map(|n| n >> 1);
    let of_voxel = sums.chunk_by(|a, b| twice(a.0) == twice(b.0));
    let whole = |parts: &[([i32; 3], Sums)]| {
        let first = parts[0];
        (twice(first.0), parts[1..].iter().fold(first.1, |sums, (_, more)| sums.and(more)))
    };
    of_voxel.map(whole).collect()
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
        if self.points < LEAST_POINTS {
            return None;
        }
        let (normal, [across_m2, narrow_m2]) = flat(self.covariance_m2, FLAT)?;
        let width_m = WIDE * voxel_m;
        (narrow_m2 > width_m * width_m)
            .then(|| Surfel { across_m2: across_m2 as f32, ..Surfel::new(self.mean_m, normal) })
    }
}
