use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use dmp_disk::TileId;
use tempfile::NamedTempFile;

use super::layout::{Blob, END_MAGIC, Form, HEADER_BYTES, MAGIC, MAX_TEXT_BYTES, Origin, TileEntry, VERSION};
use crate::MapError;
use crate::lattice::Lattice;

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
    /// Occupied voxels that gave no surfel: too few points, or no plane. Not known of a store that was made of
    /// another: 0.
    pub thin_voxels: u64,
    /// Length of the file.
    pub bytes: u64,
}

/// Writes a file of tiles in either form, blob by blob, under a temporary name until it is whole.
#[derive(Debug)]
pub struct StoredTilesWriter {
    path: PathBuf,
    file: BufWriter<NamedTempFile>,
    at: u64,
    form: Form,
    origin: Origin,
    entries: BTreeMap<TileId, TileEntry>,
}

impl StoredTilesWriter {
    /// Begins a file at `path`.
    ///
    /// # Errors
    /// When it cannot be made there.
    pub fn create(path: &Path, form: Form, lattice: Lattice, origin: &Origin) -> Result<Self, MapError> {
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
        let grid = [lattice.voxel_units(), lattice.tile_voxels(), lattice.across_steps()];
        for value in [VERSION, form.code()].into_iter().chain(grid) {
            header.extend(value.to_le_bytes());
        }
        header.resize(HEADER_BYTES - 4, 0);
        header.extend(crc32fast::hash(&header).to_le_bytes());
        let mut origin = origin.clone();
        origin.text.truncate(origin.text.floor_char_boundary(MAX_TEXT_BYTES));
        let path = path.to_path_buf();
        let (file, entries) = (BufWriter::new(file), BTreeMap::new());
        let mut writer = Self { path, file, at: 0, form, origin, entries };
        writer.put(&header)?;
        Ok(writer)
    }

    /// Where it is to be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the directory is to say of a tile.
    pub fn entry(&self, tile: TileId) -> Option<&TileEntry> {
        self.entries.get(&tile)
    }

    /// The same, to be changed; `new` where there is none yet.
    pub fn entry_mut(&mut self, tile: TileId, new: impl FnOnce() -> TileEntry) -> &mut TileEntry {
        self.entries.entry(tile).or_insert_with(new)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), MapError> {
        self.file.write_all(bytes).map_err(MapError::io(&self.path, "cannot write the store"))?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Writes a blob, one part after the other, and zeros up to where the next may begin. What the blob stands for
    /// is left open.
    ///
    /// # Errors
    /// When it cannot be written, or is longer than 4 GiB.
    pub fn put_blob(&mut self, parts: &[&[u8]]) -> Result<Blob, MapError> {
        let offset = self.at;
        let content: usize = parts.iter().map(|part| part.len()).sum();
        let zeros = [0; 64];
        let filling = &zeros[..content.next_multiple_of(self.form.alignment()) - content];
        let bytes = u32::try_from(content + filling.len()).map_err(|_| MapError::Damaged {
            path: self.path.clone(),
            part: "plan",
            detail: format!("a tile would have {content} bytes, more than the 4 GiB it may have"),
        })?;
        let mut crc32 = crc32fast::Hasher::new();
        for part in parts.iter().copied().chain([filling]) {
            crc32.update(part);
            self.put(part)?;
        }
        Ok(Blob { offset, bytes, crc32: crc32.finalize(), ..Blob::default() })
    }

    /// Directory and footer, then the name.
    ///
    /// # Errors
    /// When they cannot be written; then no file appears, and what was there before is untouched.
    pub fn finish(mut self, durability: Durability) -> Result<StoreSummary, MapError> {
        let mut directory = Vec::new();
        directory.extend((self.origin.text.len() as u32).to_le_bytes());
        directory.extend(self.origin.text.as_bytes());
        directory.extend(self.origin.frame_bytes());
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
            thin_voxels: 0,
            bytes: self.at,
            path: self.path,
        })
    }
}
