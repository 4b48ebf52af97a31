//! Points of LAS and LAZ files, batch by batch from any point on.

use super::BATCH;
use super::las_header::{self, LasHeader};
use crate::decimal::shorten;
use crate::{LogError, Place};
use las::reader::{LazParallelism, ReaderOptions};
use las::{PointData, PointDataBuilder, Reader};
use std::fs::File;
use std::io::{BufReader, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Reads the points of one file. Holds a batch.
pub(crate) struct LasPoints {
    path: PathBuf,
    reader: Reader,
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
        // Batches as small as these are not worth the parallel decoder, which trusts the chunk table more.
        let options = ReaderOptions::default().with_laz_parallelism(LazParallelism::No);
        let reader = guarded(|| Reader::with_options(input, options))
            .map_err(|problem| LogError::malformed(path, Place::WholeFile, problem))?;
        let batch = PointDataBuilder::new().for_header(reader.header()).build();
        Ok(Self { path: path.into(), reader, batch, header, next: 0 })
    }

    pub(crate) fn header(&self) -> &LasHeader {
        &self.header
    }

    /// Goes to a point. In a compressed file those of its chunk before it are decoded.
    pub(crate) fn seek(&mut self, point: u64) -> Result<(), LogError> {
        if point != self.next {
            guarded(|| self.reader.seek(point)).map_err(|problem| self.broken(point, &problem))?;
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
        let read = guarded(|| self.reader.fill_points(wanted, &mut self.batch));
        match read {
            Ok(0) => Err(self.broken(self.next, "there are no more")),
            Ok(read) => {
                self.next += read;
                Ok(&self.batch)
            }
            Err(problem) => Err(self.broken(self.next, &problem)),
        }
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
