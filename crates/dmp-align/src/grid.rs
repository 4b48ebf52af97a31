//! Which surfel lies in a voxel.

const EMPTY: u32 = u32::MAX;
/// Voxels along an axis are told apart by so many bits.
const BITS: u32 = 21;

/// The numbers of surfels by their voxels: a hash with open places, at most half full.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Grid {
    keys: Vec<u64>,
    numbers: Vec<u32>,
    shift: u32,
}

impl Grid {
    /// Of surfels in the order of their numbers, each in a voxel of its own.
    pub(crate) fn new(voxels: &[[i32; 3]]) -> Self {
        let size = (2 * voxels.len()).next_power_of_two().max(2);
        let mut grid =
            Self { keys: vec![0; size], numbers: vec![EMPTY; size], shift: 64 - size.trailing_zeros() };
        for (number, &voxel) in voxels.iter().enumerate() {
            let key = key_of(voxel);
            let mut place = grid.place_of(key);
            while grid.numbers[place] != EMPTY {
                place = (place + 1) % size;
            }
            (grid.keys[place], grid.numbers[place]) = (key, number as u32);
        }
        grid
    }

    /// Fibonacci hashing: the upper bits of a product.
    #[inline]
    fn place_of(&self, key: u64) -> usize {
        (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> self.shift) as usize
    }

    /// The surfel in a voxel.
    #[inline]
    pub(crate) fn get(&self, voxel: [i32; 3]) -> Option<usize> {
        let key = key_of(voxel);
        let mut place = self.place_of(key);
        while self.numbers[place] != EMPTY {
            if self.keys[place] == key {
                return Some(self.numbers[place] as usize);
            }
            place = (place + 1) % self.numbers.len();
        }
        None
    }
}

#[inline]
fn key_of(voxel: [i32; 3]) -> u64 {
    let bits = (1 << BITS) - 1;
    voxel.iter().fold(0, |key, &n| key << BITS | u64::from(n as u32 & bits))
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_finds_what_a_map_finds(
            voxels in prop::collection::hash_set(prop::array::uniform3(-6i32..6), 0..300),
            asked in prop::collection::vec(prop::array::uniform3(-8i32..8), 100),
        ) {
            let voxels: Vec<[i32; 3]> = voxels.into_iter().collect();
            let (grid, map) = (Grid::new(&voxels), voxels.iter().zip(0..).collect::<HashMap<_, _>>());
            for voxel in voxels.iter().chain(&asked) {
                prop_assert_eq!(grid.get(*voxel), map.get(voxel).copied());
            }
        }
    }
}
