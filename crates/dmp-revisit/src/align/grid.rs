//! Which surfels lie in the voxels of a box.

/// Bits of a voxel's number along an axis.
const BITS: u32 = 21;
/// Blocks have 4 voxels along each edge: the 64 bits of a word say which of them hold a surfel.
const EDGE_BITS: u32 = 2;
const EDGE: i32 = 1 << EDGE_BITS;

/// The numbers of surfels by their voxels: a hash of blocks with open places, two thirds full.
///
/// Surfels are numbered block by block, and in a block by the bits of their voxels, so a number is the block's first and the
/// bits set below. Of a box, only the voxels with surfels are gone through.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Grid {
    blocks: Vec<Block>,
    /// The first surfel of each block.
    firsts: Vec<u32>,
}

/// No surfel is in one that is not there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Block {
    occupied: u64,
    key: u64,
}

/// The place of a voxel in the order of the grid, Morton's: by the bits of x, y and z from the highest on. The voxels of a cube
/// whose edge is a power of two follow each other. `None` beyond 2²⁰ voxels along an axis.
pub(crate) fn order_of(voxel: [i32; 3]) -> Option<u64> {
    let half = 1 << (BITS - 1);
    let [x, y, z] = voxel.map(|n| u64::from(n.wrapping_add(half) as u32));
    let is_within = (x | y | z) >> BITS == 0;
    is_within.then(|| every_third_bit(x) << 2 | every_third_bit(y) << 1 | every_third_bit(z))
}

/// The 21 bits of a number, with two zeros before each.
fn every_third_bit(mut n: u64) -> u64 {
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        n = (n | n << shift) & mask;
    }
    n
}

/// The bits of a block's voxels from one place to another along x; along y they lie one to the right of these, along z two.
const WITHIN: [[[u64; EDGE as usize]; EDGE as usize]; 3] = within();

const fn within() -> [[[u64; EDGE as usize]; EDGE as usize]; 3] {
    let mut masks = [[[0; EDGE as usize]; EDGE as usize]; 3];
    let mut bit = 0;
    while bit < 64 {
        let mut axis = 0;
        while axis < 3 {
            let shift = 2 - axis;
            let place = (bit >> (shift + 3) & 1) << 1 | bit >> shift & 1;
            let mut from = 0;
            while from <= place {
                let mut to = place;
                while to < EDGE as usize {
                    masks[axis][from][to] |= 1 << bit;
                    to += 1;
                }
                from += 1;
            }
            axis += 1;
        }
        bit += 1;
    }
    masks
}

impl Grid {
    /// Of surfels in the order of their numbers, each in a voxel of its own, in the order of [`order_of`].
    pub(crate) fn new(voxels: &[[i32; 3]]) -> Self {
        let block_of = |voxel: [i32; 3]| voxel.map(|n| n >> EDGE_BITS);
        let blocks = voxels.chunk_by(|&a, &b| block_of(a) == block_of(b));
        let size = 3 * blocks.clone().count() / 2 + 1;
        let mut grid = Self { blocks: vec![Block::default(); size], firsts: vec![0; size] };
        let mut first = 0;
        for of_block in blocks {
            let key = key_of(block_of(of_block[0]));
            let mut place = grid.place_of(key);
            while grid.blocks[place].occupied != 0 {
                place = (place + 1) % size;
            }
            let occupied = of_block.iter().fold(0, |bits, &voxel| {
                let [x, y, z] = voxel.map(|n| (n & (EDGE - 1)) as usize);
                bits | (WITHIN[0][x][x] & WITHIN[1][y][y] & WITHIN[2][z][z])
            });
            (grid.blocks[place], grid.firsts[place]) = (Block { occupied, key }, first);
            first += of_block.len() as u32;
        }
        grid
    }

    /// Fibonacci hashing: the upper bits of a product, brought to the number of places by another one.
    #[inline]
    fn place_of(&self, key: u64) -> usize {
        let hash = key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        ((hash * self.blocks.len() as u64) >> 32) as usize
    }

    /// Where a block is, or an empty one in its stead.
    #[inline]
    fn find(&self, block: [i32; 3]) -> usize {
        let key = key_of(block);
        let mut place = self.place_of(key);
        loop {
            // There are empty places, so that there is an end.
            let there = &self.blocks[place];
            if there.key == key || there.occupied == 0 {
                return place;
            }
            place = if place + 1 == self.blocks.len() { 0 } else { place + 1 };
        }
    }

    /// Goes through the surfels of a box, both ends included.
    #[inline]
    pub(crate) fn each_in(&self, low: [i32; 3], high: [i32; 3], mut visit: impl FnMut(u32)) {
        if self.blocks.is_empty() {
            return;
        }
        let [first, last] = [low, high].map(|end| end.map(|n| n >> EDGE_BITS));
        // The voxels of a block that lie in the box, by one axis.
        let within = |axis: usize, block: i32| {
            let from = if block == first[axis] { low[axis] & (EDGE - 1) } else { 0 };
            let to = if block == last[axis] { high[axis] & (EDGE - 1) } else { EDGE - 1 };
            WITHIN[axis][from as usize][to as usize]
        };
        for x in first[0]..=last[0] {
            let in_x = within(0, x);
            for y in first[1]..=last[1] {
                let in_xy = in_x & within(1, y);
                for z in first[2]..=last[2] {
                    let found = self.find([x, y, z]);
                    let occupied = self.blocks[found].occupied;
                    let mut bits = occupied & in_xy & within(2, z);
                    while bits != 0 {
                        let below = (bits & bits.wrapping_neg()) - 1;
                        visit(self.firsts[found] + (occupied & below).count_ones());
                        bits &= bits - 1;
                    }
                }
            }
        }
    }
}

#[inline]
fn key_of(block: [i32; 3]) -> u64 {
    let bits = (1 << BITS) - 1;
    block.iter().fold(0, |key, &n| key << BITS | u64::from(n as u32 & bits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_finds_what_lies_in_a_box(
            voxels in prop::collection::hash_set(prop::array::uniform3(-9i32..9), 0..300),
            low in prop::array::uniform3(-11i32..11), wide in prop::array::uniform3(0i32..12),
        ) {
            let mut voxels: Vec<[i32; 3]> = voxels.into_iter().collect();
            voxels.sort_by_key(|&voxel| order_of(voxel));
            let high = [0, 1, 2].map(|k| low[k] + wide[k]);
            let inside = |voxel: &[i32; 3]| (0..3).all(|k| (low[k]..=high[k]).contains(&voxel[k]));
            let expected: Vec<u32> = (0..).zip(&voxels).filter(|(_, voxel)| inside(voxel)).map(|(n, _)| n).collect();
            let mut found = Vec::new();
            Grid::new(&voxels).each_in(low, high, |number| found.push(number));
            found.sort_unstable();
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn voxels_of_a_cube_follow_each_other(
            voxels in prop::collection::vec(prop::array::uniform3(-40i32..40), 1..200), bits in 0u32..4,
        ) {
            let mut voxels = voxels;
            voxels.sort_by_key(|&voxel| order_of(voxel));
            let cubes = voxels.iter().map(|voxel| voxel.map(|n| n >> bits));
            let mut cubes: Vec<[i32; 3]> = cubes.collect();
            cubes.dedup();
            prop_assert!(cubes.is_sorted_by_key(|&cube| order_of(cube)));
            prop_assert!(order_of([1 << 20, 0, 0]).is_none() && order_of([0, -(1 << 20) - 1, 0]).is_none());
        }
    }
}
