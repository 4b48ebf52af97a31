//! The voxel sums of one tile under construction.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::moments::{Moments, VoxelRecord};
use super::narrow_moments::{NarrowMoments, PackedSums};
use crate::grid::{MixHasher, Voxel};

/// Voxels along the edge of a brick.
pub const BRICK_EDGE: u32 = 4;
const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;
/// Sums allocated for a brick at a time.
const GROUP: usize = 4;
/// Voxels whose sums are looked up together.
const TOGETHER: usize = 128;
const EMPTY: u8 = u8::MAX;
/// Average ratio of capacity to length of growing lists, which double each time.
const ROOM: f64 = 1.4;
/// Bytes of a brick's entry in the hash.
const PLACE_BYTES: usize = 24;

/// The voxel sums of one tile under construction: a hash of 4³-voxel bricks that index their voxels' sums in one dense
/// list.
#[derive(Debug, Default)]
pub(crate) struct TileMoments {
    by_place: HashMap<u64, u32, BuildHasherDefault<MixHasher>>,
    bricks: Vec<Brick>,
    /// The lowest voxel of each brick.
    corners: Vec<Voxel>,
    /// Groups that belong to bricks.
    sums: Vec<NarrowMoments>,
    /// Carried sums of voxels that overflow.
    carried: HashMap<u32, Moments, BuildHasherDefault<MixHasher>>,
}

/// Two cache lines: a surface passes through few voxels of a brick, known only when they are first used.
#[derive(Debug, Clone, Copy)]
#[repr(align(128))]
struct Brick {
    /// For each voxel the number of the brick's voxels used before it; [`EMPTY`] if unused.
    ranks: [u8; BRICK_VOXELS],
    /// The groups of sums of the brick's voxels, in the order of ranks.
    groups: [u32; BRICK_VOXELS / GROUP],
}

/// Sums of points in one voxel of a tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartOfVoxel {
    pub(crate) voxel: Voxel,
    pub(crate) sums: PackedSums,
}

/// Approximate memory of the sums of this many voxels during fusion, in this many bricks of [`BRICK_EDGE`] voxels per
/// edge, bytes. Sparse bricks need more per voxel.
pub fn fused_bytes(voxels: f64, bricks: f64) -> f64 {
    let brick_bytes = size_of::<Brick>() + size_of::<Voxel>() + PLACE_BYTES;
    // Half of the last group of each brick is empty.
    let sums = voxels + bricks * (GROUP / 2) as f64;
    ROOM * (bricks * brick_bytes as f64 + sums * size_of::<NarrowMoments>() as f64)
}

impl TileMoments {
    /// Adds points that were all seen in one segment.
    pub(crate) fn add(&mut self, parts: &[PartOfVoxel], segment: Option<i32>) {
        let (mut bricks, mut ranks, mut slots) = ([0; TOGETHER], [0; TOGETHER], [0; TOGETHER]);
        for parts in parts.chunks(TOGETHER) {
            // One step for all of them before the next step, so that their memory accesses overlap.
            for (brick, part) in bricks.iter_mut().zip(parts) {
                *brick = self.brick(part.voxel);
            }
            for ((rank, &brick), part) in ranks.iter_mut().zip(&bricks).zip(parts) {
                *rank = self.bricks[brick as usize].ranks[place_in_brick(part.voxel)];
            }
            for (((slot, &rank), &brick), part) in slots.iter_mut().zip(&ranks).zip(&bricks).zip(parts) {
                let known = rank != EMPTY;
                *slot =
                    if known { self.bricks[brick as usize].slot(rank) } else { self.slot(brick, part.voxel) };
            }
            let seen = |seen, (&slot, _): (&u32, _)| seen | self.sums[slot as usize].count();
            std::hint::black_box(slots.iter().zip(parts).fold(0, seen));
            for (&slot, part) in slots.iter().zip(parts) {
                if self.sums[slot as usize].add(&part.sums, segment) {
                    self.carry(slot);
                }
            }
        }
    }

    #[cold]
    fn carry(&mut self, slot: u32) {
        let sums = self.sums[slot as usize].carry();
        self.carried.entry(slot).or_default().merge(&sums);
    }

    #[inline]
    fn brick(&mut self, voxel: Voxel) -> u32 {
        let (bricks, corners) = (&mut self.bricks, &mut self.corners);
        *self.by_place.entry(brick_key(voxel)).or_insert_with(|| {
            bricks.push(Brick { ranks: [EMPTY; BRICK_VOXELS], groups: [0; BRICK_VOXELS / GROUP] });
            corners.push(corner_of_brick(voxel));
            (bricks.len() - 1) as u32
        })
    }

