//! Parts of tiles in one file, spilled and read back.

use std::collections::{BTreeSet, HashMap};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;

use crate::{DiskError, TileId};

/// Records behind which their checksum stands: none is handed over before it is compared.
const CHECKED: usize = 64;
const CRC_BYTES: usize = 4;
/// Most records of a part, which is packed in memory before it is written.
const PART: usize = 256 * CHECKED;
/// Records read back at a time, and of each part where many are read side by side.
const BATCH: usize = 64 * CHECKED;

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
}

/// Bytes of a number of records with their checksums; `None` where no number holds it.
fn bytes_of<T>(records: u64) -> Option<u64> {
    let sums = records.div_ceil(CHECKED as u64).checked_mul(CRC_BYTES as u64)?;
    records.checked_mul(size_of::<T>() as u64)?.checked_add(sums)
}

/// A part as it is listed for another process.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ListedPart {
    y: i32,
    x: i32,
    offset: u64,
    records: u64,
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
            let ListedPart { y, x, offset, records } = bytemuck::pod_read_unaligned(row);
            let part_end = bytes_of::<T>(records)
                .and_then(|bytes| offset.checked_add(bytes))
                .filter(|&end| end <= length);
            let Some(part_end) = part_end else {
                return Err(damaged(format!("{records} records at byte {offset} of {length} do not fit")));
            };
            end = part_end.max(end);
            let part = Part { offset, records: records as usize };
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

    /// Puts parts of a tile behind what is there; reading gives the parts one after the other.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn append(&self, tile: TileId, records: impl IntoIterator<Item = T>) -> Result<(), DiskError> {
        let mut records = records.into_iter().peekable();
        while records.peek().is_some() {
            self.append_part(tile, records.by_ref().take(PART))?;
        }
        Ok(())
    }

    fn append_part(&self, tile: TileId, records: impl Iterator<Item = T>) -> Result<(), DiskError> {
        let (mut bytes, mut count, mut checked_from) = (Vec::new(), 0, 0);
        let mut check = |bytes: &mut Vec<u8>| {
            let crc = crc32fast::hash(&bytes[checked_from..]);
            bytes.extend_from_slice(&crc.to_le_bytes());
            checked_from = bytes.len();
        };
        for record in records {
            bytes.extend_from_slice(bytemuck::bytes_of(&record));
            count += 1;
            if count % CHECKED == 0 {
                check(&mut bytes);
            }
        }
        if count % CHECKED != 0 {
            check(&mut bytes);
        }
        let mut inner = self.lock();
        let offset = inner.end;
        let written = inner.file.seek(SeekFrom::Start(offset)).and_then(|_| inner.file.write_all(&bytes));
        written.map_err(DiskError::io(&self.path, "cannot write the scratch file here"))?;
        inner.end += bytes.len() as u64;
        inner.parts.entry(tile).or_default().push(Part { offset, records: count });
        Ok(())
    }

    /// Hands over a tile's records, part by part.
    ///
    /// # Errors
    /// When the file cannot be read back as it was written; and the first error of `each`.
    pub fn read<E: From<DiskError>>(
        &self,
        tile: TileId,
        mut each: impl FnMut(&T) -> Result<(), E>,
    ) -> Result<(), E> {
        self.parts_in_batches(tile, |_| BATCH).into_iter().flatten().try_for_each(|record| each(&record?))
    }

    /// The parts of a tile, to be read side by side: of all of them together few records are in memory.
    pub fn parts(&self, tile: TileId) -> Vec<PartRecords<'_, T>> {
        self.parts_in_batches(tile, |parts| (BATCH / CHECKED / parts).max(1) * CHECKED)
    }

    /// Records of a tile, those of all its parts.
    pub fn records(&self, tile: TileId) -> usize {
        self.lock().parts.get(&tile).map_or(0, |parts| parts.iter().map(|part| part.records).sum())
    }

    fn parts_in_batches(&self, tile: TileId, batch: impl Fn(usize) -> usize) -> Vec<PartRecords<'_, T>> {
        let parts = self.lock().parts.get(&tile).cloned().unwrap_or_default();
        let batch = batch(parts.len().max(1));
        let records = |part| PartRecords {
            scratch: self,
            tile,
            left: part,
            batch,
            bytes: Vec::new(),
            buffer: Vec::new(),
            next: 0,
        };
        parts.into_iter().map(records).collect()
    }
}

/// The records of a part of a tile, in the order in which they were put there; each as it was, or an error in its place.
#[derive(Debug)]
pub struct PartRecords<'a, T> {
    scratch: &'a ScratchFile<T>,
    tile: TileId,
    /// What is not read yet.
    left: Part,
    /// Records read at a time.
    batch: usize,
    bytes: Vec<u8>,
    buffer: Vec<T>,
    /// Of the buffer.
    next: usize,
}

impl<T: Pod> PartRecords<'_, T> {
    /// Reads the next batch, empty at the end.
    fn fill(&mut self) -> Result<(), DiskError> {
        let Self { scratch, tile, left, batch, bytes, buffer, next } = self;
        buffer.clear();
        *next = 0;
        let records = (*batch).min(left.records);
        let length = bytes_of::<T>(records as u64).unwrap_or(u64::MAX);
        bytes.resize(length as usize, 0);
        let mut inner = scratch.lock();
        let read = inner.file.seek(SeekFrom::Start(left.offset)).and_then(|_| inner.file.read_exact(bytes));
        drop(inner);
        read.map_err(DiskError::io(&scratch.path, "cannot read the scratch file here"))?;
        for checked in bytes.chunks(CHECKED * size_of::<T>() + CRC_BYTES) {
            let damaged = || DiskError::ScratchDamaged { tile: *tile };
            let (checked, crc) = checked.split_last_chunk().ok_or_else(damaged)?;
            if crc32fast::hash(checked) != u32::from_le_bytes(*crc) {
                return Err(damaged());
            }
            buffer.extend(checked.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned::<T>));
        }
        *left = Part { offset: left.offset + length, records: left.records - records };
        Ok(())
    }
}

impl<T: Pod> Iterator for PartRecords<'_, T> {
    type Item = Result<T, DiskError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next == self.buffer.len()
            && let Err(error) = self.fill()
        {
            // Nothing comes behind it.
            self.buffer.clear();
            self.left.records = 0;
            return Some(Err(error));
        }
        let record = self.buffer.get(self.next).copied()?;
        self.next += 1;
        Some(Ok(record))
    }
}
