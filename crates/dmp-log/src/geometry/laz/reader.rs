//! The points of a LAZ file, from any point on.

use super::ahead::Ahead;
use super::chunk::{OpenChunk, Points};
use super::error::LazError;
use super::layout::LazLayout;
use super::pointwise::Pointwise;
use crate::file::pool;
use crate::geometry::laz::fields::{GPS_TIME_LAYER, Point14, XY_LAYER, Z_LAYER};
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::sync::Arc;

/// Decodes points. Holds the bytes of a chunk, and where chunks are decoded ahead what [`Ahead`] says.
#[derive(Debug)]
pub(crate) struct LazReader<R> {
    input: R,
    layout: Arc<LazLayout>,
    /// The chunk that is being decoded.
    chunk: Option<OpenChunk>,
    /// Chunks that are decoded ahead.
    ahead: Option<Ahead>,
    next: u64,
}

impl<R: Read + Seek> LazReader<R> {
    pub(crate) fn new(input: R, layout: Arc<LazLayout>) -> Self {
        Self { input, layout, chunk: None, ahead: None, next: 0 }
    }

    /// Points will be read one after the other: from now on chunks are decoded ahead on the threads of the pool that this is
    /// called in, if it has several. The points and the errors are the same.
    pub(crate) fn go_ahead(&mut self) {
        let threads = pool::threads();
        self.ahead = (threads > 1).then(|| Ahead::new(threads));
    }

    /// The point to go on with. Those of its chunk before it are decoded when it is read.
    pub(crate) fn seek(&mut self, point: u64) {
        self.next = point;
    }

    /// Fills whole records with the next points: their places and times, the rest of the bytes stays as it is.
    pub(crate) fn read(&mut self, mut records: &mut [u8]) -> Result<(), LazError> {
        let record_bytes = self.layout.record_bytes;
        while records.len() >= record_bytes {
            if let Some(count) = self.read_ahead(records)? {
                records = &mut records[count * record_bytes..];
                continue;
            }
            let mut chunk = self.chunk_of_next()?;
            let left = usize::try_from(chunk.points.end - self.next).unwrap_or(usize::MAX);
            let count = left.min(records.len() / record_bytes);
            let (now, later) = records.split_at_mut(count * record_bytes);
            // Only what was decoded without an error is gone on with.
            chunk.read(now, record_bytes)?;
            self.next += count as u64;
            self.chunk = Some(chunk);
            records = later;
        }
        Ok(())
    }

    /// The same for points that are decoded ahead, up to the end of their chunk; returns how many. `None` where they are not.
    fn read_ahead(&mut self, records: &mut [u8]) -> Result<Option<usize>, LazError> {
        let Some(mut ahead) = self.ahead.take() else { return Ok(None) };
        let layout = Arc::clone(&self.layout);
        let read = ahead.read(&layout, self.next, records, |number| self.open(number));
        self.ahead = Some(ahead);
        if let Ok(Some(count)) = read {
            self.next += count as u64;
            self.chunk = None;
        }
        read
    }

    /// The chunk of the next point, decoded up to it.
    fn chunk_of_next(&mut self) -> Result<OpenChunk, LazError> {
        let number = self.layout.chunk_of(self.next);
        let open = self.chunk.take().filter(|chunk| Some(chunk.number) == number && chunk.next <= self.next);
        let mut chunk = match (open, number) {
            (Some(chunk), _) => chunk,
            (None, Some(number)) => self.open(number)?,
            (None, None) => {
                let problem = format!("there is no point {}", self.next);
                return Err(LazError::Chunk { chunk: 0, bytes: 0..0, problem });
            }
        };
        let mut passed_over = vec![0; self.layout.record_bytes];
        while chunk.next < self.next {
            chunk.read(&mut passed_over, self.layout.record_bytes)?;
        }
        Ok(chunk)
    }

    fn open(&mut self, number: usize) -> Result<OpenChunk, LazError> {
        let (points, bytes) = self.layout.chunk(number).unwrap_or_default();
        let wrong = |problem: String| LazError::Chunk { chunk: number, bytes: bytes.clone(), problem };
        let record_bytes = self.layout.record_bytes as u64;
        let layers_at = bytes.start + record_bytes;
        let sizes_bytes = 4 + 4 * self.layout.layers;
        if layers_at + if self.layout.is_layered { sizes_bytes } else { 0 } > bytes.end {
            return Err(wrong("too short for its first point".into()));
        }
        let first = self.bytes(bytes.start..layers_at)?;
        let mut is_whole = points.end < self.layout.points();
        let decoder = if self.layout.is_layered {
            let head = self.bytes(layers_at..layers_at + sizes_bytes)?;
            let [count, sizes @ ..] = head.as_chunks().0 else { return Err(wrong("no layers".into())) };
            is_whole = u64::from(u32::from_le_bytes(*count)) == points.end - points.start;
            let mut layers = [const { Vec::new() }; 3];
            let mut at = layers_at + sizes_bytes;
            for (layer, size) in sizes.iter().enumerate() {
                let end = at + u64::from(u32::from_le_bytes(*size));
                if end > bytes.end {
                    return Err(wrong(format!("layer {layer} reaches byte {end}")));
                }
                match layer {
                    XY_LAYER => layers[0] = self.bytes(at..end)?,
                    Z_LAYER => layers[1] = self.bytes(at..end)?,
                    GPS_TIME_LAYER => layers[2] = self.bytes(at..end)?,
                    _ => {}
                }
                at = end;
            }
            Points::Layered(Box::new(Point14::new(&first, layers)))
        } else {
            let rest = self.bytes(layers_at..bytes.end)?;
            Points::Pointwise(Pointwise::new(&self.layout.items, &first, rest))
        };
        Ok(OpenChunk { number, next: points.start, points, bytes, first, is_whole, decoder })
    }

    /// Bytes of the file that the layout has found there.
    fn bytes(&mut self, at: Range<u64>) -> Result<Vec<u8>, LazError> {
        let mut bytes = vec![0; (at.end - at.start) as usize];
        self.input.seek(SeekFrom::Start(at.start))?;
        self.input.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}
