//! Where the chunks of a file are, and how their points are compressed.

use super::las_bytes::Bytes;
use super::table::{self, Chunk};
use crate::ParseError;
use crate::geometry::laz::fields::{Compression, Item, PointsHead, items};
use std::io::{Read, Seek};
use std::ops::Range;

/// A file's compression, and where its chunks are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LazLayout {
    pub(super) items: Vec<Item>,
    pub(super) is_layered: bool,
    pub(super) layers: u64,
    pub(super) record_bytes: usize,
    /// Where chunks begin, and the end of the last one.
    chunks: Vec<Chunk>,
}

impl LazLayout {
    /// Finds the record and the table of chunks, and compares both with the file.
    pub(crate) fn of<R: Read + Seek>(
        bytes: &mut Bytes<'_, R>,
        head: &PointsHead,
    ) -> Result<Self, ParseError> {
        let Compression { cutting, items, is_layered } = items::compression(bytes, head)?;
        let layers = items.iter().map(Item::layers).sum();
        let chunks = table::read(bytes, head, cutting)?;
        if is_layered {
            table::check_layers(bytes, head.record_bytes, layers, &chunks)?;
        }
        Ok(Self { items, is_layered, layers, record_bytes: head.record_bytes.into(), chunks })
    }

    pub(super) fn points(&self) -> u64 {
        self.chunks.last().map_or(0, |end| end.first_point)
    }

    /// The chunk with a point.
    pub(super) fn chunk_of(&self, point: u64) -> Option<usize> {
        let after = self.chunks.partition_point(|chunk| chunk.first_point <= point);
        after.checked_sub(1).filter(|_| after < self.chunks.len())
    }

    /// The points of a chunk and its bytes in the file.
    pub(super) fn chunk(&self, chunk: usize) -> Option<(Range<u64>, Range<u64>)> {
        let [begin, end] = self.chunks.get(chunk..)?.first_chunk()?;
        Some((begin.first_point..end.first_point, begin.at..end.at))
    }

    /// The point behind the chunk with a point; `None` where there is no such point.
    pub(crate) fn end_of_chunk(&self, point: u64) -> Option<u64> {
        Some(self.chunk(self.chunk_of(point)?)?.0.end)
    }
}
