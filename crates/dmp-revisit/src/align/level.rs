//! Surfels of voxels of one size, and which is the nearest.

use dmp_sensor::Vector3;

use crate::align::grid::{Grid, order_of};

/// Normals are alike within 32°.
pub(crate) const ALIKE: f32 = 0.85;
/// The number of no surfel.
pub(crate) const NONE: u32 = u32::MAX;
/// The nearest surfel is mostly as near as this, voxels: looked for here first.
const NEAR: f64 = 0.75;
/// Tolerance for rounding of means in their voxels, voxels.
const SLACK: f64 = 1e-3;

/// Surfels of voxels of one size.
#[derive(Debug, Clone, Default)]
pub(crate) struct Level {
    voxel_m: f64,
    /// Voxels in a metre.
    per_m: f64,
    /// In the order of the grid.
    pub(crate) surfels: Vec<Surfel>,
    /// By the voxels of their means.
    grid: Grid,
}

/// A flat piece of a surface. Of 100 m, 32 bits leave some micrometres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfel {
    pub(crate) mean_m: [f32; 3],
    /// Unit length, of either sign.
    pub(crate) normal: [f32; 3],
    /// Variance across, square metres.
    pub(crate) across_m2: f32,
}

impl Surfel {
    pub(crate) fn new(mean_m: [f64; 3], normal: [f64; 3]) -> Self {
        Self { mean_m: mean_m.map(|n| n as f32), normal: normal.map(|n| n as f32), across_m2: 0.0 }
    }

    #[inline]
    pub(crate) fn mean_m(&self) -> Vector3<f64> {
        Vector3::from(self.mean_m.map(f64::from))
    }

    #[inline]
    pub(crate) fn normal(&self) -> Vector3<f64> {
        Vector3::from(self.normal.map(f64::from))
    }

    #[inline]
    pub(crate) fn distance_m2(&self, other: &Self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|k| self.mean_m[k] - other.mean_m[k]);
        x * x + y * y + z * z
    }

    #[inline]
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let [x, y, z] = [0, 1, 2].map(|k| self.normal[k] * other.normal[k]);
        (x + y + z).abs() > ALIKE
    }
}

impl Level {
    /// Of surfels by their voxels, these in the order of the grid.
    pub(crate) fn new(voxel_m: f64, voxels: &[[i32; 3]], surfels: Vec<Surfel>) -> Self {
        debug_assert!(voxels.is_sorted_by_key(|&voxel| order_of(voxel)));
        Self { voxel_m, per_m: voxel_m.recip(), grid: Grid::new(voxels), surfels }
    }

    /// The number of the surfel nearest to `sought`, within `reach_m` of it, whose normal is alike; of two that are as near,
    /// the first. [`NONE`] where there is none.
    ///
    /// `known`, a surfel that may be near, only makes it faster: no other is looked for than nearer ones.
    #[inline]
    pub(crate) fn nearest(&self, sought: &Surfel, reach_m: f64, known: u32) -> u32 {
        let mut best = Nearest { number: NONE, m2: (reach_m * reach_m) as f32 };
        if let Some(surfel) = self.surfels.get(known as usize) {
            best.compare(sought, surfel, known);
        }
        if best.number != NONE {
            self.search(sought, f64::from(best.m2.sqrt()), &mut best);
            return best.number;
        }
        let near_m = NEAR * self.voxel_m;
        if near_m < reach_m {
            let mut near = Nearest { number: NONE, m2: (near_m * near_m) as f32 };
            self.search(sought, near_m, &mut near);
            if near.number != NONE {
                return near.number;
            }
        }
        self.search(sought, reach_m, &mut best);
        best.number
    }

    /// Among the surfels of a box about the place.
    #[inline]
    fn search(&self, sought: &Surfel, reach_m: f64, best: &mut Nearest) {
        let reach = reach_m * self.per_m + SLACK;
        let place = sought.mean_m.map(|n| f64::from(n) * self.per_m);
        let [low, high] = [-reach, reach].map(|reach| place.map(|n| floor(n + reach)));
        self.grid.each_in(low, high, |number| {
            best.compare(sought, &self.surfels[number as usize], number);
        });
    }
}

/// The nearest so far, or how near one must be.
struct Nearest {
    number: u32,
    m2: f32,
}

impl Nearest {
    #[inline]
    fn compare(&mut self, sought: &Surfel, surfel: &Surfel, number: u32) {
        let m2 = surfel.distance_m2(sought);
        let is_nearer = m2 < self.m2 || (m2 == self.m2 && self.number != NONE && number < self.number);
        if is_nearer && surfel.is_like(sought) {
            *self = Self { number, m2 };
        }
    }
}

/// A cast and a comparison: [`f64::floor`] is a call where processors need not have it as an instruction.
#[inline]
fn floor(value: f64) -> i32 {
    let whole = value as i32;
    if f64::from(whole) > value { whole.saturating_sub(1) } else { whole }
}
