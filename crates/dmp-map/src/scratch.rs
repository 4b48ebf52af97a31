use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;

use crate::MapError;
use crate::lattice::TileId;

/// Records read back at a time.
const BATCH: usize = 4096;

/// Parts of tiles that do not fit in memory, in one file without a name: it vanishes with the process,
/// however that ends.
#[derive(Debug)]
pub(crate) struct Scratch<T> {
    folder: PathBuf,
    inner: Mutex<Inner>,
    records: PhantomData<fn() -> T>,
}

#[derive(Debug)]
struct Inner {
    file: File,
    end: u64,
    parts: HashMap<TileId, Vec<Part>>,
}

#[derive(Debug, Clone, Copy)]
struct Part {
    offset: u64,
    records: usize,
    crc32: u32,
}

impl<T: Pod> Scratch<T> {
    pub(crate) fn new(folder: &Path) -> Result<Self, MapError> {
        let file =
            tempfile::tempfile_in(folder).map_err(MapError::io(folder, "cannot make a scratch file here"))?;
        let inner = Inner { file, end: 0, parts: HashMap::new() };
        Ok(Self { folder: folder.to_path_buf(), inner: Mutex::new(inner), records: PhantomData })
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.lock().end
    }

    pub(crate) fn tiles(&self) -> BTreeSet<TileId> {
        self.lock().parts.keys().copied().collect()
    }

    /// Puts a part of a tile behind what is there; reading gives the parts one after the other.
    pub(crate) fn append(&self, tile: TileId, records: &[T]) -> Result<(), MapError> {
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let crc32 = crc32fast::hash(bytes);
        let mut inner = self.lock();
        let offset = inner.end;
        let written = inner.file.seek(SeekFrom::Start(offset)).and_then(|_| inner.file.write_all(bytes));
        written.map_err(MapError::io(&self.folder, "cannot write the scratch file in this folder"))?;
        inner.end += bytes.len() as u64;
        inner.parts.entry(tile).or_default().push(Part { offset, records: records.len(), crc32 });
        Ok(())
    }

    /// Hands over a tile's records, part by part.
    pub(crate) fn read<E: From<MapError>>(
        &self,
        tile: TileId,
        mut each: impl FnMut(&T) -> Result<(), E>,
    ) -> Result<(), E> {
        let parts = self.lock().parts.get(&tile).cloned().unwrap_or_default();
        let mut buffer = vec![bytemuck::Zeroable::zeroed(); if parts.is_empty() { 0 } else { BATCH }];
        for part in parts {
            let mut crc = crc32fast::Hasher::new();
            for start in (0..part.records).step_by(BATCH) {
                let batch: &mut [T] = &mut buffer[..BATCH.min(part.records - start)];
                let bytes: &mut [u8] = bytemuck::cast_slice_mut(batch);
                let offset = part.offset + (start * size_of::<T>()) as u64;
                let mut inner = self.lock();
                let read =
                    inner.file.seek(SeekFrom::Start(offset)).and_then(|_| inner.file.read_exact(bytes));
                drop(inner);
                read.map_err(MapError::io(&self.folder, "cannot read the scratch file in this folder"))?;
                crc.update(bytes);
                batch.iter().try_for_each(&mut each)?;
            }
            if crc.finalize() != part.crc32 {
                return Err(MapError::ScratchDamaged { tile }.into());
            }
        }
        Ok(())
    }
}
