use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::lattice::Voxel;
use crate::moments::{Moments, NarrowMoments, VoxelRecord};

/// Voxels along the edge of a brick.
const BRICK_EDGE: u32 = 8;
const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;
/// Points whose sums are looked up together.
const TOGETHER: usize = 32;
const EMPTY: u32 = u32::MAX;

/// The voxel sums of one tile while it is being fused: a hash of 8³-voxel bricks, whose slots point into
/// one dense list. Neighbouring points mostly fall into few bricks, so hashing is rare.
#[derive(Debug, Default)]
pub(crate) struct TileMoments {
    bricks: HashMap<u64, u32, BuildHasherDefault<MixHasher>>,
    recent: RecentBricks,
    slots: Vec<[u32; BRICK_VOXELS]>,
    voxels: Vec<Voxel>,
    /// As many as voxels.
    sums: Vec<NarrowMoments>,
    /// What the sums of some voxels could not hold.
    carried: HashMap<u32, Moments, BuildHasherDefault<MixHasher>>,
}

/// A point in a tile: its voxel and its place there.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PointInTile {
    pub(crate) voxel: Voxel,
    /// Offset from the voxel's lowest corner, lattice units.
    pub(crate) offset_units: [u16; 3],
}

/// Buffers of [`TileMoments::add`].
#[derive(Debug, Default)]
pub(crate) struct ByBrick {
    /// Of each point.
    bricks: Vec<u32>,
    /// Where the points of each brick end.
    ends: Vec<u32>,
    sorted: Vec<PointInTile>,
}

impl TileMoments {
    /// Adds points, brick by brick: a sensor goes from brick to brick and back with every beam, and their sums lie far
    /// apart in memory.
    pub(crate) fn add(&mut self, points: &[PointInTile], segment: Option<i32>, by_brick: &mut ByBrick) {
        let ByBrick { bricks, ends, sorted } = by_brick;
        bricks.clear();
        ends.clear();
        ends.resize(self.slots.len(), 0);
        for point in points {
            let brick = self.brick(point.voxel);
            if ends.len() <= brick as usize {
                ends.resize(self.slots.len(), 0);
            }
            ends[brick as usize] += 1;
            bricks.push(brick);
        }
        let mut start = 0;
        for end in &mut *ends {
            start += std::mem::replace(end, start);
        }
        sorted.resize(points.len(), PointInTile::default());
        for (&brick, &point) in bricks.iter().zip(points) {
            let end = &mut ends[brick as usize];
            sorted[*end as usize] = point;
            *end += 1;
        }
        let (mut start, mut slots) = (0, [0; TOGETHER]);
        for (brick, &end) in (0..).zip(&*ends) {
            for points in sorted[start..end as usize].chunks(TOGETHER) {
                // Look at all sums first, so that they come from memory together.
                let mut seen = 0;
                for (slot, point) in slots.iter_mut().zip(points) {
                    *slot = self.slot(brick, point.voxel);
                    seen |= self.sums[*slot as usize].count();
                }
                std::hint::black_box(seen);
                for (&slot, point) in slots.iter().zip(points) {
                    if self.sums[slot as usize].add(point.offset_units, segment) {
                        self.carry(slot);
                    }
                }
            }
            start = end as usize;
        }
    }

    pub(crate) fn merge(&mut self, record: &VoxelRecord) {
        let brick = self.brick(record.voxel());
        let slot = self.slot(brick, record.voxel());
        match self.sums[slot as usize].merge(&record.moments) {
            Some(false) => {}
            Some(true) => self.carry(slot),
            None => self.carried.entry(slot).or_default().merge(&record.moments),
        }
    }

    #[cold]
    fn carry(&mut self, slot: u32) {
        let sums = self.sums[slot as usize].carry();
        self.carried.entry(slot).or_default().merge(&sums);
    }

    #[inline]
    fn brick(&mut self, voxel: Voxel) -> u32 {
        let (key, recent) = (brick_key(voxel), RecentBricks::place(voxel));
        let (recent_key, brick) = self.recent.0[recent];
        if recent_key == key {
            return brick;
        }
        let brick = self.find_brick(key);
        self.recent.0[recent] = (key, brick);
        brick
    }

