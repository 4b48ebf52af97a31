//! A map without some of its surfels.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::hash::BuildHasherDefault;
use std::path::Path;

use dmp_disk::TileId;

use crate::MapError;
use crate::grid::{MixHasher, TileSpan};
use crate::store::{Durability, Origin, Store, StoreSummary, TileEntry};
use crate::surfels::borders_of;
use crate::tally::{Met, Tally};
use crate::write_map::MapWriter;

/// Writes `map` to a store at `path`, without the surfels whose counts satisfy `is_out`.
///
/// # Errors
/// When the map or the tally cannot be read, or the store cannot be written; then `path` is unchanged.
pub fn thin_map(
    map: &Store,
    tally: &Tally,
    is_out: impl Fn(Met) -> bool,
    (path, origin, durability): (&Path, &Origin, Durability),
) -> Result<StoreSummary, MapError> {
    let lattice = map.lattice();
    let mut writer = MapWriter::create(path, lattice, origin, TileSpan::default())?;
    let tiles: BTreeSet<TileId> = map.entries().map(|entry| entry.tile).collect();
    // Copies of a tile's discs follow its neighbours' own, in the order of the tiles they come from.
    let mut copies_before: HashMap<TileId, usize, BuildHasherDefault<MixHasher>> = HashMap::default();
    let mut of_copies = CopyCounts { tally, tiles: HashMap::new() };
    for &id in &tiles {
        let mut content = map.own_codes(id)?;
        let surfels = map.entry(id).map_or(0, TileEntry::surfels);
        of_copies.forget_rows_below(id.y - 1);
        copies_before.retain(|tile, _| tile.y >= id.y - 1);
        let mut met = tally.of_tile(id, surfels as usize)?;
        met.truncate(content.codes.len());
        for (neighbour, index) in borders_of(&lattice, id, &content).iter().map(|c| (c.0, c.1.index)) {
            let Some(entry) = map.entry(neighbour) else { continue };
            let before = copies_before.entry(neighbour).or_default();
            let place = *before;
            *before += 1;
            let counts = of_copies.of_tile(entry)?;
            if let (Some(met), Some(count)) = (met.get_mut(index), counts.get(place)) {
                met.merge(count);
            }
        }
        let mut met = met.into_iter();
        content.codes.retain(|_| !met.next().is_some_and(&is_out));
        writer.write(id, &content)?;
    }
    writer.finish(durability)
}

/// Counts of the copies in each tile, read once and kept while their rows are in use.
struct CopyCounts<'a> {
    tally: &'a Tally,
    tiles: HashMap<TileId, Vec<Met>>,
}

impl CopyCounts<'_> {
    fn of_tile(&mut self, entry: &TileEntry) -> Result<&[Met], MapError> {
        Ok(match self.tiles.entry(entry.tile) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let mut counts = self.tally.of_tile(entry.tile, entry.surfels() as usize)?;
                new.insert(counts.split_off(entry.own.surfels as usize))
            }
        })
    }

    /// Tiles come row by row: those two rows back are not needed again.
    fn forget_rows_below(&mut self, row: i32) {
        self.tiles.retain(|tile, _| tile.y >= row);
    }
}
