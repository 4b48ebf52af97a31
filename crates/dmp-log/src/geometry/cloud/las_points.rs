//! Points of LAS and LAZ files, batch by batch from any point on.

use super::batches::BATCH;
use super::las_header::{self, LasHeader};
use crate::file::{CountedFile, ReadCount};
use crate::geometry::laz::error::LazError;
use crate::geometry::laz::reader::LazReader;
use crate::{LogError, PlaceInFile};
use las::point::Format;
use las::{PointData, PointDataBuilder, Transform, Vector};
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where records of points come from.
#[derive(Debug)]
enum Source {
    Plain { input: BufReader<CountedFile>, is_at: Option<u64> },
    Compressed(Box<LazReader<BufReader<CountedFile>>>),
}

/// Reads the points of one file. Holds a batch. Of compressed points places and times are read: the other bytes of their
/// records are zeros.
#[derive(Debug)]
pub(crate) struct LasPoints {
    path: PathBuf,
    source: Source,
    batch: PointData,
    header: LasHeader,
    next: u64,
}

impl LasPoints {
    /// Opens a file whose header does not lie about sizes.
    pub(crate) fn open(path: &Path, count: &ReadCount) -> Result<Self, LogError> {
        let file = count.open(path).map_err(|e| LogError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
        let mut input = BufReader::with_capacity(1 << 16, file);
        let header = las_header::check(&mut input, length).map_err(|e| e.in_file(path))?;
        let mut format = Format::new(header.format)
            .map_err(|e| LogError::malformed(path, PlaceInFile::Byte(104), e.to_string()))?;
        format.extra_bytes = header.record_bytes.saturating_sub(format.len());
        let [x, y, z] = header.scales_offsets.map(|(scale, offset)| Transform { scale, offset });
        let batch = PointDataBuilder::new().with_format(format).with_transforms(Vector { x, y, z }).build();
        let source = match &header.laz {
            Some(layout) => Source::Compressed(Box::new(LazReader::new(input, Arc::clone(layout)))),
            None => Source::Plain { input, is_at: None },
        };
        Ok(Self { path: path.into(), source, batch, header, next: 0 })
    }

    /// The same for points that are read one after the other: what is compressed is decoded ahead on the threads of the pool
    /// that this is called in, if it has several.
    pub(crate) fn ahead(mut self) -> Self {
        if let Source::Compressed(reader) = &mut self.source {
            reader.go_ahead();
        }
        self
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn header(&self) -> &LasHeader {
        &self.header
    }

    /// Where the chunk of a point ends: from there on points can be read whatever is wrong with those before. The end of the
    /// file where there are no chunks.
    pub(crate) fn end_of_chunk(&self, point: u64) -> u64 {
        let chunk_end = self.header.laz.as_ref().and_then(|layout| layout.end_of_chunk(point));
        chunk_end.unwrap_or(self.header.points)
    }

    /// The point to go on with. In a compressed file those of its chunk before it are decoded.
    pub(crate) fn seek(&mut self, point: u64) {
        self.next = point;
    }

    /// The next points, at most `wanted` and at most 65,536, at least one.
    pub(crate) fn read(&mut self, wanted: u64) -> Result<&PointData, LogError> {
        let wanted = wanted.min(BATCH as u64).min(self.header.points.saturating_sub(self.next));
        if wanted == 0 {
            return Err(self.broken(self.next, "there are no more"));
        }
        let record_bytes = self.batch.record_len() as u64;
        let bytes = self.batch.resize_for(wanted as usize);
        let read = match &mut self.source {
            Source::Plain { input, is_at } => {
                let at = self.header.data_at + self.next * record_bytes;
                let was_at = is_at.take();
                let sought = if was_at == Some(at) { Ok(at) } else { input.seek(SeekFrom::Start(at)) };
                let read = sought.and_then(|_| input.read_exact(bytes));
                *is_at = read.is_ok().then_some(at + wanted * record_bytes);
                read.map_err(LazError::Read)
            }
            Source::Compressed(reader) => {
                reader.seek(self.next);
                reader.read(bytes)
            }
        };
        match read {
            Ok(()) => {}
            Err(LazError::Read(e)) if e.kind() != io::ErrorKind::UnexpectedEof => {
                return Err(LogError::io(&self.path, "read", e));
            }
            Err(problem) => return Err(self.broken(self.next, &problem.to_string())),
        }
        self.next += wanted;
        Ok(&self.batch)
    }

    fn broken(&self, point: u64, problem: &str) -> LogError {
        let problem = format!("cannot decode the points from here, of {}: {problem}", self.header.points);
        LogError::malformed(&self.path, PlaceInFile::Point(point), problem)
    }
}
