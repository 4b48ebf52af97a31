//! Maps whose tiles lie in a file as rays are cast into them.

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use dmp_map::{
    Blob, Durability, Form, MapError, Store, StoreSummary, StoredTiles, StoredTilesWriter, TileEntry,
    TileExtent, TileId,
};
use rayon::prelude::*;

use crate::ready::{CastSource, MappedTile, ReadyTile};
use crate::tile::{BuiltTile, CastTile, LEAF_DISCS, Leaf, LeafSupport, Node, WIDTH};

/// A map in the cast-ready form: some eight times as large as the [`Store`] it was made of, and rays can be cast
/// into it at once, from the pages of the mapped file.
///
/// Opening checks everything but the tiles, the first use of a tile checks that tile: nothing damaged is ever cast
/// into.
#[derive(Debug)]
pub struct ReadyMap {
    file: StoredTiles,
    checked: Mutex<HashSet<TileId>>,
}

impl ReadyMap {
    /// Opens a map and checks its header, directory and footer.
    ///
    /// # Errors
    /// When the file cannot be read, is no map, is of another version or form, cut short or damaged.
    pub fn open(path: &Path) -> Result<Self, MapError> {
        if cfg!(target_endian = "big") {
            return Err(MapError::ByteOrder { path: path.to_path_buf() });
        }
        let file = StoredTiles::open(path, Form::CastReady)?;
        for entry in file.entries() {
            check_sizes(entry).map_err(|detail| MapError::Damaged {
                path: path.to_path_buf(),
                part: "directory",
                detail: format!("tile {}: {detail}", entry.tile),
            })?;
        }
        Ok(Self { file, checked: Mutex::default() })
    }

    /// Writes the map of a store in the cast-ready form. `on_tile` is told after each batch how many tiles are
    /// done, of how many.
    ///
    /// # Errors
    /// When a tile of the store is damaged, or the file cannot be written; then none appears at `path`.
    pub fn write(
        store: &Store,
        path: &Path,
        durability: Durability,
        on_tile: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<StoreSummary, MapError> {
        if cfg!(target_endian = "big") {
            return Err(MapError::ByteOrder { path: path.to_path_buf() });
        }
        let radius_m = store.lattice().disc_radius_m() as f32;
        let mut writer = StoredTilesWriter::create(path, Form::CastReady, store.lattice(), store.origin())?;
        let mut entries: Vec<&TileEntry> = store.entries().collect();
        entries.sort_unstable_by_key(|entry| entry.tile);
        let mut done = 0;
        for batch in entries.chunks(2 * rayon::current_num_threads()) {
            let built: Vec<Result<_, MapError>> = batch
                .par_iter()
                .map(|entry| Ok(store.load(entry.tile)?.map(|tile| BuiltTile::new(&tile, radius_m))))
                .collect();
            for (entry, tile) in batch.iter().zip(built) {
                let tile = tile?.unwrap_or_default();
                let CastTile { nodes, leaves, support, .. } = tile.view();
                let in_file = writer.put_blob(&[bytemuck::cast_slice(nodes)])?;
                let own = Blob { surfels: entry.own.surfels, rows: nodes.len() as u32, ..in_file };
                let in_file =
                    writer.put_blob(&[bytemuck::cast_slice(leaves), bytemuck::cast_slice(support)])?;
                let borders = Blob { surfels: entry.borders.surfels, rows: leaves.len() as u32, ..in_file };
                writer.entry_mut(entry.tile, || TileEntry { own, borders, ..**entry });
            }
            done += batch.len() as u64;
            on_tile(done, entries.len() as u64);
        }
        writer.finish(durability)
    }

    /// The file: its grid, its text, its directory.
    pub fn file(&self) -> &StoredTiles {
        &self.file
    }

    /// Compares a tile with its checksums and looks through its tree, when it is used first.
    fn check(&self, entry: &TileEntry, tile: &CastTile<'_>) -> Result<(), MapError> {
        check_tree(tile, entry).map_err(|detail| self.file.damaged_tile(entry.tile, &entry.own, detail))
    }
}

impl CastSource for ReadyMap {
    fn edge_m(&self) -> f64 {
        self.file.lattice().tile_edge_m()
    }

