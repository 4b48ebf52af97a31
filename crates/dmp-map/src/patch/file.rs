//! The file of patches.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::block::{Block, PatchVoxel, block_edge_m};
use super::builder::{Patch, PatchBuilder};
use super::gathered::Gathered;
use crate::MapError;
use crate::grid::Lattice;

/// Writes patches in any order, from any thread, to an unlinked file.
#[derive(Debug)]
pub struct PatchWriter {
    lattice: Lattice,
    folder: PathBuf,
    inner: Mutex<Inner>,
}

#[derive(Debug)]
struct Inner {
    file: File,
    end: u64,
    stored: Vec<StoredPatch>,
}

/// The position of a patch in the file.
#[derive(Debug, Clone, Default)]
struct StoredPatch {
    offset: u64,
    crc32: u32,
    blocks: Vec<Block>,
}

/// Patches of one lattice by their numbers. Their voxels are in a file that vanishes with the process; some 32 bytes
/// per block of eight metres are in memory.
#[derive(Debug)]
pub struct Patches {
    lattice: Lattice,
    folder: PathBuf,
    file: Mutex<File>,
    stored: Vec<StoredPatch>,
    /// Buffers returned after use.
    buffers: Mutex<Vec<Gathered>>,
}

impl PatchWriter {
    /// Has room for this many patches; those that are not added stay empty. Their file is created in `folder`.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn new(lattice: Lattice, patches: usize, folder: &Path) -> Result<Self, MapError> {
        let file = tempfile::tempfile_in(folder)
            .map_err(MapError::io(folder, "cannot make a file for patches here"))?;
        let inner = Inner { file, end: 0, stored: vec![StoredPatch::default(); patches] };
        Ok(Self { lattice, folder: folder.to_path_buf(), inner: Mutex::new(inner) })
    }

    /// Stores a patch under its number; one without points is not written.
    ///
    /// # Errors
    /// When the file cannot be written.
    ///
    /// # Panics
    /// When there is no such number.
    pub fn put(&self, number: usize, patch: PatchBuilder) -> Result<(), MapError> {
        let Patch { blocks, voxels } = patch.finish();
        let bytes: &[u8] = bytemuck::cast_slice(&voxels);
        let crc32 = crc32fast::hash(bytes);
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        inner.file.write_all(bytes).map_err(MapError::io(&self.folder, "cannot write patches here"))?;
        let offset = inner.end;
        inner.end += bytes.len() as u64;
        inner.stored[number] = StoredPatch { offset, crc32, blocks };
        Ok(())
    }

    /// All patches, ready to be read. Compares each with its checksum.
    ///
    /// # Errors
    /// When the file cannot be read back unchanged.
    pub fn finish(self) -> Result<Patches, MapError> {
        let Self { lattice, folder, inner } = self;
        let Inner { file, stored, .. } = inner.into_inner().unwrap_or_else(PoisonError::into_inner);
        let patches = Patches { lattice, folder, file: Mutex::new(file), stored, buffers: Mutex::default() };
        let mut voxels = Vec::new();
        for (number, patch) in patches.stored.iter().enumerate() {
            voxels.clear();
            patches.read(number, 0..patch.blocks.len(), &mut voxels)?;
            let found = crc32fast::hash(bytemuck::cast_slice(&voxels));
            if found != patch.crc32 {
                let detail = format!("patch {number}: checksum {found:08x}, {:08x} was written", patch.crc32);
                let path = patches.folder.clone();
                return Err(MapError::Damaged { path, part: "file of patches", detail });
            }
        }
        Ok(patches)
    }
}

impl Patches {
    /// Their number, including empty ones.
    pub fn len(&self) -> usize {
        self.stored.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.stored.is_empty()
    }

    /// The grid of the patches' voxels, each from its own origin, and of maps assembled from them.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// Voxels of all patches.
    pub fn voxels(&self) -> u64 {
        self.stored.iter().flat_map(|patch| &patch.blocks).map(|block| u64::from(block.voxels)).sum()
    }

    /// Bytes of their file.
    pub fn file_bytes(&self) -> u64 {
        self.voxels() * size_of::<PatchVoxel>() as u64
    }

    /// Lowest and highest corner in the patch, metres, of each of its non-empty blocks.
    pub fn bounds_m(&self, number: usize) -> impl Iterator<Item = [[f64; 3]; 2]> {
        let edge_m = block_edge_m(&self.lattice);
        self.stored[number].blocks.iter().map(move |block| block.bounds_m(edge_m))
    }

    /// Buffers to reuse, or new ones.
    pub(super) fn take_buffers(&self) -> Gathered {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    pub(super) fn give_back(&self, buffers: Gathered) {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner).push(buffers);
    }

    pub(super) fn blocks(&self, number: usize) -> &[Block] {
        &self.stored[number].blocks
    }

    /// Reads the voxels of consecutive blocks and appends them to `voxels`.
    pub(super) fn read(
        &self,
        number: usize,
        blocks: std::ops::Range<usize>,
        voxels: &mut Vec<PatchVoxel>,
    ) -> Result<(), MapError> {
        let StoredPatch { offset, blocks: of_patch, .. } = &self.stored[number];
        let [Some(first), Some(last)] = [of_patch[blocks.clone()].first(), of_patch[blocks].last()] else {
            return Ok(());
        };
        let count = (last.first + last.voxels - first.first) as usize;
        let before = voxels.len();
        voxels.resize(before + count, bytemuck::Zeroable::zeroed());
        let from = offset + u64::from(first.first) * size_of::<PatchVoxel>() as u64;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(from))
            .and_then(|_| file.read_exact(bytemuck::cast_slice_mut(&mut voxels[before..])))
            .map_err(MapError::io(&self.folder, "cannot read patches back from here"))
    }
}
