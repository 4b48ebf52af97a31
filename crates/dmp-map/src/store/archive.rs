use std::ops::Deref;
use std::path::Path;

use dmp_disk::TileId;
use dmp_sensor::{Point3, Vector3};

use super::columns::{Whose, pack, unpack};
use super::layout::{Blob, Form, MAX_TILE_SURFELS, Origin, TileEntry};
use super::read::StoredTiles;
use super::write::{Durability, StoreSummary, StoredTilesWriter};
use crate::MapError;
use crate::code::{Decoder, SurfelCode};
use crate::lattice::Lattice;
use crate::surfel::{Surfel, TileSurfels};

/// A finished map of surfels in the archive form, opened for reading; shared freely between threads.
///
/// Opening checks everything but the tiles, loading a tile checks that tile: nothing damaged is ever
/// handed out.
#[derive(Debug)]
pub struct Store(StoredTiles);

/// One tile in memory: its own surfels, then the copies of its neighbours' border discs.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Which tile.
    pub id: TileId,
    /// The place that the surfels' coordinates count from: the tile's corner and a z amid its surfels, world metres.
    pub origin_in_world_m: [f64; 3],
    /// The surfels.
    pub surfels: Vec<Surfel>,
    /// How many of them, in front, are the tile's own.
    pub own: usize,
}

impl Tile {
    /// Height that the tile's z counts from, world metres.
    pub fn base_z_m(&self) -> f64 {
        self.origin_in_world_m[2]
    }
}

/// A disc of a map in the frame of whoever made the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnDisc {
    /// Its centre, metres.
    pub centre_in_own_m: [f64; 3],
    /// Its unit normal; the sign means nothing.
    pub normal_in_own: [f32; 3],
}

/// What the file itself tells: its grid, its text, its directory.
impl Deref for Store {
    type Target = StoredTiles;

    fn deref(&self) -> &StoredTiles {
        &self.0
    }
}

impl Store {
    /// Opens a store and checks its header, directory and footer.
    ///
    /// # Errors
    /// When the file cannot be read, is no store, is of another version or form, cut short or damaged.
    pub fn open(path: &Path) -> Result<Self, MapError> {
        StoredTiles::open(path, Form::Archive).map(Self)
    }

    /// Opens a store and takes its name away: the file lives as long as somebody reads it and vanishes
    /// then, however the process ends. (Where the system does not allow that, it keeps its name.)
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_once(path: &Path) -> Result<Self, MapError> {
        let store = Self::open(path)?;
        // A name that stays is removed with the work folder it is in.
        let _ = std::fs::remove_file(path);
        Ok(store)
    }

    /// Loads a tile; `None` where the map is empty. `O(surfels)`.
    ///
    /// # Errors
    /// When the tile's bytes are not those that were written.
    pub fn load(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        let Some(entry) = self.entry(tile) else { return Ok(None) };
        let lattice = self.lattice();
        let mut surfels = Vec::with_capacity(entry.surfels() as usize);
        let mut decoder = Decoder::new(&lattice, entry.base_voxel_z);
        for (blob, whose) in [(&entry.own, Whose::Own), (&entry.borders, Whose::Neighbours)] {
            self.codes(entry, blob, whose, |code| surfels.push(decoder.surfel(code)))?;
        }
        let origin_in_world_m = entry.origin_in_world_m(&lattice);
        Ok(Some(Tile { id: tile, origin_in_world_m, surfels, own: entry.own.surfels as usize }))
    }

