//! Parts of tiles in one file, put aside and read back.

use std::collections::{BTreeSet, HashMap};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;

use crate::{DiskError, TileId};

/// Records read back at a time.
const BATCH: usize = 4096;

/// Parts of tiles that do not fit in memory, in one file. Without a name it vanishes with the process, however
/// that ends; with one, another process can go on with it.
#[derive(Debug)]
pub struct ScratchFile<T> {
    /// The folder, or the file where it has a name.
    path: PathBuf,
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

/// A part as it is listed for another process.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ListedPart {
    y: i32,
    x: i32,
    offset: u64,
    records: u64,
    crc32: u32,
    zero: u32,
}

impl<T: Pod> ScratchFile<T> {
    /// An empty file without a name in `folder`.
    ///
    /// # Errors
    /// When it cannot be made there.
    pub fn new(folder: &Path) -> Result<Self, DiskError> {
        let file = tempfile::tempfile_in(folder)
            .map_err(DiskError::io(folder, "cannot make a scratch file here"))?;
        Ok(Self::in_file(file, folder))
    }

    /// An empty file of this name, in place of what was there.
    ///
    /// # Errors
    /// When it cannot be made there.
    pub fn named(path: &Path) -> Result<Self, DiskError> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path);
        Ok(Self::in_file(file.map_err(DiskError::io(path, "cannot make the scratch file"))?, path))
    }

    /// The file as it was when `list` was [made](Self::list); what came behind is forgotten.
    ///
    /// # Errors
    /// When the file cannot be opened or is shorter than it was, or `list` is no list of parts.
    pub fn resume(path: &Path, list: &[u8]) -> Result<Self, DiskError> {
        let damaged =
            |detail: String| DiskError::Damaged { path: path.to_path_buf(), part: "list of parts", detail };
        let file = OpenOptions::new().read(true).write(true).open(path);
        let file = file.map_err(DiskError::io(path, "cannot open the scratch file"))?;
        let length = file.metadata().map_err(DiskError::io(path, "cannot open the scratch file"))?.len();
        let (rows, rest) = list.as_chunks::<{ size_of::<ListedPart>() }>();
        if !rest.is_empty() {
            return Err(damaged(format!("it has {} bytes", list.len())));
        }
        let (mut parts, mut end): (HashMap<_, Vec<Part>>, _) = (HashMap::new(), 0);
        for row in rows {
            let ListedPart { y, x, offset, records, crc32, .. } = bytemuck::pod_read_unaligned(row);
            let bytes = records.checked_mul(size_of::<T>() as u64);
            let part_end = bytes.and_then(|bytes| offset.checked_add(bytes)).filter(|&end| end <= length);
            let Some(part_end) = part_end else {
                return Err(damaged(format!("{records} records at byte {offset} of {length} do not fit")));
            };
            end = part_end.max(end);
            let part = Part { offset, records: records as usize, crc32 };
            parts.entry(TileId { y, x }).or_default().push(part);
        }
        file.set_len(end).map_err(DiskError::io(path, "cannot cut the scratch file"))?;
        let scratch = Self::in_file(file, path);
        {
            let mut inner = scratch.lock();
            (inner.parts, inner.end) = (parts, end);
        }
        Ok(scratch)
    }

    fn in_file(file: File, path: &Path) -> Self {
        let inner = Inner { file, end: 0, parts: HashMap::new() };
        Self { path: path.to_path_buf(), inner: Mutex::new(inner), records: PhantomData }
    }

    /// Brings everything to disk and lists it, for [`Self::resume`].
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn list(&self) -> Result<Vec<u8>, DiskError> {
        let inner = self.lock();
        inner.file.sync_data().map_err(DiskError::io(&self.path, "cannot write the scratch file to disk"))?;
        let listed = |(tile, part): (&TileId, &Part)| ListedPart {
            y: tile.y,
            x: tile.x,
            offset: part.offset,
            records: part.records as u64,
            crc32: part.crc32,
            zero: 0,
        };
        let parts = inner.parts.iter().flat_map(|(tile, parts)| parts.iter().map(move |part| (tile, part)));
        let mut rows: Vec<ListedPart> = parts.map(listed).collect();
        rows.sort_unstable_by_key(|row| row.offset);
        Ok(bytemuck::cast_slice(&rows).to_vec())
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes written so far.
    pub fn bytes(&self) -> u64 {
        self.lock().end
    }

    /// The tiles with anything in them, in order.
    pub fn tiles(&self) -> BTreeSet<TileId> {
        self.lock().parts.keys().copied().collect()
    }

    /// Puts a part of a tile behind what is there; reading gives the parts one after the other.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn append(&self, tile: TileId, records: &[T]) -> Result<(), DiskError> {
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let crc32 = crc32fast::hash(bytes);
        let mut inner = self.lock();
        let offset = inner.end;
        let written = inner.file.seek(SeekFrom::Start(offset)).and_then(|_| inner.file.write_all(bytes));
        written.map_err(DiskError::io(&self.path, "cannot write the scratch file here"))?;
        inner.end += bytes.len() as u64;
        inner.parts.entry(tile).or_default().push(Part { offset, records: records.len(), crc32 });
        Ok(())
    }

    /// Hands over a tile's records, part by part; of a part that turns out damaged, records before that is known.
    ///
    /// # Errors
    /// When the file cannot be read back as it was written; and the first error of `each`.
    pub fn read<E: From<DiskError>>(
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
                read.map_err(DiskError::io(&self.path, "cannot read the scratch file here"))?;
                crc.update(bytes);
                batch.iter().try_for_each(&mut each)?;
            }
            if crc.finalize() != part.crc32 {
                return Err(DiskError::ScratchDamaged { tile }.into());
            }
        }
        Ok(())
    }
}