    fn find_brick(&mut self, key: u64) -> u32 {
        let slots = &mut self.slots;
        *self.bricks.entry(key).or_insert_with(|| {
            slots.push([EMPTY; BRICK_VOXELS]);
            (slots.len() - 1) as u32
        })
    }

    #[inline]
    fn slot(&mut self, brick: u32, voxel: Voxel) -> u32 {
        let place = place_in_brick(voxel);
        let slot = self.slots[brick as usize][place];
        if slot == EMPTY { self.new_slot(voxel, brick, place) } else { slot }
    }

    #[cold]
    fn new_slot(&mut self, voxel: Voxel, brick: u32, place: usize) -> u32 {
        let slot = self.voxels.len() as u32;
        self.slots[brick as usize][place] = slot;
        self.voxels.push(voxel);
        self.sums.push(NarrowMoments::default());
        slot
    }

    /// Memory held, bytes, growth of the vectors included.
    pub(crate) fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<[u32; BRICK_VOXELS]>()
            + self.voxels.capacity() * size_of::<Voxel>()
            + self.sums.capacity() * size_of::<NarrowMoments>()
            + self.bricks.capacity() * 24
            + self.carried.capacity() * size_of::<(u32, Moments)>()
    }

    /// The voxels in the one order that depends on nothing but their places.
    pub(crate) fn into_sorted(self) -> Vec<VoxelRecord> {
        let Self { voxels, mut sums, carried, .. } = self;
        let mut order: Vec<(Voxel, u32)> = voxels.into_iter().zip(0..).collect();
        order.sort_unstable();
        let record = |(voxel, slot): (Voxel, u32)| {
            let mut moments = sums[slot as usize].carry();
            if let Some(carried) = carried.get(&slot) {
                moments.merge(carried);
            }
            VoxelRecord::new(voxel, moments)
        };
        order.into_iter().map(record).collect()
    }
}

/// Bricks looked for last, each at the one place that the last bits of its indices give.
#[derive(Debug)]
struct RecentBricks(Box<[(u64, u32); RECENT]>);

/// Four bricks along each edge.
const RECENT: usize = 64;

impl Default for RecentBricks {
    fn default() -> Self {
        // No brick has this key: x and y are small.
        Self(Box::new([(u64::MAX, 0); RECENT]))
    }
}

impl RecentBricks {
    #[inline]
    fn place(voxel: Voxel) -> usize {
        let low = |n: u32| (n / BRICK_EDGE % 4) as usize;
        low(voxel.z as u32) << 4 | low(voxel.y.into()) << 2 | low(voxel.x.into())
    }
}

#[inline]
fn brick_key(voxel: Voxel) -> u64 {
    let (x, y) = (u32::from(voxel.x), u32::from(voxel.y));
    let z = voxel.z >> BRICK_EDGE.ilog2();
    u64::from(z as u32) << 32 | u64::from(y / BRICK_EDGE) << 16 | u64::from(x / BRICK_EDGE)
}

#[inline]
fn place_in_brick(voxel: Voxel) -> usize {
    let [x, y, z] = [voxel.x.into(), voxel.y.into(), voxel.z as u32].map(|n: u32| n % BRICK_EDGE);
    ((z * BRICK_EDGE + y) * BRICK_EDGE + x) as usize
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

    fn write_u32(&mut self, n: u32) {
        self.write_u64(n.into());
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
            points in prop::collection::vec((0u16..80, 0u16..80, -40i32..40, prop::array::uniform3(0u16..1638), 0..5i32), 0..300),
            aside in 0usize..300,
        ) {
            let mut tile = TileMoments::default();
            let mut map: BTreeMap<Voxel, Moments> = BTreeMap::new();
            let mut put_aside = Vec::new();
            for (k, (x, y, z, offset_units, segment)) in points.into_iter().enumerate() {
                let voxel = Voxel { z, y, x };
                if k == aside {
                    put_aside = std::mem::take(&mut tile).into_sorted();
                }
                tile.add(&[PointInTile { voxel, offset_units }], Some(segment), &mut ByBrick::default());
                map.entry(voxel).or_default().add(offset_units.map(u32::from), Some(segment));
            }
            put_aside.iter().for_each(|record| tile.merge(record));
            let expected: Vec<_> = map.into_iter().map(|(v, m)| VoxelRecord::new(v, m)).collect();
            prop_assert_eq!(tile.into_sorted(), expected);
        }
    }
}
