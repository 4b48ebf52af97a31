//! Joins stores with disjoint tiles of a map into one.

use std::path::Path;

use super::layout::Origin;
use super::read::Store;
use super::write::{Durability, StoreSummary, StoreWriter};
use crate::MapError;
use crate::grid::Lattice;

/// Writes the tiles of `stores`, which must be disjoint, to one store at `path`. Tiles are copied unchanged.
///
/// # Errors
/// When a store is damaged or has another grid, two have the same tile, or the file cannot be written.
pub fn join_stores(
    lattice: Lattice,
    stores: &[Store],
    (path, origin, durability): (&Path, &Origin, Durability),
) -> Result<StoreSummary, MapError> {
    let mut writer = StoreWriter::create(path, lattice, origin)?;
    for store in stores {
        if store.lattice() != lattice {
            let (found, wanted) = (store.lattice().voxel_m(), lattice.voxel_m());
            let detail = format!("voxels of {found} m, where those of the others have {wanted} m");
            return Err(MapError::Damaged { path: store.path().to_owned(), part: "header", detail });
        }
        let mut entries: Vec<_> = store.entries().collect();
        entries.sort_by_key(|entry| entry.tile);
        entries.into_iter().try_for_each(|entry| writer.copy(store, entry))?;
    }
    writer.finish(durability)
}
