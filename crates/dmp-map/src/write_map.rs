//! Writes a store from voxel sums, tile by tile.

use std::collections::BTreeMap;
use std::iter::Peekable;
use std::path::Path;

use dmp_disk::TileId;
use rayon::prelude::*;

use crate::MapError;
use crate::grid::{Lattice, TileSpan};
use crate::store::{Durability, Origin, StoreSummary, StoreWriter};
use crate::surfels::{SurfelCode, TileSurfels, borders_of};

/// The sums of all tiles of a map.
pub(crate) trait SummedTiles: Sync {
    fn lattice(&self) -> Lattice;

    /// The non-empty tiles, in order.
    fn tiles(&self) -> Vec<TileId>;

    /// Upper bound of the bytes of a tile's surfels.
    fn most_bytes(&self, tile: TileId) -> usize;

    /// Bytes available for surfels.
    fn room_bytes(&self) -> usize;

    /// The surfels of a tile. Called once per tile.
    fn surfels(&self, tile: TileId) -> Result<TileSurfels, MapError>;
}

/// Computes surfels from sums and writes those of the tiles in `span` to a store. `sums` must also have the
/// neighbouring tiles: their discs reach over borders. `on_tile` receives, after each batch, the number of finished
/// tiles and their total.
///
/// # Errors
/// When sums cannot be read or the store cannot be written; then `path` is unchanged.
pub(crate) fn write_map(
    sums: &impl SummedTiles,
    span: TileSpan,
    (path, origin, durability): (&Path, &Origin, Durability),
    on_tile: &(dyn Fn(u64, u64) + Sync),
) -> Result<StoreSummary, MapError> {
    let (lattice, tiles) = (sums.lattice(), sums.tiles());
    let total = tiles.len() as u64;
    let mut writer = StoreWriter::create(path, lattice, origin)?;
    let mut borders = BorderQueue { waiting: BTreeMap::new() };
    let mut done = 0;
    let mut tiles = tiles.into_iter().peekable();
    loop {
        let batch = next_batch(sums, &mut tiles);
        if batch.is_empty() {
            break;
        }
        let contents: Vec<Result<TileSurfels, MapError>> =
            batch.par_iter().map(|&tile| sums.surfels(tile)).collect();
        for (&tile, content) in batch.iter().zip(contents) {
            let content = content?;
            borders.write_rows_below(tile.y - 1, &mut writer)?;
            let copies = borders_of(&lattice, tile, &content);
            for (neighbour, border) in copies.into_iter().filter(|&(neighbour, _)| span.contains(neighbour)) {
                borders.waiting.entry(neighbour).or_default().push(border);
            }
            if span.contains(tile) {
                writer.write_own(tile, &content)?;
            }
        }
        done += batch.len() as u64;
        on_tile(done, total);
    }
    borders.write_rows_below(i32::MAX, &mut writer)?;
    writer.finish(durability)
}

/// The next tiles whose surfels fit together, at least one.
fn next_batch(sums: &impl SummedTiles, tiles: &mut Peekable<impl Iterator<Item = TileId>>) -> Vec<TileId> {
    let mut batch = Vec::new();
    let mut room = sums.room_bytes();
    while batch.len() < 2 * rayon::current_num_threads()
        && let Some(tile) = tiles.next_if(|&tile| {
            let bytes = sums.most_bytes(tile);
            let has_room = batch.is_empty() || bytes <= room;
            room = room.saturating_sub(bytes);
            has_room
        })
    {
        batch.push(tile);
    }
    batch
}

/// Discs copied over borders wait here until all neighbours of their tile are done. Tiles come row by row, so the queue
/// never exceeds about two rows of borders.
#[derive(Debug)]
struct BorderQueue {
    waiting: BTreeMap<TileId, Vec<SurfelCode>>,
}

impl BorderQueue {
    fn write_rows_below(&mut self, row: i32, writer: &mut StoreWriter) -> Result<(), MapError> {
        while let Some(entry) = self.waiting.first_entry() {
            let tile = *entry.key();
            if tile.y >= row && row != i32::MAX {
                break;
            }
            let codes = entry.remove();
            let base_voxel_z = writer.base_voxel_z(tile).unwrap_or_else(|| codes[codes.len() / 2].voxel[2]);
            writer.write_borders(tile, &TileSurfels { base_voxel_z, codes, ..TileSurfels::default() })?;
        }
        Ok(())
    }
}
