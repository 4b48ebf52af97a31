//! Clouds written as tables: a row for each point, its place first.

mod column;
mod las_rows;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use dmp_disk::OutputFile;

use super::format::CloudFormat;
use super::wkt::MetricCrs;
use crate::LogError;
pub(crate) use column::{Column, Number};
pub use las_rows::LAS_REACH_M;
use las_rows::LasRows;

const BUFFER_BYTES: usize = 1 << 18;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Table<'a> {
    pub(crate) format: CloudFormat,
    /// What stands beside the places.
    pub(crate) columns: &'a [Column],
    pub(crate) points: u64,
    /// A place not far from all others: LAS counts steps from it.
    pub(crate) near_m: [f64; 3],
    /// A line for the head of a PLY file.
    pub(crate) comment: &'a str,
    /// The coordinate system, for LAS and LAZ.
    pub(crate) crs: Option<&'a MetricCrs>,
}

/// Writes a cloud row by row: PLY and PCD in bytes, lowest first, with float64 places; LAS and LAZ 1.4 with steps of
/// 0.1 mm and the columns as extra bytes. The file gets its name in [`TableWriter::finish`]; without it nothing is left
/// behind.
#[derive(Debug)]
pub(crate) struct TableWriter {
    // Dropped first: the writer may still write while it is dropped.
    out: Output,
    output: OutputFile,
    promised: u64,
    written: u64,
}

#[derive(Debug)]
enum Output {
    Rows(BufWriter<File>),
    Las(Box<LasRows>),
}

impl TableWriter {
    pub(crate) fn create(path: &Path, table: &Table<'_>) -> Result<Self, LogError> {
        let &Table { format, columns, points, near_m, comment, crs } = table;
        let output = OutputFile::create(path).map_err(|e| LogError::io(path, "write", e))?;
        let file = output.file().map_err(|e| LogError::io(path, "write", e))?;
        let mut file = BufWriter::with_capacity(BUFFER_BYTES, file);
        let out = match format {
            CloudFormat::Ply => {
                let columns: String = columns.iter().map(Column::in_ply).collect();
                write!(
                    file,
                    "ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {points}\n\
                     property double x\nproperty double y\nproperty double z\n{columns}end_header\n"
                )
                .map(|()| Output::Rows(file))
            }
            CloudFormat::Pcd => {
                file.write_all(column::pcd_head(columns, points).as_bytes()).map(|()| Output::Rows(file))
            }
            CloudFormat::E57 => Err(io::Error::new(io::ErrorKind::Unsupported, "E57 is read, not written")),
            CloudFormat::Las | CloudFormat::Laz => {
                LasRows::new(file, format == CloudFormat::Laz, columns, (near_m, crs))
                    .map(|rows| Output::Las(Box::new(rows)))
            }
        };
        let out = out.map_err(|e| LogError::io(path, "write", e))?;
        Ok(Self { out, output, promised: points, written: 0 })
    }

    /// Writes the next row: a place, a time for formats that have one of their own, seconds, and the columns' numbers
    /// one after the other, lowest byte first.
    pub(crate) fn write(&mut self, point_m: [f64; 3], time_s: f64, columns: &[u8]) -> Result<(), LogError> {
        self.written += 1;
        let written = match &mut self.out {
            Output::Rows(file) => {
                let place = point_m.map(f64::to_le_bytes);
                file.write_all(place.as_flattened()).and_then(|()| file.write_all(columns))
            }
            Output::Las(rows) => {
                if let Some(far_m) = rows.too_far(point_m) {
                    // The file cannot hold it: that is no wrong usage.
                    let problem = format!(
                        "a coordinate of {far_m} m is too far from the first point for LAS: a .ply or .pcd holds it"
                    );
                    return Err(LogError::io(self.output.target(), "write", io::Error::other(problem)));
                }
                rows.write(point_m, time_s, columns)
            }
        };
        written.map_err(|e| LogError::io(self.output.target(), "write", e))
    }

    /// Gives the file its name.
    pub(crate) fn finish(self) -> Result<(), LogError> {
        let Self { output, out, promised, written } = self;
        let target = output.target().to_path_buf();
        let io = |e| LogError::io(&target, "write", e);
        if promised != written {
            return Err(io(io::Error::other(format!(
                "{written} points were given, {promised} were promised"
            ))));
        }
        let file = match out {
            Output::Rows(file) => file,
            Output::Las(rows) => rows.finish().map_err(io)?,
        };
        drop(file.into_inner().map_err(|e| io(e.into_error()))?);
        output.commit().map_err(io)
    }
}
