//! Writing scored returns in any of the formats.

use super::play::ScanPlayer;
use super::point::{COLUMN_BYTES, COLUMNS, ScoredPoint, ScoredScan};
use crate::LogError;
use crate::file::decimal;
use crate::geometry::CloudFormat;
use crate::geometry::cloud::table::{Table, TableWriter};
use std::path::Path;

/// The formats of scored returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResidualFormat {
    /// A cloud in world coordinates: LAS or LAZ with extra bytes, PLY or PCD with fields.
    Cloud(CloudFormat),
    /// MCAP with a `PointCloud2` for each scan, in the frame of the sensor, and the sensor's pose as `/tf`.
    Mcap,
}

impl ResidualFormat {
    /// The extensions of files, without a full stop.
    pub const EXTENSIONS: [&str; 5] = ["laz", "las", "ply", "pcd", "mcap"];

    /// That which an extension says, whatever its case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        Some(match extension.to_ascii_lowercase().as_str() {
            "laz" => Self::Cloud(CloudFormat::Laz),
            "las" => Self::Cloud(CloudFormat::Las),
            "ply" => Self::Cloud(CloudFormat::Ply),
            "pcd" => Self::Cloud(CloudFormat::Pcd),
            "mcap" => Self::Mcap,
            _ => return None,
        })
    }
}

/// What is written.
#[derive(Debug, Clone, Copy)]
pub struct ResidualHead<'a> {
    /// The run: in MCAP the name of the sensor's frame, and the topic is `/NAME/residuals`.
    pub run: &'a str,
    /// How many points there will be.
    pub points: u64,
    /// A place not far from all others, world metres: LAS counts steps from it.
    pub near_m: [f64; 3],
    /// The stamp of the log's first scan, nanoseconds, which `time_s` counts from; `None` where the log has no stamps.
    pub start_ns: Option<i64>,
}

/// Writes scored returns, scan by scan. The same points give the same bytes. The file gets its name in
/// [`ResidualWriter::finish`]; without it nothing is left behind. Fields and formats are those of `docs/residuals.md`.
#[derive(Debug)]
pub struct ResidualWriter {
    out: Out,
    start_ns: i64,
}

#[derive(Debug)]
enum Out {
    Cloud(TableWriter),
    Mcap(Box<ScanPlayer>),
}

impl ResidualWriter {
    /// Starts a file that will be at `path`, in place of what may be there.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path, format: ResidualFormat, head: &ResidualHead<'_>) -> Result<Self, LogError> {
        let out = match format {
            ResidualFormat::Cloud(format) => {
                let comment = match head.start_ns {
                    Some(start_ns) => {
                        format!("dmp residuals; time_s 0 is {}", decimal::ns_to_seconds(start_ns))
                    }
                    None => "dmp residuals".to_owned(),
                };
                let (points, near_m, comment) = (head.points, head.near_m, comment.as_str());
                Out::Cloud(TableWriter::create(
                    path,
                    &Table { format, columns: &COLUMNS, points, near_m, comment, crs: None },
                )?)
            }
            ResidualFormat::Mcap => Out::Mcap(Box::new(ScanPlayer::create(path, head.run)?)),
        };
        Ok(Self { out, start_ns: head.start_ns.unwrap_or(0) })
    }

    /// Appends returns of a scan: for MCAP all of them at once, for clouds in parts too.
    ///
    /// # Errors
    /// When the disk is full; when a point lies too far from the first for LAS; when the scan has no stamp, or one
    /// beyond what ROS 2 can say, for MCAP.
    pub fn write_scan(&mut self, scan: &ScoredScan, points: &[ScoredPoint]) -> Result<(), LogError> {
        match &mut self.out {
            Out::Cloud(table) => points.iter().try_for_each(|point| {
                let row = point.to_bytes();
                let gps_time_s = self.start_ns as f64 / 1e9 + point.time_s;
                table.write(point.point_in_world_m, gps_time_s, &row[ScoredPoint::BYTES - COLUMN_BYTES..])
            }),
            Out::Mcap(player) => player.write(scan, self.start_ns, points),
        }
    }

    /// Writes the end, makes the file safe on disk and gives it its name.
    ///
    /// # Errors
    /// When the disk is full, the file cannot be renamed, or there were not as many points as promised.
    pub fn finish(self) -> Result<(), LogError> {
        match self.out {
            Out::Cloud(table) => table.finish(),
            Out::Mcap(player) => player.finish(),
        }
    }
}