    /// The discs of a tile's own surfels in the frame of the map's maker, in their order; none where the map is empty.
    ///
    /// # Errors
    /// As [`Store::load`].
    pub fn discs_in_own(&self, tile: TileId) -> Result<impl Iterator<Item = OwnDisc>, MapError> {
        let loaded = self.load(tile)?;
        let origin_in_world_m = loaded.as_ref().map_or([0.0; 3], |tile| tile.origin_in_world_m);
        let surfels = loaded.map_or_else(Vec::new, |mut tile| {
            tile.surfels.truncate(tile.own);
            tile.surfels
        });
        let own_from_world = *self.own_from_world();
        Ok(surfels.into_iter().map(move |surfel| {
            let centre: [f64; 3] =
                std::array::from_fn(|k| origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k]));
            let normal = own_from_world * Vector3::from(surfel.normal.map(f64::from));
            OwnDisc {
                centre_in_own_m: (own_from_world * Point3::from(centre)).into(),
                normal_in_own: normal.map(|c| c as f32).into(),
            }
        }))
    }

    /// A tile's own surfels as they were written; none where the map is empty.
    pub(crate) fn own_codes(&self, tile: TileId) -> Result<TileSurfels, MapError> {
        let Some(entry) = self.entry(tile) else { return Ok(TileSurfels::default()) };
        let mut codes = Vec::with_capacity(entry.own.surfels as usize);
        self.codes(entry, &entry.own, Whose::Own, |code| codes.push(*code))?;
        Ok(TileSurfels { base_voxel_z: entry.base_voxel_z, codes, thin_voxels: 0 })
    }

    fn codes(
        &self,
        entry: &TileEntry,
        blob: &Blob,
        whose: Whose,
        each: impl FnMut(&SurfelCode),
    ) -> Result<(), MapError> {
        if blob.surfels == 0 {
            return Ok(());
        }
        let compressed = self.blob(entry.tile, blob)?;
        let damaged = |detail| self.damaged_tile(entry.tile, blob, detail);
        let columns = zstd::bulk::decompress(&compressed, blob.unzipped_bytes() as usize);
        let columns = columns.map_err(|error| damaged(format!("cannot decompress: {error}")))?;
        let rows = [blob.rows, blob.surfels].map(|rows| rows as usize);
        unpack(&columns, rows, &self.lattice(), whose, each).map_err(damaged)
    }
}

/// Writes a store tile by tile, under a temporary name until it is whole.
#[derive(Debug)]
pub(crate) struct StoreWriter {
    file: StoredTilesWriter,
    lattice: Lattice,
    thin_voxels: u64,
}

impl StoreWriter {
    pub(crate) fn create(path: &Path, lattice: Lattice, origin: &Origin) -> Result<Self, MapError> {
        let file = StoredTilesWriter::create(path, Form::Archive, lattice, origin)?;
        Ok(Self { file, lattice, thin_voxels: 0 })
    }

    pub(crate) fn base_voxel_z(&self, tile: TileId) -> Option<i32> {
        self.file.entry(tile).map(|entry| entry.base_voxel_z)
    }

    pub(crate) fn write_own(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        self.thin_voxels += content.thin_voxels;
        if !content.codes.is_empty() {
            let blob = self.write_blob(tile, content)?;
            self.bound(tile, content).own = blob;
        }
        Ok(())
    }

    pub(crate) fn write_borders(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        let blob = self.write_blob(tile, content)?;
        self.bound(tile, content).borders = blob;
        Ok(())
    }

    fn bound(&mut self, tile: TileId, content: &TileSurfels) -> &mut TileEntry {
        let lattice = self.lattice;
        let entry = self.file.entry_mut(tile, || TileEntry::new(tile, content.base_voxel_z));
        entry.bound(content.surfels(&lattice), &lattice);
        entry
    }

    fn write_blob(&mut self, tile: TileId, content: &TileSurfels) -> Result<Blob, MapError> {
        let count = content.codes.len();
        let surfels = u32::try_from(count).ok().filter(|&surfels| surfels <= MAX_TILE_SURFELS);
        let surfels = surfels.ok_or_else(|| MapError::Damaged {
            path: self.file.path().to_path_buf(),
            part: "plan",
            detail: format!(
                "tile {tile} would hold {count} surfels, more than the {MAX_TILE_SURFELS} a tile may have"
            ),
        })?;
        let (packed, rows) =
            pack(&content.codes).map_err(MapError::io(self.file.path(), "cannot compress a tile"))?;
        Ok(Blob { surfels, rows, ..self.file.put_blob(&[&packed])? })
    }

    /// Directory and footer, then the name.
    pub(crate) fn finish(self, durability: Durability) -> Result<StoreSummary, MapError> {
        Ok(StoreSummary { thin_voxels: self.thin_voxels, ..self.file.finish(durability)? })
    }
}
