//! Loads tiles of a store.

use dmp_disk::TileId;
use dmp_sensor::{Point3, Vector3};

use super::columns::{Whose, unpack};
use super::layout::{Blob, TileEntry};
use super::read::Store;
use crate::MapError;
use crate::surfels::{Decoder, SurfelCode, Tile, TileExtent, TileSource, TileSurfels};

/// A disc of a map in its maker's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnDisc {
    /// Its centre, metres.
    pub centre_in_own_m: [f64; 3],
    /// Its unit normal; its sign has no meaning.
    pub normal_in_own: [f32; 3],
}

impl Store {
    /// Loads a tile; `None` where the map is empty. `O(surfels)`.
    ///
    /// # Errors
    /// When the tile's bytes are damaged.
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

    /// A tile's own surfels as written; none where the map is empty.
    pub(crate) fn own_codes(&self, tile: TileId) -> Result<TileSurfels, MapError> {
        let Some(entry) = self.entry(tile) else { return Ok(TileSurfels::default()) };
        let mut codes = Vec::with_capacity(entry.own.surfels as usize);
        self.codes(entry, &entry.own, Whose::Own, |code| codes.push(*code))?;
        Ok(TileSurfels { base_voxel_z: entry.base_voxel_z, codes, ..TileSurfels::default() })
    }

    /// The voxels of a tile whose surfels the map leaves out.
    pub(crate) fn left_out(&self, tile: TileId) -> Result<Vec<[i32; 3]>, MapError> {
        let Some(entry) = self.entry(tile) else { return Ok(Vec::new()) };
        let mut voxels = Vec::with_capacity(entry.left_out.surfels as usize);
        self.codes(entry, &entry.left_out, Whose::Own, |code| voxels.push(code.voxel))?;
        Ok(voxels)
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

impl TileSource for Store {
    fn tile_edge_m(&self) -> f64 {
        self.lattice().tile_edge_m()
    }

    fn disc_radius_m(&self) -> f64 {
        self.lattice().disc_radius_m()
    }

    fn tile_bounds(&self) -> Option<[TileId; 2]> {
        self.bounds()
    }

    #[inline]
    fn tile_extent(&self, tile: TileId) -> Option<TileExtent> {
        Some(self.entry(tile)?.extent)
    }

    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        self.load(tile)
    }
}