    /// The index of a voxel's sums; allocates it if new.
    #[cold]
    fn slot(&mut self, brick: u32, voxel: Voxel) -> u32 {
        let (brick, place) = (&mut self.bricks[brick as usize], place_in_brick(voxel));
        if brick.ranks[place] == EMPTY {
            let rank = brick.ranks.iter().filter(|&&rank| rank != EMPTY).count();
            brick.ranks[place] = rank as u8;
            if rank % GROUP == 0 {
                brick.groups[rank / GROUP] = (self.sums.len() / GROUP) as u32;
                self.sums.extend([NarrowMoments::default(); GROUP]);
            }
        }
        brick.slot(brick.ranks[place])
    }

    /// Memory held, bytes, including spare capacity.
    pub(crate) fn bytes(&self) -> usize {
        self.bricks.capacity() * size_of::<Brick>()
            + self.corners.capacity() * size_of::<Voxel>()
            + self.sums.capacity() * size_of::<NarrowMoments>()
            + self.by_place.capacity() * PLACE_BYTES
            + self.carried.capacity() * size_of::<(u32, Moments)>()
    }

    /// Upper limit of its voxels.
    pub(crate) fn most_voxels(&self) -> usize {
        self.sums.len()
    }

    /// The voxels [by their cells](Voxel::by_cell): the order depends only on their positions.
    pub(crate) fn into_records(self) -> impl Iterator<Item = VoxelRecord> {
        let Self { bricks, corners, mut sums, carried, by_place } = self;
        drop(by_place);
        let mut order: Vec<(u64, u32)> = Vec::with_capacity(sums.len());
        for (brick, &corner) in bricks.iter().zip(&corners) {
            let known = brick.ranks.iter().enumerate().filter(|&(_, &rank)| rank != EMPTY);
            order.extend(known.map(|(place, &rank)| (voxel_at(corner, place).by_cell(), brick.slot(rank))));
        }
        drop((bricks, corners));
        order.sort_unstable();
        order.into_iter().map(move |(by_cell, slot)| {
            let mut moments = sums[slot as usize].carry();
            if let Some(carried) = carried.get(&slot) {
                moments.merge(carried);
            }
            VoxelRecord::new(Voxel::at(by_cell), moments)
        })
    }
}

impl Brick {
    #[inline]
    fn slot(&self, rank: u8) -> u32 {
        let rank = usize::from(rank) % BRICK_VOXELS;
        self.groups[rank / GROUP] * GROUP as u32 + (rank % GROUP) as u32
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

fn corner_of_brick(voxel: Voxel) -> Voxel {
    let low = !(BRICK_EDGE - 1);
    Voxel { z: voxel.z & low as i32, y: voxel.y & low as u16, x: voxel.x & low as u16 }
}

fn voxel_at(corner: Voxel, place: usize) -> Voxel {
    let [z, y, x] = [BRICK_EDGE * BRICK_EDGE, BRICK_EDGE, 1].map(|step| place as u32 / step % BRICK_EDGE);
    Voxel { z: corner.z + z as i32, y: corner.y + y as u16, x: corner.x + x as u16 }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use dmp_disk::DiskError;

    use super::*;
    use crate::voxels::merged::Merged;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_holds_what_a_sorted_map_holds(
            points in prop::collection::vec((0u16..12, 0u16..80, -40i32..40, prop::array::uniform3(0u16..1638), 0..3u32), 0..900),
            aside in 0usize..4, together in 1usize..400,
        ) {
            let mut tile = TileMoments::default();
            let mut map: BTreeMap<Voxel, Moments> = BTreeMap::new();
            let mut put_aside = Vec::new();
            for (k, points) in points.chunks(together).enumerate() {
                if k == aside {
                    put_aside = std::mem::take(&mut tile).into_records().collect();
                }
                let segment = Some(k as i32 % 3);
                let mut parts = Vec::new();
                for &(x, y, z, offset_units, more) in points {
                    // Close together, so that bricks fill up.
                    let (voxel, mut sums) = (Voxel { z: z / 8, y: y / 8, x }, PackedSums::default());
                    for _ in 0..=more {
                        sums.add_point(offset_units);
                        map.entry(voxel).or_default().add(offset_units.map(u32::from), segment);
                    }
                    parts.push(PartOfVoxel { voxel, sums });
                }
                tile.add(&parts, segment);
            }
            let parts = [put_aside, tile.into_records().collect()];
            let merged = Merged::new(parts.map(|part: Vec<_>| part.into_iter().map(Ok)).into());
            let mut expected: Vec<_> = map.into_iter().map(|(v, m)| VoxelRecord::new(v, m)).collect();
            expected.sort_by_key(|record| record.voxel().by_cell());
            prop_assert_eq!(merged.collect::<Result<Vec<_>, DiskError>>().unwrap(), expected);
        }
    }
}
