//! Records sorted into tiles, out of core.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use bytemuck::Pod;

use crate::{DiskError, ScratchFile, TileId};

/// Records sorted into tiles, out of core: what outgrows the budget goes to a file without a name, which
/// vanishes with the process.
///
/// Which tile a record belongs to is the caller's to say; a record that is wanted in several is added to
/// each. Filled by one thread, then read by any number.
#[derive(Debug)]
pub struct TileBuckets<T> {
    budget_bytes: usize,
    waiting: BTreeMap<TileId, Vec<T>>,
    waiting_bytes: usize,
    counts: BTreeMap<TileId, u64>,
    scratch: ScratchFile<T>,
}

impl<T: Pod> TileBuckets<T> {
    /// Empty buckets that hold about `budget_bytes` in memory, the rest in a file in `scratch_folder`.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn new(budget_bytes: usize, scratch_folder: &Path) -> Result<Self, DiskError> {
        let scratch = ScratchFile::new(scratch_folder)?;
        Ok(Self {
            budget_bytes,
            waiting: BTreeMap::new(),
            waiting_bytes: 0,
            counts: BTreeMap::new(),
            scratch,
        })
    }

    /// Puts a record into a tile's bucket.
    ///
    /// # Errors
    /// When the scratch file cannot be written.
    pub fn add(&mut self, tile: TileId, record: T) -> Result<(), DiskError> {
        let list = self.waiting.entry(tile).or_default();
        let before = list.capacity();
        list.push(record);
        self.waiting_bytes += (list.capacity() - before) * size_of::<T>();
        *self.counts.entry(tile).or_default() += 1;
        if self.waiting_bytes > self.budget_bytes { self.spill() } else { Ok(()) }
    }

    /// Writes the longest lists until half the budget is free: parts on disk stay long.
    fn spill(&mut self) -> Result<(), DiskError> {
        let mut lengths: Vec<(usize, TileId)> =
            self.waiting.iter().map(|(&tile, list)| (list.capacity(), tile)).collect();
        lengths.sort_unstable_by(|a, b| b.cmp(a));
        for (capacity, tile) in lengths {
            if self.waiting_bytes <= self.budget_bytes / 2 {
                break;
            }
            let Some(list) = self.waiting.remove(&tile) else { continue };
            self.waiting_bytes -= capacity * size_of::<T>();
            self.scratch.append(tile, list)?;
        }
        Ok(())
    }

    /// The tiles with anything in them, in order.
    pub fn tiles(&self) -> BTreeSet<TileId> {
        self.counts.keys().copied().collect()
    }

    /// How many tiles have anything in them.
    pub fn tile_count(&self) -> usize {
        self.counts.len()
    }

    /// How many records a tile has.
    pub fn count(&self, tile: TileId) -> u64 {
        self.counts.get(&tile).copied().unwrap_or(0)
    }

    /// Hands a tile's records over, in the order in which they were added; nothing for an empty tile.
    ///
    /// # Errors
    /// When the scratch file cannot be read back as it was written; and the first error of `each`.
    pub fn read<E: From<DiskError>>(
        &self,
        tile: TileId,
        mut each: impl FnMut(&T) -> Result<(), E>,
    ) -> Result<(), E> {
        self.scratch.read(tile, &mut each)?;
        self.waiting.get(&tile).into_iter().flatten().try_for_each(each)
    }

    /// Bytes spilled so far.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(budget_bytes: usize) -> TileBuckets<[f64; 2]> {
        let mut buckets = TileBuckets::new(budget_bytes, &std::env::temp_dir()).unwrap();
        for k in 0..50_000_u32 {
            let tile = TileId { x: (k % 7) as i32 - 3, y: (k % 1000 / 400) as i32 };
            buckets.add(tile, [f64::from(k), 0.5]).unwrap();
        }
        buckets
    }

    fn read(buckets: &TileBuckets<[f64; 2]>, tile: TileId) -> Vec<[f64; 2]> {
        let mut records = Vec::new();
        let put = |record: &[f64; 2]| {
            records.push(*record);
            Ok::<(), DiskError>(())
        };
        buckets.read(tile, put).unwrap();
        records
    }

    #[test]
    fn what_is_spilled_comes_back_in_order() {
        let (small, large) = (filled(20_000), filled(usize::MAX));
        assert!(small.scratch_bytes() > 500_000 && large.scratch_bytes() == 0);
        assert_eq!((small.tiles(), small.tile_count()), (large.tiles(), 21));
        let mut total = 0;
        for tile in small.tiles() {
            let records = read(&small, tile);
            assert!(records.is_sorted_by(|a, b| a[0] < b[0]));
            assert_eq!(records, read(&large, tile));
            assert_eq!(records.len() as u64, small.count(tile));
            total += records.len();
        }
        assert_eq!(total, 50_000);
        assert!(read(&small, TileId { x: 99, y: 0 }).is_empty() && small.count(TileId { x: 99, y: 0 }) == 0);
    }

    #[test]
    fn the_readers_own_error_ends_the_reading() {
        #[derive(Debug)]
        struct Enough;
        impl From<DiskError> for Enough {
            fn from(_: DiskError) -> Self {
                Self
            }
        }
        let mut seen = 0;
        let result = filled(20_000).read(TileId { x: 0, y: 0 }, |_| {
            seen += 1;
            Err(Enough)
        });
        assert!(matches!(result, Err(Enough)) && seen == 1);
    }
}
