use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::layout::{
    Blob, END_MAGIC, MAGIC, MAX_PROVENANCE_BYTES, MAX_TILE_SURFELS, TileEntry, VERSION, encode_columns,
};
use crate::MapError;
use crate::lattice::{Lattice, TileId};
use crate::surfel::TileSurfels;

/// Whether a store is to survive a power cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Synchronised to disk before it gets its name.
    Durable,
    /// Scratch: given its name without waiting for the disk.
    Scratch,
}

/// What a finished store holds.
#[derive(Debug, Clone, PartialEq)]
pub struct StoreSummary {
    /// Where it is.
    pub path: PathBuf,
    /// Tiles with anything in them.
    pub tiles: u64,
    /// Surfels, copies over borders not counted.
    pub surfels: u64,
    /// Copies of discs over tile borders.
    pub border_copies: u64,
    /// Occupied voxels that gave no surfel: too few points, or no plane.
    pub thin_voxels: u64,
    /// Length of the file.
    pub bytes: u64,
}

/// Writes a store tile by tile, under a temporary name until it is whole.
#[derive(Debug)]
pub(crate) struct StoreWriter {
    path: PathBuf,
    file: BufWriter<NamedTempFile>,
    at: u64,
    lattice: Lattice,
    provenance: String,
    entries: BTreeMap<TileId, TileEntry>,
    thin_voxels: u64,
    columns: Vec<u8>,
}

impl StoreWriter {
    pub(crate) fn create(path: &Path, lattice: Lattice, provenance: &str) -> Result<Self, MapError> {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".dmp-store-");
        // As any other output file: others may read it, as far as the user's mask lets them.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder);
        let file = file.map_err(MapError::io(path, "cannot create the store"))?;
        let mut header = Vec::new();
        header.extend(MAGIC);
        header.extend(VERSION.to_le_bytes());
        header.extend(lattice.voxel_units().to_le_bytes());
        header.extend(lattice.tile_voxels().to_le_bytes());
        header.extend(crc32fast::hash(&header).to_le_bytes());
        let mut cut = provenance.len().min(MAX_PROVENANCE_BYTES);
        while !provenance.is_char_boundary(cut) {
            cut -= 1;
        }
        let mut writer = Self {
            path: path.to_path_buf(),
            file: BufWriter::new(file),
            at: 0,
            lattice,
            provenance: provenance[..cut].to_owned(),
            entries: BTreeMap::new(),
            thin_voxels: 0,
            columns: Vec::new(),
        };
        writer.put(&header)?;
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), MapError> {
        self.file.write_all(bytes).map_err(MapError::io(&self.path, "cannot write the store"))?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    pub(crate) fn base_z_m(&self, tile: TileId) -> Option<f64> {
        self.entries.get(&tile).map(|entry| entry.base_z_m)
    }

    pub(crate) fn write_own(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        self.thin_voxels += content.thin_voxels;
        if !content.surfels.is_empty() {
            let blob = self.write_blob(tile, content)?;
            self.entry(tile, content).own = blob;
        }
        Ok(())
    }

    pub(crate) fn write_borders(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        let blob = self.write_blob(tile, content)?;
        self.entry(tile, content).borders = blob;
        Ok(())
    }

    fn entry(&mut self, tile: TileId, content: &TileSurfels) -> &mut TileEntry {
        let radius_m = self.lattice.disc_radius_m() as f32;
        let entry = self.entries.entry(tile).or_insert_with(|| TileEntry::new(tile, content.base_z_m));
        entry.bound(&content.surfels, radius_m);
        entry
    }

    fn write_blob(&mut self, tile: TileId, content: &TileSurfels) -> Result<Blob, MapError> {
        let too_many = |count: usize| MapError::Damaged {
            path: self.path.clone(),
            part: "plan",
            detail: format!(
                "tile {tile} would hold {count} surfels, more than the {MAX_TILE_SURFELS} a tile may have"
            ),
        };
        let surfels = u32::try_from(content.surfels.len()).map_err(|_| too_many(content.surfels.len()))?;
        if surfels > MAX_TILE_SURFELS {
            return Err(too_many(content.surfels.len()));
        }
        encode_columns(&content.surfels, &mut self.columns);
        let compressed = zstd::bulk::compress(&self.columns, 1)
            .map_err(MapError::io(&self.path, "cannot compress a tile"))?;
        let offset = self.at;
        self.put(&compressed)?;
        Ok(Blob { offset, bytes: compressed.len() as u32, surfels, crc32: crc32fast::hash(&compressed) })
    }

    /// Directory and footer, then the name.
    pub(crate) fn finish(mut self, durability: Durability) -> Result<StoreSummary, MapError> {
        let mut directory = Vec::new();
        directory.extend((self.provenance.len() as u32).to_le_bytes());
        directory.extend(self.provenance.as_bytes());
        for entry in self.entries.values() {
            entry.encode(&mut directory);
        }
        let mut footer = Vec::new();
        footer.extend(self.at.to_le_bytes());
        footer.extend((directory.len() as u64).to_le_bytes());
        footer.extend(crc32fast::hash(&directory).to_le_bytes());
        footer.extend((self.entries.len() as u64).to_le_bytes());
        footer.extend(crc32fast::hash(&footer).to_le_bytes());
        footer.extend(END_MAGIC);
        self.put(&directory)?;
        self.put(&footer)?;

        let io = |what| MapError::io(&self.path, what);
        let file = self.file.into_inner().map_err(|e| io("cannot write the store")(e.into_error()))?;
        if durability == Durability::Durable {
            file.as_file().sync_all().map_err(io("cannot write the store to disk"))?;
        }
        file.persist(&self.path).map_err(|e| io("cannot give the store its name")(e.error))?;
        Ok(StoreSummary {
            tiles: self.entries.len() as u64,
            surfels: self.entries.values().map(|e| u64::from(e.own.surfels)).sum(),
            border_copies: self.entries.values().map(|e| u64::from(e.borders.surfels)).sum(),
            thin_voxels: self.thin_voxels,
            bytes: self.at,
            path: self.path,
        })
    }
}
