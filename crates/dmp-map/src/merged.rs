//! The parts of a tile that was put aside several times, read side by side.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::moments::VoxelRecord;

/// The voxels of several parts of a tile, each [by their cells](crate::lattice::Voxel::by_cell), in that order: those of
/// one voxel are summed up. Of each part one record is held.
pub(crate) struct Merged<I, E> {
    parts: Vec<I>,
    /// The record that each part goes on with, by its place and the part's number.
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

    /// Goes on in a part, of which a failure is kept.
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
