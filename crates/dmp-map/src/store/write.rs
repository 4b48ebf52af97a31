//! Writes a store.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use dmp_disk::{OutputFile, TileId};

use super::columns::pack;
use super::layout::{
    Blob, END_MAGIC, FORM, HEADER_BYTES, MAGIC, MAX_DIRECTORY_BYTES, MAX_TEXT_BYTES, MAX_TILE_SURFELS,
    Origin, TileEntry, VERSION,
};
use super::read::Store;
use crate::MapError;
use crate::grid::Lattice;
use crate::surfels::{SurfelCode, TileSurfels};
use crate::thickness::SampledCells;

/// Whether a store must survive a power cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Synced to disk before it gets its name.
    Durable,
    /// Named without waiting for the disk: for files that end with the process.
    Temporary,
}

/// The summary of a finished store.
#[derive(Debug, Clone, PartialEq)]
pub struct StoreSummary {
    /// Its path.
    pub path: PathBuf,
    /// Non-empty tiles.
    pub tiles: u64,
    /// Surfels, copies over borders not counted.
    pub surfels: u64,
    /// Copies of discs over tile borders.
    pub border_copies: u64,
    /// Occupied voxels without a surfel: too few points, or no plane.
    pub thin_voxels: u64,
    /// Length of the file.
    pub bytes: u64,
    /// The sums of a sample of cells; none in a map that is merged from files, or thinned.
    pub cells: SampledCells,
}

/// Writes a store tile by tile, under a temporary name until it is complete.
#[derive(Debug)]
pub(crate) struct StoreWriter {
    path: PathBuf,
    file: BufWriter<File>,
    output: OutputFile,
    at: u64,
    lattice: Lattice,
    origin: Origin,
    entries: BTreeMap<TileId, TileEntry>,
    thin_voxels: u64,
}

impl StoreWriter {
    /// Begins a file at `path`.
    ///
    /// # Errors
    /// When it cannot be created there.
    pub(crate) fn create(path: &Path, lattice: Lattice, origin: &Origin) -> Result<Self, MapError> {
        let created = OutputFile::create(path).and_then(|output| Ok((output.file()?, output)));
        let (file, output) = created.map_err(MapError::io(path, "cannot create the store"))?;
        let mut header = Vec::new();
        header.extend(MAGIC);
        let grid = [lattice.voxel_units(), lattice.tile_voxels(), lattice.across_steps()];
        for value in [VERSION, FORM].into_iter().chain(grid) {
            header.extend(value.to_le_bytes());
        }
        header.resize(HEADER_BYTES - 4, 0);
        header.extend(crc32fast::hash(&header).to_le_bytes());
        let mut origin = origin.clone();
        origin.text.truncate(origin.text.floor_char_boundary(MAX_TEXT_BYTES));
        let path = path.to_path_buf();
        let (file, entries) = (BufWriter::new(file), BTreeMap::new());
        let mut writer = Self { path, file, output, at: 0, lattice, origin, entries, thin_voxels: 0 };
        writer.put(&header)?;
        Ok(writer)
    }

    pub(crate) fn base_voxel_z(&self, tile: TileId) -> Option<i32> {
        self.entries.get(&tile).map(|entry| entry.base_voxel_z)
    }

    pub(crate) fn write_own(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        self.thin_voxels += content.thin_voxels;
        if !content.codes.is_empty() {
            let blobs = [&content.codes, &content.left_out].map(|codes| self.write_blob(tile, codes));
            let [own, left_out] = blobs;
            let entry = self.bound(tile, content);
            (entry.own, entry.left_out) = (own?, left_out?);
        }
        Ok(())
    }

    pub(crate) fn write_borders(&mut self, tile: TileId, content: &TileSurfels) -> Result<(), MapError> {
        let blob = self.write_blob(tile, &content.codes)?;
        self.bound(tile, content).borders = blob;
        Ok(())
    }

