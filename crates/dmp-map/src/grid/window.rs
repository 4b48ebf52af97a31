//! Locates points in voxels, several at a time.

use super::integers::SHIFT;
use super::lattice::{Lattice, UNITS_PER_M};
use crate::MapError;

/// Points that are located together.
pub(crate) const TOGETHER: usize = 64;
/// Lattice units along an edge: more than 8 km.
const EDGE_UNITS: u64 = 1 << 26;
/// Bits of a voxel's index along an axis: voxels have 82 units or more.
const INDEX_BITS: u32 = 20;
const OFFSET_BITS: u32 = 16;

/// A part of the world around a position, in which a voxel is one number and points are located several at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    lattice: Lattice,
    /// The voxel in its lowest corner.
    corner: [u32; 3],
    /// The bits of [`SHIFT`] and the units of the corner.
    corner_bits: [u64; 3],
    /// Replaces a division: with as many extra bits as the units and a voxel's edge have together, the quotient is
    /// exact, as that of [`Lattice`].
    factor: u32,
    factor_bits: u32,
}

/// Points in a window: the voxel's number and the offset of each.
#[derive(Debug)]
pub(crate) struct Located {
    pub(crate) voxels: [u64; TOGETHER],
    pub(crate) offsets: [u64; TOGETHER],
}

impl Window {
    /// The window around a position.
    ///
    /// # Errors
    /// When the position is outside the world.
    pub(crate) fn around(lattice: Lattice, place_in_world_m: [f64; 3]) -> Result<Self, MapError> {
        let edge = u64::from(lattice.voxel_units());
        let half = (EDGE_UNITS / 2 / edge) as u32;
        lattice.in_voxel(place_in_world_m)?;
        // The whole window is in the world, and so is everything in it.
        let limit_m = lattice.world_limit_m() - EDGE_UNITS as f64 / UNITS_PER_M;
        let middle = lattice.in_voxel(place_in_world_m.map(|c| c.clamp(-limit_m, limit_m)))?;
        let corner = middle.voxel.map(|voxel| voxel - half);
        let corner_bits = corner
            .map(|voxel| (SHIFT.to_bits() + u64::from(voxel) * edge).wrapping_sub(lattice.origin_units()));
        let factor_bits = EDGE_UNITS.ilog2() + edge.ilog2() + 1;
        let factor = ((1 << factor_bits) / edge + 1) as u32;
        Ok(Self { lattice, corner, corner_bits, factor, factor_bits })
    }

    /// Locates points like [`Lattice::in_voxel`], if possible: all must be in the window, and none half-way between two
    /// lattice points.
    #[inline]
    pub(crate) fn locate(&self, points_in_world_m: &[[f64; 3]; TOGETHER], found: &mut Located) -> bool {
        let edge = u64::from(self.lattice.voxel_units());
        let (factor, factor_bits) = (u64::from(self.factor), self.factor_bits);
        let mut unlike = 0;
        found.voxels.fill(0);
        found.offsets.fill(0);
        for k in 0..3 {
            let (index_shift, offset_shift) = (k as u32 * INDEX_BITS, k as u32 * OFFSET_BITS);
            for ((point, voxel), offset) in
                points_in_world_m.iter().zip(&mut found.voxels).zip(&mut found.offsets)
            {
                let x = point[k] * UNITS_PER_M;
                let shifted = x + SHIFT;
                let is_half = (x - (shifted - SHIFT)).abs() == 0.5;
                let units = shifted.to_bits().wrapping_sub(self.corner_bits[k]);
                unlike |= (units / EDGE_UNITS) | u64::from(is_half);
                // 32 bits by 32 bits: available in all vector instruction sets.
                let units = units % EDGE_UNITS;
                let index = (units * factor) >> factor_bits;
                *voxel |= index << index_shift;
                *offset |= (units - (index & 0xffff_ffff) * edge) << offset_shift;
            }
        }
        unlike == 0
    }

