//! Sums over the points of a voxel as exact integers.

use crate::Support;
use crate::grid::Voxel;

/// Exact sums over the points of one voxel: count, Σp, Σppᵀ in lattice units from the voxel's lowest corner, and the
/// segments of the observations.
///
/// Integers add in any order to the same value, so maps merge exactly. Offsets stay below 2¹⁴ units (voxels up to 2 m),
/// their products below 2²⁸, or 2³⁰ relative to a cell of eight voxels: 63 bits hold 2³³ points in one cell. They are
/// signed, since points of a patch may lie beside the voxel to which they are added.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    bytemuck::Pod,
    bytemuck::Zeroable,
    serde::Serialize,
    serde::Deserialize,
)]
#[repr(C)]
pub(crate) struct Moments {
    pub(crate) count: u64,
    pub(crate) sum: [i64; 3],
    /// xx, xy, xz, yy, yz, zz.
    pub(crate) products: [i64; 6],
    pub(crate) support: Support,
}

impl Moments {
    #[cfg(test)]
    pub(crate) fn add(&mut self, offset_units: [u32; 3], segment: Option<i32>) {
        let [x, y, z] = offset_units.map(i64::from);
        self.count += 1;
        self.sum[0] += x;
        self.sum[1] += y;
        self.sum[2] += z;
        for (sum, product) in self.products.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += product;
        }
        if let Some(segment) = segment {
            self.support.add(segment);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.merge_shifted(other, [0; 3]);
        self.support.merge(&other.support);
    }

    /// Adds the sums of `other` relative to a corner `shift_units` below its own; support is not merged.
    /// Σ(p + a)(p + a)ᵀ = Σppᵀ + aΣpᵀ + Σp aᵀ + n aaᵀ.
    pub(crate) fn merge_shifted(&mut self, other: &Self, shift_units: [i64; 3]) {
        let n = other.count as i64;
        let [x, y, z] = other.sum;
        let [a, b, c] = shift_units;
        self.count += other.count;
        self.sum[0] += x + n * a;
        self.sum[1] += y + n * b;
        self.sum[2] += z + n * c;
        let p = other.products;
        let shifted = [
            p[0] + 2 * a * x + n * a * a,
            p[1] + a * y + b * x + n * a * b,
            p[2] + a * z + c * x + n * a * c,
            p[3] + 2 * b * y + n * b * b,
            p[4] + b * z + c * y + n * b * c,
            p[5] + 2 * c * z + n * c * c,
        ];
        for (sum, product) in self.products.iter_mut().zip(shifted) {
            *sum += product;
        }
    }

    /// Mean offset from the corner, lattice units; the sums are exact, only the division rounds.
    pub(crate) fn mean_units(&self) -> [f64; 3] {
        self.sum.map(|s| s as f64 / self.count as f64)
    }

    /// Covariance xx, xy, xz, yy, yz, zz in squared units, from an exact integer numerator: no
    /// cancellation, however flat the cloud.
    pub(crate) fn covariance_units2(&self) -> [f64; 6] {
        let n = i128::from(self.count);
        let [x, y, z] = self.sum.map(i128::from);
        let squares = [x * x, x * y, x * z, y * y, y * z, z * z];
        let scale = (self.count as f64) * (self.count as f64);
        std::array::from_fn(|k| (n * i128::from(self.products[k]) - squares[k]) as f64 / scale)
    }
}

/// A voxel with its sums, as spilled to disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct VoxelRecord {
    z: i32,
    y: u16,
    x: u16,
    pub(crate) moments: Moments,
}

impl VoxelRecord {
    pub(crate) fn new(voxel: Voxel, moments: Moments) -> Self {
        Self { z: voxel.z, y: voxel.y, x: voxel.x, moments }
    }

    pub(crate) fn voxel(&self) -> Voxel {
        Voxel { z: self.z, y: self.y, x: self.x }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(points: &[([u32; 3], i32)]) -> Moments {
        let mut moments = Moments::default();
        points.iter().for_each(|&(p, s)| moments.add(p, Some(s)));
        moments
    }

    proptest! {
        #[test]
        fn parts_merge_to_the_whole_and_shifts_are_exact(
            points in prop::collection::vec((prop::array::uniform3(0u32..8192), 0..9i32), 1..40),
            cut in 0usize..40, shift in prop::array::uniform3(0u32..8192),
        ) {
            let cut = cut.min(points.len());
            let mut merged = of(&points[cut..]);
            merged.merge(&of(&points[..cut]));
            prop_assert_eq!(merged, of(&points));

            let moved: Vec<_> = points.iter().map(|(p, s)| ([p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]], *s)).collect();
            let mut shifted = Moments::default();
            shifted.merge_shifted(&of(&points), shift.map(i64::from));
            prop_assert_eq!((shifted.sum, shifted.products), (of(&moved).sum, of(&moved).products));

            let n = points.len() as f64;
            let mean: [f64; 3] = std::array::from_fn(|k| points.iter().map(|p| f64::from(p.0[k])).sum::<f64>() / n);
            let variance_x = points.iter().map(|p| (f64::from(p.0[0]) - mean[0]).powi(2)).sum::<f64>() / n;
            prop_assert!((merged.mean_units()[1] - mean[1]).abs() < 1e-6);
            prop_assert!((merged.covariance_units2()[0] - variance_x).abs() <= 1e-6 * (1.0 + variance_x));
        }
    }
}
