//! Points of LAS and LAZ files, batch by batch from any point on.

use super::BATCH;
use super::las_header::{self, LasHeader};
use crate::decimal::shorten;
use crate::{LogError, Place};
use las::{PointData, PointDataBuilder};
use laz::LasZipDecompressor;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Where records of points come from.
enum Source {
    Plain { input: BufReader<File>, data_at: u64 },
    // One thread decodes: batches as small as these are not worth more.
    Compressed(Box<LasZipDecompressor<'static, BufReader<File>>>),
}

/// Reads the points of one file. Holds a batch.
pub(crate) struct LasPoints {
    path: PathBuf,
    source: Source,
    batch: PointData,
    header: LasHeader,
    next: u64,
}

impl std::fmt::Debug for LasPoints {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LasPoints")
            .field("path", &self.path)
            .field("next", &self.next)
            .finish_non_exhaustive()
    }
}

impl LasPoints {
    /// Opens a file whose header does not lie about sizes.
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
        let mut input = BufReader::with_capacity(1 << 16, file);
        let header = las_header::check(&mut input, length).map_err(|e| e.in_file(path))?;
        input.rewind().map_err(|e| LogError::io(path, "read", e))?;
        let opened = guarded(|| {
            let header = las::Header::new(&mut input)?;
            let batch = PointDataBuilder::new().for_header(&header).build();
            let source = if header.point_format().is_compressed {
                let decoder = LasZipDecompressor::new(input, header.laz_vlr()?)?;
                Source::Compressed(Box::new(decoder))
            } else {
                Source::Plain { data_at: input.stream_position()?, input }
            };
            Ok((source, batch))
        });
        let (source, batch) =
            opened.map_err(|problem| LogError::malformed(path, Place::WholeFile, problem))?;
        Ok(Self { path: path.into(), source, batch, header, next: 0 })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn header(&self) -> &LasHeader {
        &self.header
    }

    /// Goes to a point. In a compressed file those of its chunk before it are decoded.
    pub(crate) fn seek(&mut self, point: u64) -> Result<(), LogError> {
        if point != self.next {
            let record_bytes = self.batch.record_len() as u64;
            let sought = guarded(|| match &mut self.source {
                Source::Plain { input, data_at } => {
                    let at = data_at.saturating_add(point.saturating_mul(record_bytes));
                    input.seek(SeekFrom::Start(at))?;
                    Ok(())
                }
                Source::Compressed(decoder) => Ok(decoder.seek(point)?),
            });
            sought.map_err(|problem| self.broken(point, &problem))?;
            self.next = point;
        }
        Ok(())
    }

    /// The next points, at most `wanted` and at most 65,536, at least one.
    ///
    /// # Errors
    /// When there is none, or when they cannot be decoded.
    pub(crate) fn read(&mut self, wanted: u64) -> Result<&PointData, LogError> {
        let wanted = wanted.min(BATCH as u64).min(self.header.points.saturating_sub(self.next));
        if wanted == 0 {
            return Err(self.broken(self.next, "there are no more"));
        }
        let bytes = self.batch.resize_for(wanted as usize);
        let read = guarded(|| match &mut self.source {
            Source::Plain { input, .. } => Ok(input.read_exact(bytes)?),
            Source::Compressed(decoder) => Ok(decoder.decompress_many(bytes)?),
        });
        read.map_err(|problem| self.broken(self.next, &problem))?;
        self.next += wanted;
        Ok(&self.batch)
    }

    fn broken(&self, point: u64, problem: &str) -> LogError {
        let problem = format!("cannot decode the points from here, of {}: {problem}", self.header.points);
        LogError::malformed(&self.path, Place::Point(point), problem)
    }
}

/// Runs a decoder that may panic on bytes its format does not allow; the panic becomes a message. What
/// the decoder leaves behind is not used again.
fn guarded<T>(decode: impl FnOnce() -> las::Result<T>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(shorten(&error.to_string())),
        Err(_) => Err("the decoder gave up on bytes that are not of its format".into()),
    }
}
