//! The voxel sums of a patch under construction.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::grid::MixHasher;
use crate::voxels::{Moments, NarrowMoments, PackedSums};

/// Sums by voxel, in the order of first use.
#[derive(Debug, Default)]
pub(super) struct VoxelSums {
    by_voxel: HashMap<(u64, i32), u32, BuildHasherDefault<MixHasher>>,
    /// x, y and z, counted from the patch's origin.
    voxels: Vec<[i32; 3]>,
    sums: Vec<NarrowMoments>,
    /// Carried sums of voxels that overflow.
    carried: HashMap<u32, Moments, BuildHasherDefault<MixHasher>>,
}

impl VoxelSums {
    /// Adds sums that are not full.
    #[inline]
    pub(super) fn add(&mut self, voxel: [i32; 3], points: &PackedSums) {
        let slot = self.slot(voxel);
        if self.sums[slot as usize].add(points, None) {
            self.carry(slot);
        }
    }

    #[cold]
    fn carry(&mut self, slot: u32) {
        let sums = self.sums[slot as usize].carry();
        self.carried.entry(slot).or_default().merge(&sums);
    }

    #[inline]
    fn slot(&mut self, voxel: [i32; 3]) -> u32 {
        let (voxels, sums) = (&mut self.voxels, &mut self.sums);
        let [x, y, z] = voxel;
        let key = (u64::from(x as u32) << 32 | u64::from(y as u32), z);
        *self.by_voxel.entry(key).or_insert_with(|| {
            voxels.push(voxel);
            sums.push(NarrowMoments::default());
            (voxels.len() - 1) as u32
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    pub(super) fn clear(&mut self) {
        let Self { by_voxel, voxels, sums, carried } = self;
        by_voxel.clear();
        voxels.clear();
        sums.clear();
        carried.clear();
    }

    pub(super) fn merge(&mut self, other: &Self) {
        for (&voxel, sums) in other.voxels.iter().zip(&other.sums) {
            self.add(voxel, sums.packed());
        }
        for (&slot, moments) in &other.carried {
            let mine = self.slot(other.voxels[slot as usize]);
            self.carried.entry(mine).or_default().merge(moments);
        }
    }

    /// Each voxel once, in the order of first use.
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = ([i32; 3], Moments)> {
        self.voxels.iter().zip(&self.sums).enumerate().map(|(slot, (&voxel, sums))| {
            let mut moments = sums.widened();
            if let Some(carried) = self.carried.get(&(slot as u32)) {
                moments.merge(carried);
            }
            (voxel, moments)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use proptest::prelude::*;

    /// The largest allowed number of points in a part: the squares of a few such parts exceed 32 bits.
    fn many(offset_units: [u16; 3]) -> PackedSums {
        let mut sums = PackedSums::default();
        for _ in 0..PackedSums::most_points(4096) {
            sums.add_point(offset_units);
        }
        sums
    }

    proptest! {
        #[test]
        fn sums_are_those_of_a_sorted_map_in_any_parts(
            parts in prop::collection::vec((prop::array::uniform3(-2i32..2), prop::array::uniform3(0u16..4096), any::<bool>()), 0..300),
            cut in 0usize..300,
        ) {
            let mut map: BTreeMap<[i32; 3], Moments> = BTreeMap::new();
            let mut both = [VoxelSums::default(), VoxelSums::default()];
            for (k, &(voxel, offset_units, is_one)) in parts.iter().enumerate() {
                let mut sums = PackedSums::default();
                sums.add_point(offset_units);
                let sums = if is_one { sums } else { many(offset_units) };
                for _ in 0..sums.count() {
                    map.entry(voxel).or_default().add(offset_units.map(u32::from), None);
                }
                both[usize::from(k < cut)].add(voxel, &sums);
            }
            let [mut all, other] = both;
            all.merge(&other);
            let mut found: Vec<_> = all.iter().collect();
            found.sort_unstable_by_key(|(voxel, _)| *voxel);
            prop_assert_eq!(found, map.into_iter().collect::<Vec<_>>());
        }
    }
}
