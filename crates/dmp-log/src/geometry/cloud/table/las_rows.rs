//! Rows of LAS and LAZ files.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use las::point::Format;
use las::{Builder, PointData, PointDataBuilder, Transform, Vector, Vlr};

use super::column::{Column, row_bytes};
use crate::geometry::cloud::wkt::MetricCrs;

/// Metres of a step.
const STEP_M: f64 = 1e-4;
/// How far from the first point LAS and LAZ files of scored returns reach along an axis: 32 bits of steps, metres.
pub const LAS_REACH_M: f64 = STEP_M * i32::MAX as f64;
/// The smallest of LAS 1.4 that LAZ keeps in layers.
const POINT_FORMAT: u8 = 6;
/// Bytes of a point of that format without extra bytes.
const POINT_BYTES: usize = 30;
/// The first and only return of its pulse.
const ONE_OF_ONE: u8 = 0x11;
/// Points handed to the writer at once.
const SLAB: usize = 1 << 13;

/// Writes points of format 6 with extra bytes.
pub(super) struct LasRows {
    writer: las::Writer<Recording>,
    failure: Failure,
    offset_m: [f64; 3],
    row_bytes: usize,
    rows: Vec<u8>,
    slab: PointData,
}

impl std::fmt::Debug for LasRows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LasRows").field("offset_m", &self.offset_m).finish_non_exhaustive()
    }
}

impl LasRows {
    pub(super) fn new(
        file: BufWriter<File>,
        is_compressed: bool,
        columns: &[Column],
        (near_m, crs): ([f64; 3], Option<&MetricCrs>),
    ) -> io::Result<Self> {
        let failure = Failure::default();
        let offset_m = near_m.map(f64::floor);
        let recording = Recording { file, failure: Arc::clone(&failure), at: 0 };
        let made = || -> las::Result<_> {
            let mut builder = Builder::from((1, 4));
            builder.point_format = Format::new(POINT_FORMAT)?;
            builder.point_format.is_compressed = is_compressed;
            builder.point_format.extra_bytes = row_bytes(columns) as u16;
            builder.generating_software = "dmp".into();
            // Files that are made again are the same.
            builder.date = None;
            let axis = |offset: f64| Transform { scale: STEP_M, offset };
            builder.transforms = Vector { x: axis(offset_m[0]), y: axis(offset_m[1]), z: axis(offset_m[2]) };
            let data = columns.iter().flat_map(Column::in_las).collect();
            let description = "extra bytes".into();
            builder.vlrs.push(Vlr { user_id: "LASF_Spec".into(), record_id: 4, description, data });
            let mut header = builder.into_header()?;
            if let Some(crs) = crs {
                // It ends with a zero byte.
                header.set_wkt_crs([crs.wkt().as_bytes(), &[0]].concat())?;
            }
            let writer = las::Writer::new(recording, header)?;
            let slab = PointDataBuilder::new().for_header(writer.header()).build();
            Ok((writer, slab))
        };
        let (writer, slab) = made().map_err(other).and_then(|made| first(&failure).map(|()| made))?;
        let row_bytes = POINT_BYTES + row_bytes(columns);
        Ok(Self { writer, failure, offset_m, row_bytes, rows: Vec::new(), slab })
    }

    /// A coordinate that the format cannot say.
    pub(super) fn too_far(&self, point_m: [f64; 3]) -> Option<f64> {
        // What is not a number is nowhere.
        let is_near = |k: &usize| (point_m[*k] - self.offset_m[*k]).abs() <= LAS_REACH_M;
        (0..3).find(|k| !is_near(k)).map(|k| point_m[k])
    }

    pub(super) fn write(&mut self, point_m: [f64; 3], time_s: f64, columns: &[u8]) -> io::Result<()> {
        let mut point = [0; POINT_BYTES];
        for (k, place) in point[..12].chunks_exact_mut(4).enumerate() {
            let steps = ((point_m[k] - self.offset_m[k]) / STEP_M).round() as i32;
            place.copy_from_slice(&steps.to_le_bytes());
        }
        point[14] = ONE_OF_ONE;
        point[22..].copy_from_slice(&time_s.to_le_bytes());
        self.rows.extend_from_slice(&point);
        self.rows.extend_from_slice(columns);
        if self.rows.len() >= SLAB * self.row_bytes { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.slab.resize_for(self.rows.len() / self.row_bytes).copy_from_slice(&self.rows);
        self.rows.clear();
        self.writer.write_points(&self.slab).map_err(other).and(first(&self.failure))
    }

    pub(super) fn finish(mut self) -> io::Result<BufWriter<File>> {
        self.flush()?;
        self.writer.close().map_err(other).and(first(&self.failure))?;
        Ok(self.writer.into_inner().map_err(other)?.file)
    }
}

fn other(error: las::Error) -> io::Error {
    match error {
        las::Error::Io(error) => error,
        other => io::Error::other(other),
    }
}

type Failure = Arc<Mutex<Option<io::Error>>>;

fn first(failure: &Failure) -> io::Result<()> {
    failure.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
}

/// A file whose failures are remembered instead of returned: the LAS writer panics over those that it meets on its way out.
struct Recording {
    file: BufWriter<File>,
    failure: Failure,
    /// Where the next byte goes, had nothing failed: the writer subtracts such places.
    at: u64,
}

impl Recording {
    fn record<T>(&self, result: io::Result<T>, instead: T) -> T {
        result.unwrap_or_else(|error| {
            self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            instead
        })
    }
}

impl Write for Recording {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.file.write_all(bytes);
        self.record(result, ());
        self.at += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.flush();
        self.record(result, ());
        Ok(())
    }
}

impl Seek for Recording {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let instead = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            SeekFrom::End(_) => self.at,
        };
        let result = self.file.seek(to);
        self.at = self.record(result, instead);
        Ok(self.at)
    }
}
