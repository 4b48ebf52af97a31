//! Reads the parts of a tile that was spilled several times, merged in order.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::moments::VoxelRecord;

/// The voxels of several parts of a tile, merged in the order of [their cells](crate::grid::Voxel::by_cell): sums of
/// the same voxel are added. One record of each part is in memory.
pub(crate) struct Merged<I, E> {
    parts: Vec<I>,
    /// The next record of each part, by its index and the part's number.
    heads: BinaryHeap<Reverse<(u64, usize)>>,
    records: Vec<Option<VoxelRecord>>,
    failed: Option<E>,
}

impl<E, I: Iterator<Item = Result<VoxelRecord, E>>> Merged<I, E> {
    pub(crate) fn new(parts: Vec<I>) -> Self {
        let mut merged =
            Self { heads: BinaryHeap::new(), records: vec![None; parts.len()], parts, failed: None };
        (0..merged.parts.len()).for_each(|part| merged.advance(part));
        merged
    }

    /// Reads the next record of a part; keeps an error.
    fn advance(&mut self, part: usize) {
        match self.parts[part].next() {
            Some(Ok(record)) => {
                self.heads.push(Reverse((record.voxel().by_cell(), part)));
                self.records[part] = Some(record);
            }
            Some(Err(error)) => self.failed = Some(error),
            None => {}
        }
    }
}

impl<E, I: Iterator<Item = Result<VoxelRecord, E>>> Iterator for Merged<I, E> {
    type Item = Result<VoxelRecord, E>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut merged: Option<VoxelRecord> = None;
        let mut place = None;
        while let Some(&Reverse((next, part))) = self.heads.peek()
            && place.is_none_or(|place| place == next)
        {
            self.heads.pop();
            if let Some(record) = self.records[part].take() {
                match &mut merged {
                    Some(merged) => merged.moments.merge(&record.moments),
                    None => merged = Some(record),
                }
            }
            place = Some(next);
            self.advance(part);
        }
        self.failed.take().map(Err).or_else(|| merged.map(Ok))
    }
}