    fn bounds(&self) -> Option<[TileId; 2]> {
        self.file.bounds()
    }

    #[inline]
    fn extent(&self, tile: TileId) -> Option<TileExtent> {
        Some(self.file.entry(tile)?.extent)
    }

    fn load_ready(&self, tile: TileId) -> Result<ReadyTile, MapError> {
        let Some(entry) = self.file.entry(tile) else { return Ok(ReadyTile::default()) };
        let lattice = self.file.lattice();
        let set = || self.checked.lock().unwrap_or_else(PoisonError::into_inner);
        let known = set().contains(&tile);
        let bytes = |blob: &Blob| {
            if known { Ok(self.file.blob_as_checked(blob)) } else { self.file.blob(tile, blob) }
        };
        let mapped = MappedTile {
            origin_in_world_m: entry.origin_in_world_m(&lattice),
            radius_m: lattice.disc_radius_m() as f32,
            nodes: bytes(&entry.own)?,
            leaves: bytes(&entry.borders)?,
        };
        if !known {
            self.check(entry, &mapped.view())?;
            set().insert(tile);
        }
        Ok(ReadyTile::mapped(mapped))
    }
}

/// Whether the blobs are as long as what they stand for, and that may be together.
fn check_sizes(entry: &TileEntry) -> Result<(), String> {
    let (nodes, leaves) = (&entry.own, &entry.borders);
    let leaf_bytes = size_of::<Leaf>() + size_of::<LeafSupport>();
    for (what, blob, bytes) in [("nodes", nodes, size_of::<Node>()), ("leaves", leaves, leaf_bytes)] {
        if u64::from(blob.rows) * bytes as u64 != u64::from(blob.bytes) {
            return Err(format!("{} {what} of {bytes} bytes are not {} bytes", blob.rows, blob.bytes));
        }
    }
    let surfels = entry.surfels();
    let most = u64::from(leaves.rows) * LEAF_DISCS as u64;
    // A leaf holds a disc, and a node all but a root of one leaf holds two of either.
    if nodes.rows > leaves.rows
        || u64::from(leaves.rows) > surfels
        || surfels > most
        || (surfels > 0 && nodes.rows == 0)
    {
        return Err(format!("{surfels} surfels in {} leaves below {} nodes", leaves.rows, nodes.rows));
    }
    Ok(())
}

/// Whether a walk down the tree ends, and never leaves it: every child exists, lies behind its parent and has no
/// other.
fn check_tree(tile: &CastTile<'_>, entry: &TileEntry) -> Result<(), String> {
    let found = [tile.nodes.len(), tile.leaves.len(), tile.support.len()];
    let wanted = [entry.own.rows, entry.borders.rows, entry.borders.rows].map(|rows| rows as usize);
    if found != wanted {
        return Err(format!("{found:?} nodes, leaves and supports could be mapped of {wanted:?}"));
    }
    let mut has_parent = [vec![false; tile.nodes.len()], vec![false; tile.leaves.len()]];
    for (index, node) in tile.nodes.iter().enumerate() {
        for place in 0..WIDTH {
            if (0..6).all(|k| node.bounds[k][place] == Node::EMPTY.bounds[k][place]) {
                // Nothing can meet it.
                continue;
            }
            let child = node.children[place] as usize;
            let is_leaf = node.leaves >> place & 1 == 1;
            let seen = has_parent[usize::from(is_leaf)].get_mut(child);
            let is_new = seen.is_some_and(|seen| !std::mem::replace(seen, true));
            if !is_new || !(is_leaf || child > index) {
                return Err(format!("node {index} has child {child} of {wanted:?} nodes and leaves"));
            }
        }
    }
    Ok(())
}
