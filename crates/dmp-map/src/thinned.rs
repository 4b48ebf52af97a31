//! A map without some of its surfels, and the places that it left out.

use std::path::Path;

use dmp_disk::TileId;

use crate::MapError;
use crate::grid::{Lattice, TileSpan};
use crate::store::{Durability, Store, StoreSummary, TileEntry};
use crate::surfels::{SurfelCode, TileSurfels};
use crate::tally::{Met, Tally};
use crate::write_map::{SummedTiles, write_map};

/// Surfels decoded at once, bytes.
const ROOM_BYTES: usize = 4 << 20;

/// Writes the tiles of `map` that `is_wanted` to a store at `path`, without the surfels whose counts satisfy `is_out`; a
/// tile keeps all where more than a share `most_out` of the rays that end in it end on those. The store knows what it leaves
/// out, see [`PlacesLeftOut`](crate::PlacesLeftOut). The copies of discs in a tile are complete if its
/// neighbours are wanted, too. `on_tile` receives, after each batch, the number of finished tiles and their total.
///
/// # Errors
/// When the map or the tally cannot be read, or the store cannot be written; then `path` is unchanged.
pub fn thin_map(
    (map, tally): (&Store, &Tally),
    is_wanted: impl Fn(TileId) -> bool,
    (is_out, most_out): (impl Fn(Met) -> bool + Sync, f64),
    (path, durability): (&Path, Durability),
    on_tile: &(dyn Fn(u64, u64) + Sync),
) -> Result<StoreSummary, MapError> {
    let mut tiles: Vec<TileId> =
        map.entries().map(|entry| entry.tile).filter(|&tile| is_wanted(tile)).collect();
    tiles.sort_unstable();
    let thinned = Thinned { map, tally, tiles, is_out, most_out };
    write_map(&thinned, TileSpan::default(), (path, map.origin(), durability), on_tile)
}

struct Thinned<'a, F> {
    map: &'a Store,
    tally: &'a Tally,
    tiles: Vec<TileId>,
    is_out: F,
    most_out: f64,
}

impl<F: Fn(Met) -> bool + Sync> SummedTiles for Thinned<'_, F> {
    fn lattice(&self) -> Lattice {
        self.map.lattice()
    }

    fn tiles(&self) -> Vec<TileId> {
        self.tiles.clone()
    }

    fn most_bytes(&self, tile: TileId) -> usize {
        self.map.entry(tile).map_or(0, TileEntry::surfels) as usize * size_of::<SurfelCode>()
    }

    fn room_bytes(&self) -> usize {
        ROOM_BYTES
    }

    fn surfels(&self, tile: TileId) -> Result<TileSurfels, MapError> {
        let mut content = self.map.own_codes(tile)?;
        let met = self.tally.of_tile(tile, content.codes.len())?;
        let rays_on = |met: &[Met]| met.iter().map(|met| u64::from(met.on)).sum::<u64>();
        let out: Vec<Met> = met.iter().copied().filter(|&met| (self.is_out)(met)).collect();
        if rays_on(&out) as f64 <= self.most_out * rays_on(&met) as f64 {
            let mut is_out = met.into_iter().map(&self.is_out);
            content.left_out = content.codes.extract_if(.., |_| is_out.next() == Some(true)).collect();
        }
        Ok(content)
    }
}
