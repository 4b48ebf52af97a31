//! The sums of a voxel in few bytes while they are small.

use super::moments::Moments;
use crate::Support;

/// Count, Σp and Σppᵀ of a voxel's points in 32 bits each, two to a word: the first in the lower half.
///
/// n and x, y and z, xx and xy, yy and yz, zz and xz. So one multiplication gives two products. As long as no lower
/// half overflows, one addition adds two sums.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct PackedSums([u64; 5]);

/// Sums with this bit in a lower half must be carried.
const FULL: u64 = 1 << 31;

impl PackedSums {
    /// Adds a point.
    #[inline]
    pub(crate) fn add_point(&mut self, offset_units: [u16; 3]) {
        let [x, y, z] = offset_units.map(u64::from);
        let terms = [1 | x << 32, y | z << 32, x * (x | y << 32), y * (y | z << 32), z * (z | x << 32)];
        self.add(&Self(terms));
    }

    #[inline]
    fn add(&mut self, other: &Self) {
        for (sum, theirs) in self.0.iter_mut().zip(other.0) {
            *sum += theirs;
        }
    }

    /// These sums, or none.
    #[inline]
    pub(crate) fn only_if(self, kept: bool) -> Self {
        let mask = u64::from(kept).wrapping_neg();
        Self(self.0.map(|pair| pair & mask))
    }

    /// The number of points.
    #[inline]
    pub(crate) fn count(&self) -> u32 {
        self.0[0] as u32
    }

    /// Number of points in voxels of `voxel_units` that certainly leave [`FULL`] unset.
    pub(crate) fn most_points(voxel_units: u32) -> u32 {
        let offset = u64::from(voxel_units).max(2) - 1;
        ((FULL - 1) / (offset * offset)) as u32
    }

    /// The sums, unpacked; nobody saw them.
    #[inline]
    pub(crate) fn widened(&self) -> Moments {
        let [[n, x], [y, z], [xx, xy], [yy, yz], [zz, xz]] =
            self.0.map(|pair| [pair & u64::from(u32::MAX), pair >> 32].map(|sum| sum as i64));
        let products = [xx, xy, xz, yy, yz, zz];
        Moments { count: n as u64, sum: [x, y, z], products, support: Support::default() }
    }

    /// Checking the count and the squares suffices: Σx ≤ Σxx, and 2 Σxy ≤ Σxx + Σyy.
    #[inline]
    fn is_full(&self) -> bool {
        let [n, _, xx, yy, zz] = self.0;
        (n | xx | yy | zz) & FULL != 0
    }
}

/// [`Moments`] while points are added: in 32 bits, so that an addition touches one cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct NarrowMoments {
    sums: PackedSums,
    support: Support,
}

impl NarrowMoments {
    /// Adds points seen in `segment`, whose sums are not full. Returns whether the sums must be carried before the next
    /// addition.
    #[inline]
    #[must_use]
    pub(crate) fn add(&mut self, points: &PackedSums, segment: Option<i32>) -> bool {
        self.sums.add(points);
        if let Some(segment) = segment {
            self.support.add_times(segment, points.count());
        }
        self.sums.is_full()
    }

    #[inline]
    pub(crate) fn count(&self) -> u32 {
        self.sums.count()
    }

    /// The sums, which are not full.
    #[inline]
    pub(crate) fn packed(&self) -> &PackedSums {
        &self.sums
    }

    /// Returns the sums and resets them.
    pub(crate) fn carry(&mut self) -> Moments {
        std::mem::take(self).widened()
    }

    #[inline]
    pub(crate) fn widened(&self) -> Moments {
        Moments { support: self.support, ..self.sums.widened() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_sums_are_carried_before_they_overflow() {
        for (voxel_units, offset) in [
            (410, [0u16; 3]),
            (410, [1, 0, 0]),
            (16_384, [16_383, 16_383, 16_383]),
            (16_384, [16_383, 0, 1638]),
            (1638, [410; 3]),
            (1638, [1637; 3]),
        ] {
            let most = PackedSums::most_points(voxel_units);
            for together in [1, 3, most - 1, most] {
                let (mut narrow, mut carried) = (NarrowMoments::default(), Moments::default());
                let mut expected = Moments::default();
                for at in (0..40_000).step_by(together as usize) {
                    let mut points = PackedSums::default();
                    for _ in 0..together.min(40_000 - at) {
                        points.add_point(offset);
                        expected.add(offset.map(u32::from), Some(7));
                    }
                    assert!(!points.is_full());
                    if narrow.add(&points, Some(7)) {
                        carried.merge(&narrow.carry());
                    }
                }
                carried.merge(&narrow.carry());
                assert_eq!(carried, expected);
            }
        }
        let mut full = NarrowMoments { sums: PackedSums([FULL - 1, 0, 0, 0, 0]), ..NarrowMoments::default() };
        let mut point = PackedSums::default();
        point.add_point([0; 3]);
        assert!(full.add(&point, None));
    }
}
