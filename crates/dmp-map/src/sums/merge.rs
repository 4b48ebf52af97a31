//! Merges files of sums into a map or a part of one.

use std::collections::BTreeMap;
use std::path::Path;

use dmp_disk::TileId;

use super::file::SumsFile;
use crate::MapError;
use crate::grid::{Lattice, TileSpan};
use crate::store::{Durability, Origin, StoreSummary};
use crate::surfels::{SurfelCode, TileSurfels, surfels_of};
use crate::voxels::Merged;
use crate::write_map::{SummedTiles, write_map};

/// Merges the sums of `files` per voxel, computes surfels and writes the tiles of `span` to a store at `path`, equal to
/// those of the whole store. In memory are surfels of at most `budget_bytes`, and for each thread a block of each file.
/// `on_tile` receives, after each batch, the number of finished tiles and their total.
///
/// # Errors
/// When a file is damaged, or the store cannot be written; then no store appears at `path`.
pub fn merge_sums(
    lattice: Lattice,
    files: &[SumsFile],
    span: TileSpan,
    budget_bytes: usize,
    (path, origin, durability): (&Path, &Origin, Durability),
    on_tile: &(dyn Fn(u64, u64) + Sync),
) -> Result<StoreSummary, MapError> {
    let mut voxels: BTreeMap<TileId, usize> = BTreeMap::new();
    for block in files.iter().flat_map(SumsFile::blocks).filter(|block| span.touches(block.tile())) {
        *voxels.entry(block.tile()).or_default() += block.voxels() as usize;
    }
    let sums = FileSums { lattice, files, voxels, room_bytes: budget_bytes };
    write_map(&sums, span, (path, origin, durability), on_tile)
}

/// Files of sums, merged.
struct FileSums<'a> {
    lattice: Lattice,
    files: &'a [SumsFile],
    /// Over all files.
    voxels: BTreeMap<TileId, usize>,
    room_bytes: usize,
}

impl SummedTiles for FileSums<'_> {
    fn lattice(&self) -> Lattice {
        self.lattice
    }

    fn tiles(&self) -> Vec<TileId> {
        self.voxels.keys().copied().collect()
    }

    fn most_bytes(&self, tile: TileId) -> usize {
        self.voxels.get(&tile).copied().unwrap_or(0).saturating_mul(size_of::<SurfelCode>())
    }

    fn room_bytes(&self) -> usize {
        self.room_bytes
    }

    fn surfels(&self, tile: TileId) -> Result<TileSurfels, MapError> {
        let voxels = Merged::new(self.files.iter().map(|file| file.voxels_of(tile)).collect());
        surfels_of(&self.lattice, voxels)
    }
}