    /// The grid it belongs to.
    pub(crate) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The number of a voxel; `None` unless the voxel is wholly in the window.
    pub(crate) fn number(&self, voxel: [u32; 3]) -> Option<u64> {
        let indices = [0, 1, 2].map(|k| u64::from(voxel[k].wrapping_sub(self.corner[k])));
        let last = EDGE_UNITS / u64::from(self.lattice.voxel_units()) - 1;
        let [x, y, z] = indices;
        indices.iter().all(|&index| index <= last).then_some(x | y << INDEX_BITS | z << (2 * INDEX_BITS))
    }

    /// The voxel of a number.
    #[inline]
    pub(crate) fn voxel(&self, number: u64) -> [u32; 3] {
        let index = |k: u32| (number >> (k * INDEX_BITS)) as u32 & ((1 << INDEX_BITS) - 1);
        [self.corner[0] + index(0), self.corner[1] + index(1), self.corner[2] + index(2)]
    }
}

/// The offset in [`Located`], unpacked.
#[inline]
pub(crate) fn unpacked(offset: u64) -> [u16; 3] {
    [0, 1, 2].map(|k| (offset >> (k * OFFSET_BITS)) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn points_are_located_as_one_by_one(
            voxel_m in 0.05..2.0_f64, room in any::<bool>(), place in prop::array::uniform3(-0.98..0.98_f64),
            spread_m in prop::sample::select(vec![0.5, 100.0, 4000.0, 5000.0]), halves in any::<bool>(),
            steps in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), TOGETHER),
        ) {
            let lattice = Lattice::new(if room { 0.01 + 0.025 * voxel_m } else { voxel_m }).unwrap();
            let place = place.map(|c| c * lattice.world_limit_m());
            let window = Window::around(lattice, place).unwrap();
            let round = |c: f64| if halves { (c * UNITS_PER_M).floor() / UNITS_PER_M } else { c };
            let mut points = [[0.0; 3]; TOGETHER];
            for (point, step) in points.iter_mut().zip(steps) {
                *point = std::array::from_fn(|k| round(place[k] + spread_m * step[k]));
            }
            if halves {
                points[TOGETHER / 2][1] += 0.5 / UNITS_PER_M;
            }
            let mut found = Located { voxels: [0; TOGETHER], offsets: [0; TOGETHER] };
            let all = window.locate(&points, &mut found);
            let is_half = |c: &f64| (c * UNITS_PER_M).fract().abs() == 0.5;
            prop_assert!(spread_m > 4000.0 || all != points.iter().flatten().any(is_half));
            for ((point, &voxel), &offset) in points.iter().zip(&found.voxels).zip(&found.offsets) {
                let expected = lattice.in_voxel(*point).unwrap();
                if let Some(number) = window.number(expected.voxel) {
                    prop_assert_eq!(window.voxel(number), expected.voxel);
                }
                if all {
                    prop_assert_eq!(window.voxel(voxel), expected.voxel);
                    prop_assert_eq!(unpacked(offset), expected.offset_units);
                }
            }
        }
    }

    #[test]
    fn what_is_outside_has_no_number_and_is_not_located() {
        let lattice = Lattice::new(0.2).unwrap();
        let window = Window::around(lattice, [1e6, 2e6, 0.0]).unwrap();
        let mut found = Located { voxels: [0; TOGETHER], offsets: [0; TOGETHER] };
        assert!(window.locate(&[[1e6, 2e6, 0.0]; TOGETHER], &mut found));
        for outside in [[1e6, 2.005e6, 0.0], [-1e6, 2e6, 0.0], [1e6, 2e6, 4200.0], [1e6, 2e6, -4200.0]] {
            assert_eq!(window.number(lattice.in_voxel(outside).unwrap().voxel), None);
            let mut points = [[1e6, 2e6, 0.0]; TOGETHER];
            points[17] = outside;
            assert!(!window.locate(&points, &mut found));
        }
        for outside in [f64::NAN, f64::INFINITY, -6e7, 1e300] {
            let mut points = [[1e6, 2e6, 0.0]; TOGETHER];
            points[17][2] = outside;
            assert!(!window.locate(&points, &mut found));
            assert!(Window::around(lattice, points[17]).is_err());
        }
    }
}
