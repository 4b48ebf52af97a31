//! The finished map of a run.

use dmp_map::Store;

use crate::work::MapFacts;

/// The map of one run, ready for casting.
#[derive(Debug)]
pub(crate) struct RunMap {
    pub(crate) store: Store,
    pub(crate) facts: MapFacts,
}

/// Bytes of the tiles of a map.
pub(crate) fn tile_bytes(map: &Store) -> u64 {
    map.entries().map(|tile| u64::from(tile.own.bytes) + u64::from(tile.borders.bytes)).sum()
}
