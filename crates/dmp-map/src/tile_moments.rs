use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::lattice::Voxel;
use crate::moments::{Moments, VoxelRecord};

/// Voxels along the edge of a brick.
const BRICK_EDGE: u32 = 8;
const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;
const EMPTY: u32 = u32::MAX;

/// The voxel sums of one tile while it is being fused: a hash of 8³-voxel bricks, whose slots point into
/// one dense list. Successive points mostly fall into the same brick, so hashing is rare.
#[derive(Debug, Default)]
pub(crate) struct TileMoments {
    bricks: HashMap<u64, u32, BuildHasherDefault<MixHasher>>,
    slots: Vec<[u32; BRICK_VOXELS]>,
    voxels: Vec<(Voxel, Moments)>,
    last: Option<(u64, u32)>,
}

impl TileMoments {
    pub(crate) fn add(&mut self, voxel: Voxel, offset_units: [u32; 3], segment: Option<i32>) {
        self.entry(voxel).add(offset_units, segment);
    }

    pub(crate) fn merge(&mut self, record: &VoxelRecord) {
        self.entry(record.voxel()).merge(&record.moments);
    }

    fn entry(&mut self, voxel: Voxel) -> &mut Moments {
        let (key, place) = brick_of(voxel);
        let brick = match self.last {
            Some((last_key, brick)) if last_key == key => brick,
            _ => {
                let slots = &mut self.slots;
                *self.bricks.entry(key).or_insert_with(|| {
                    slots.push([EMPTY; BRICK_VOXELS]);
                    (slots.len() - 1) as u32
                })
            }
        };
        self.last = Some((key, brick));
        let slot = &mut self.slots[brick as usize][place];
        if *slot == EMPTY {
            *slot = self.voxels.len() as u32;
            self.voxels.push((voxel, Moments::default()));
        }
        &mut self.voxels[*slot as usize].1
    }

    /// Memory held, bytes, growth of the vectors included.
    pub(crate) fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<[u32; BRICK_VOXELS]>()
            + self.voxels.capacity() * size_of::<(Voxel, Moments)>()
            + self.bricks.capacity() * 24
    }

    /// The voxels in the one order that depends on nothing but their places.
    pub(crate) fn into_sorted(self) -> Vec<VoxelRecord> {
        let Self { mut voxels, slots, bricks, .. } = self;
        drop((slots, bricks));
        voxels.sort_unstable_by_key(|v| v.0);
        voxels.into_iter().map(|(voxel, moments)| VoxelRecord::new(voxel, moments)).collect()
    }
}

fn brick_of(voxel: Voxel) -> (u64, usize) {
    let (x, y) = (u32::from(voxel.x), u32::from(voxel.y));
    let z = voxel.z.div_euclid(BRICK_EDGE as i32);
    let key = u64::from(z as u32) << 32 | u64::from(y / BRICK_EDGE) << 16 | u64::from(x / BRICK_EDGE);
    let inner_z = voxel.z.rem_euclid(BRICK_EDGE as i32) as u32;
    (key, ((inner_z * BRICK_EDGE + y % BRICK_EDGE) * BRICK_EDGE + x % BRICK_EDGE) as usize)
}

/// One multiplication and a fold: brick keys are small integers that nobody chooses to collide.
#[derive(Debug, Default)]
pub(crate) struct MixHasher(u64);

impl Hasher for MixHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_i32(&mut self, n: i32) {
        self.write_u64(u64::from(n as u32));
    }

    fn write_u64(&mut self, n: u64) {
        let product = (u128::from(self.0 ^ n) + 1) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_holds_what_a_sorted_map_holds(
            points in prop::collection::vec((0u16..40, 0u16..40, -20i32..20, prop::array::uniform3(0u32..1638), 0..5i32), 0..300),
        ) {
            let mut tile = TileMoments::default();
            let mut map: BTreeMap<Voxel, Moments> = BTreeMap::new();
            for (x, y, z, offset, segment) in points {
                let voxel = Voxel { z, y, x };
                tile.add(voxel, offset, Some(segment));
                map.entry(voxel).or_default().add(offset, Some(segment));
            }
            let expected: Vec<_> = map.into_iter().map(|(v, m)| VoxelRecord::new(v, m)).collect();
            prop_assert_eq!(tile.into_sorted(), expected);
        }
    }
}
