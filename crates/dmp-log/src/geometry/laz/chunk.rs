//! A chunk of a LAZ file, decoded point by point.

use super::error::LazError;
use super::pointwise::Pointwise;
use crate::geometry::laz::fields::{GPS_TIME_10, GPS_TIME_14, Point14, record};
use std::ops::Range;

/// Bytes of a chunk that its points may leave over. Encoders write what a decoder takes, so that more are a sign of damage.
const MAX_LEFT_BYTES: usize = 8;

/// A decoder of the points after the first of a chunk.
#[derive(Debug)]
pub(super) enum Points {
    Pointwise(Pointwise),
    Layered(Box<Point14>),
}

#[derive(Debug)]
pub(super) struct OpenChunk {
    pub(super) number: usize,
    pub(super) points: Range<u64>,
    /// Where it is in the file.
    pub(super) bytes: Range<u64>,
    pub(super) first: Vec<u8>,
    /// Whether `points` are all that the chunk has: the header may say that there are fewer.
    pub(super) is_whole: bool,
    pub(super) decoder: Points,
    /// The point that is decoded next.
    pub(super) next: u64,
}

impl OpenChunk {
    /// Decodes so many points, of which the chunk has at least as many left.
    pub(super) fn read(&mut self, records: &mut [u8], record_bytes: usize) -> Result<(), LazError> {
        let mut records = records.chunks_exact_mut(record_bytes);
        if self.next == self.points.start
            && let Some(record) = records.next()
        {
            record::put_place(record, record::place(&self.first));
            match self.decoder {
                Points::Layered(_) => copy_time(record, &self.first, GPS_TIME_14),
                Points::Pointwise(ref points) if points.has_times() => {
                    copy_time(record, &self.first, GPS_TIME_10);
                }
                Points::Pointwise(_) => {}
            }
            self.next += 1;
        }
        for record in records {
            let is_sound = match &mut self.decoder {
                Points::Pointwise(points) => {
                    points.decode(record);
                    points.is_sound()
                }
                Points::Layered(points) => {
                    points.decode(record);
                    points.is_sound()
                }
            };
            if !is_sound {
                return Err(self.wrong(format!("point {} cannot be decoded", self.next)));
            }
            self.next += 1;
        }
        let left_bytes = match &self.decoder {
            Points::Pointwise(points) => points.left_bytes(),
            Points::Layered(points) => points.left_bytes(),
        };
        if self.next == self.points.end && self.is_whole && left_bytes > MAX_LEFT_BYTES {
            return Err(self.wrong(format!("its points leave {left_bytes} bytes over")));
        }
        Ok(())
    }

    fn wrong(&self, problem: String) -> LazError {
        LazError::Chunk { chunk: self.number, bytes: self.bytes.clone(), problem }
    }
}

fn copy_time(record: &mut [u8], first: &[u8], at: usize) {
    record::put::<8>(record, at, record::get(first, at));
}