    fn bound(&mut self, tile: TileId, content: &TileSurfels) -> &mut TileEntry {
        let lattice = self.lattice;
        let entry = self.entries.entry(tile).or_insert_with(|| TileEntry::new(tile, content.base_voxel_z));
        entry.bound(content.surfels(&lattice), &lattice);
        entry
    }

    fn write_blob(&mut self, tile: TileId, codes: &[SurfelCode]) -> Result<Blob, MapError> {
        let count = codes.len();
        if count == 0 {
            return Ok(Blob::default());
        }
        let surfels = u32::try_from(count).ok().filter(|&surfels| surfels <= MAX_TILE_SURFELS);
        let surfels = surfels.ok_or_else(|| MapError::Damaged {
            path: self.path.clone(),
            part: "plan",
            detail: format!(
                "tile {tile} would hold {count} surfels, more than the {MAX_TILE_SURFELS} a tile may have"
            ),
        })?;
        let (packed, rows) = pack(codes).map_err(MapError::io(&self.path, "cannot compress a tile"))?;
        Ok(Blob { surfels, rows, ..self.put_blob(&packed)? })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), MapError> {
        self.file.write_all(bytes).map_err(MapError::io(&self.path, "cannot write the store"))?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Writes a blob; the caller sets its content fields.
    fn put_blob(&mut self, content: &[u8]) -> Result<Blob, MapError> {
        let offset = self.at;
        let bytes = u32::try_from(content.len()).map_err(|_| MapError::Damaged {
            path: self.path.clone(),
            part: "plan",
            detail: format!("a tile would have {} bytes, more than the 4 GiB it may have", content.len()),
        })?;
        self.put(content)?;
        Ok(Blob { offset, bytes, crc32: crc32fast::hash(content), ..Blob::default() })
    }

    /// Copies a tile from another store, unchanged.
    ///
    /// # Errors
    /// When it is damaged, or cannot be written.
    pub(crate) fn copy(&mut self, from: &Store, entry: &TileEntry) -> Result<(), MapError> {
        let mut copied = *entry;
        for blob in [&mut copied.own, &mut copied.borders, &mut copied.left_out] {
            if blob.surfels > 0 {
                let bytes = from.blob(entry.tile, blob)?;
                *blob = Blob { surfels: blob.surfels, rows: blob.rows, ..self.put_blob(&bytes)? };
            }
        }
        match self.entries.insert(entry.tile, copied) {
            None => Ok(()),
            Some(_) => Err(MapError::Damaged {
                path: from.path().to_owned(),
                part: "directory",
                detail: format!("tile {} is in another store too", entry.tile),
            }),
        }
    }

    /// Writes directory and footer, then names the file.
    ///
    /// # Errors
    /// When they cannot be written; then `path` is unchanged.
    pub(crate) fn finish(mut self, durability: Durability) -> Result<StoreSummary, MapError> {
        let mut directory = Vec::new();
        directory.extend((self.origin.text.len() as u32).to_le_bytes());
        directory.extend(self.origin.text.as_bytes());
        directory.extend(self.origin.frame_bytes());
        for entry in self.entries.values() {
            entry.encode(&mut directory);
        }
        if directory.len() as u64 > MAX_DIRECTORY_BYTES {
            let tiles = self.entries.len();
            let error = std::io::Error::other(format!("{tiles} tiles, more than a store may have"));
            return Err(MapError::io(&self.path, "cannot write the store")(error));
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
        self.file.into_inner().map_err(|e| io("cannot write the store")(e.into_error()))?;
        let named = match durability {
            Durability::Durable => self.output.commit(),
            Durability::Temporary => self.output.commit_unsynced(),
        };
        named.map_err(io("cannot give the store its name"))?;
        Ok(StoreSummary {
            tiles: self.entries.len() as u64,
            surfels: self.entries.values().map(|e| u64::from(e.own.surfels)).sum(),
            border_copies: self.entries.values().map(|e| u64::from(e.borders.surfels)).sum(),
            thin_voxels: self.thin_voxels,
            bytes: self.at,
            cells: SampledCells::default(),
            path: self.path,
        })
    }
}
