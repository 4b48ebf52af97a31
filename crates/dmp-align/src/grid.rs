//! Which surfels lie in the voxels of a box.

/// Voxels along an axis are told apart by so many bits.
const BITS: u32 = 21;
/// Blocks have 4 voxels along each edge: the 64 bits of a word say which of them hold a surfel.
const EDGE_BITS: u32 = 2;
const EDGE: i32 = 1 << EDGE_BITS;

/// The numbers of surfels by their voxels: a hash of blocks with open places, two thirds full.
///
/// Surfels are numbered block by block, and in a block by the bits of their voxels, so a number is the block's first and the
/// bits set below. Of a box, only the voxels with surfels are gone through.
#[derive(Debug, Clone, PartialEq, Eq)]
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

/// The block of a voxel, and its bit there: surfels are in the order of these.
#[inline]
pub(crate) fn block_and_bit(voxel: [i32; 3]) -> ([i32; 3], u32) {
    let [x, y, z] = voxel.map(|n| (n & (EDGE - 1)) as u32);
    (voxel.map(|n| n >> EDGE_BITS), (x << (2 * EDGE_BITS)) | (y << EDGE_BITS) | z)
}

impl Grid {
    /// Of surfels in the order of their numbers, each in a voxel of its own, by block and bit.
    pub(crate) fn new(voxels: &[[i32; 3]]) -> Self {
        let parts: Vec<_> = voxels.iter().map(|&voxel| block_and_bit(voxel)).collect();
        debug_assert!(parts.is_sorted());
        let blocks = parts.chunk_by(|a, b| a.0 == b.0);
        let size = 3 * blocks.clone().count() / 2 + 1;
        let mut grid = Self { blocks: vec![Block::default(); size], firsts: vec![0; size] };
        let mut first = 0;
        for of_block in blocks {
            let key = key_of(of_block[0].0);
            let mut place = grid.place_of(key);
            while grid.blocks[place].occupied != 0 {
                place = (place + 1) % size;
            }
            let occupied = of_block.iter().fold(0, |bits, (_, bit)| bits | 1 << bit);
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

    /// Goes through the surfels of a box, both ends included, in the order of their numbers.
    #[inline]
    pub(crate) fn each_in(&self, low: [i32; 3], high: [i32; 3], mut visit: impl FnMut(u32)) {
        let [first, last] = [low, high].map(|end| end.map(|n| n >> EDGE_BITS));
        // The voxels of a block that lie in the box, by one axis.
        let within = |axis: usize, block: i32| {
            let from = if block == first[axis] { low[axis] & (EDGE - 1) } else { 0 };
            let to = if block == last[axis] { high[axis] & (EDGE - 1) } else { EDGE - 1 };
            (from as u32, to as u32)
        };
        for x in first[0]..=last[0] {
            let (from, to) = within(0, x);
            let in_x = (u64::MAX >> (48 - 16 * to)) & (u64::MAX << (16 * from));
            for y in first[1]..=last[1] {
                let (from, to) = within(1, y);
                let rows = (0xffff >> (12 - 4 * to)) & (0xffff << (4 * from)) & 0xffff_u64;
                let in_xy = in_x & (rows * 0x0001_0001_0001_0001);
                for z in first[2]..=last[2] {
                    let (from, to) = within(2, z);
                    let places = (0xf >> (3 - to)) & (0xf << from) & 0xf_u64;
                    let found = self.find([x, y, z]);
                    let occupied = self.blocks[found].occupied;
                    let mut bits = occupied & in_xy & (places * 0x1111_1111_1111_1111);
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
            voxels.sort_by_key(|&voxel| block_and_bit(voxel));
            let high = [0, 1, 2].map(|k| low[k] + wide[k]);
            let inside = |voxel: &[i32; 3]| (0..3).all(|k| (low[k]..=high[k]).contains(&voxel[k]));
            let expected: Vec<u32> = (0..).zip(&voxels).filter(|(_, voxel)| inside(voxel)).map(|(n, _)| n).collect();
            let mut found = Vec::new();
            Grid::new(&voxels).each_in(low, high, |number| found.push(number));
            prop_assert_eq!(found, expected);
        }
    }
}
