//! Points of LAS and LAZ files, batch by batch from any point on.

use super::batches::BATCH;
use super::las_header::{self, LasHeader};
use crate::decimal::shorten;
use crate::reads::{CountedFile, ReadCount};
use crate::{LogError, PlaceInFile};
use las::{PointData, PointDataBuilder};
use laz::LasZipDecompressor;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Where records of points come from.
enum Source {
    Plain { input: BufReader<CountedFile>, data_at: u64 },
    // One thread decodes: batches as small as these are not worth more.
    Compressed(Box<LasZipDecompressor<'static, BufReader<CountedFile>>>),
}

/// Reads the points of one file. Holds a batch.
pub(crate) struct LasPoints {
    path: PathBuf,
    count: ReadCount,
    source: Source,
    batch: PointData,
    header: LasHeader,
    /// Points of a chunk, which can be decoded without those before it; `None` where chunks differ.
    chunk_points: Option<u64>,
    next: u64,
    /// What a decoder leaves behind that failed is not used again.
    has_failed: bool,
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
    pub(crate) fn open(path: &Path, count: &ReadCount) -> Result<Self, LogError> {
        let file = count.open(path).map_err(|e| LogError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
        let mut input = BufReader::with_capacity(1 << 16, file);
        let header = las_header::check(&mut input, length).map_err(|e| e.in_file(path))?;
        input.rewind().map_err(|e| LogError::io(path, "read", e))?;
        let opened = guarded(|| {
            let header = las::Header::new(&mut input)?;
            let batch = PointDataBuilder::new().for_header(&header).build();
            if !header.point_format().is_compressed {
                let data_at = input.stream_position()?;
                return Ok((Source::Plain { input, data_at }, batch, None));
            }
            let vlr = header.laz_vlr()?;
            let chunk_points = (!vlr.uses_variable_size_chunks()).then(|| u64::from(vlr.chunk_size()));
            let decoder = LasZipDecompressor::new(input, vlr)?;
            Ok((Source::Compressed(Box::new(decoder)), batch, chunk_points.filter(|&points| points > 0)))
        });
        let (source, batch, chunk_points) =
            opened.map_err(|problem| LogError::malformed(path, PlaceInFile::WholeFile, problem))?;
        let (path, count) = (path.into(), count.clone());
        Ok(Self { path, count, source, batch, header, chunk_points, next: 0, has_failed: false })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn header(&self) -> &LasHeader {
        &self.header
    }

    /// Where the chunk of a point ends: from there on points can be read whatever is wrong with those before.
    /// The end of the file where chunks differ.
    pub(crate) fn end_of_chunk(&self, point: u64) -> u64 {
        let chunk_end = self.chunk_points.and_then(|points| (point / points + 1).checked_mul(points));
        chunk_end.unwrap_or(u64::MAX).min(self.header.points)
    }

    /// Goes to a point. In a compressed file those of its chunk before it are decoded.
    pub(crate) fn seek(&mut self, point: u64) -> Result<(), LogError> {
        if self.has_failed {
            *self = Self::open(&self.path, &self.count)?;
        }
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
            self.has_failed = sought.is_err();
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
        self.has_failed = read.is_err();
        read.map_err(|problem| self.broken(self.next, &problem))?;
        self.next += wanted;
        Ok(&self.batch)
    }

    fn broken(&self, point: u64, problem: &str) -> LogError {
        let problem = format!("cannot decode the points from here, of {}: {problem}", self.header.points);
        LogError::malformed(&self.path, PlaceInFile::Point(point), problem)
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
