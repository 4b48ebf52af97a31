//! A table of values by tile, for the few tiles that a scan touches.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use dmp_disk::TileId;

use super::mix_hasher::MixHasher;

/// Tiles whose x and y are equal in their last bits share a slot.
const PLACES_EDGE: i32 = 16;
const PLACES: usize = (PLACES_EDGE * PLACES_EDGE) as usize;

/// A value for each of the few tiles that a sensor sees at a time, found without hashing: the beams of a scan switch
/// between tiles with almost every return.
///
/// Tiles less than 16 apart in x and y are found by one table access. Tiles farther apart may alternate in one slot,
/// which only costs time.
#[derive(Debug)]
pub struct TileTable<T> {
    places: Box<[u32; PLACES]>,
    found: Vec<(TileId, T)>,
    by_tile: HashMap<TileId, u32, BuildHasherDefault<MixHasher>>,
}

impl<T> Default for TileTable<T> {
    fn default() -> Self {
        Self { places: Box::new([u32::MAX; PLACES]), found: Vec::new(), by_tile: HashMap::default() }
    }
}

impl<T: Default> TileTable<T> {
    /// The value of `tile`.
    #[inline]
    pub fn entry(&mut self, tile: TileId) -> &mut T {
        let place = (tile.y & (PLACES_EDGE - 1)) * PLACES_EDGE + (tile.x & (PLACES_EDGE - 1));
        let mut index = self.places[place as usize] as usize;
        if self.found.get(index).is_none_or(|found| found.0 != tile) {
            index = self.find(tile);
            self.places[place as usize] = index as u32;
        }
        &mut self.found[index].1
    }

    #[cold]
    fn find(&mut self, tile: TileId) -> usize {
        let found = &mut self.found;
        let index = self.by_tile.entry(tile).or_insert_with(|| {
            found.push((tile, T::default()));
            (found.len() - 1) as u32
        });
        *index as usize
    }

    /// Every tile with its value, in no order.
    pub fn all_mut(&mut self) -> impl Iterator<Item = (TileId, &mut T)> {
        self.found.iter_mut().map(|(tile, held)| (*tile, held))
    }

    /// Removes the tiles that `keep` rejects.
    pub fn retain(&mut self, keep: impl Fn(&T) -> bool) {
        if self.found.iter().all(|(_, held)| keep(held)) {
            return;
        }
        self.found.retain(|(_, held)| keep(held));
        self.by_tile.clear();
        self.by_tile.extend(self.found.iter().map(|found| found.0).zip(0..));
    }

    /// Removes and returns everything.
    pub fn drain(&mut self) -> impl Iterator<Item = (TileId, T)> {
        self.by_tile.clear();
        self.found.drain(..)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_holds_what_a_map_holds(visits in prop::collection::vec((-40i32..40, -40i32..40), 0..300)) {
            let mut table: TileTable<u32> = TileTable::default();
            for round in [&visits[..], &visits[visits.len() / 2..]] {
                let mut map: BTreeMap<TileId, u32> = BTreeMap::new();
                for &(x, y) in round {
                    *table.entry(TileId { y, x }) += 1;
                    *map.entry(TileId { y, x }).or_default() += 1;
                }
                prop_assert_eq!(&table.all_mut().map(|(tile, n)| (tile, *n)).collect::<BTreeMap<_, _>>(), &map);
                table.retain(|n| n % 2 == 1);
                map.retain(|_, n| *n % 2 == 1);
                for &(x, y) in &visits {
                    *table.entry(TileId { y, x }) += 1;
                    *map.entry(TileId { y, x }).or_default() += 1;
                }
                prop_assert_eq!(table.drain().collect::<BTreeMap<_, _>>(), map);
            }
        }
    }
}
