//! The head of a LAS or LAZ file with one scan, and its points.

use crate::file::ReadCount;
use crate::geometry::cloud::las_points::LasPoints;
use crate::geometry::cloud::{las_header, las_units};
use crate::logs::scan_folder::scan_file::head::{Body, Head};
use crate::points::{Field, Layout, NumberType};
use crate::{LogError, ParseError, PlaceInFile};
use std::io::{Read, Seek};
use std::path::Path;

/// Farther than any sensor sees.
const FARTHEST_M: f64 = 10_000.0;
/// The numbers of a point that are handed on, all float64.
const FIELDS: [&str; 4] = ["x", "y", "z", "gps_time"];

/// Reads and checks a head.
pub(crate) fn head(path: &Path, input: &mut (impl Read + Seek), length: u64) -> Result<Head, LogError> {
    let in_file = |error: ParseError| error.in_file(path);
    let wrong = |problem: String| LogError::malformed(path, PlaceInFile::WholeFile, problem);
    let las = las_header::check(input, length).map_err(in_file)?;
    if let Some(extent_m) = las.extent.filter(|&extent_m| extent_m > FARTHEST_M) {
        let problem = format!("a coordinate of {extent_m} is no scan's, whose sensor is at 0,0,0");
        return Err(LogError::WorldCoordinates { path: path.into(), problem });
    }
    let to_metres = las_units::of(&las).map_err(in_file)?;
    if to_metres.scale != [1.0; 3] {
        let note = to_metres.note.unwrap_or_default();
        return Err(wrong(format!("a scan is in metres: {note}")));
    }
    let count = if las.gps_time.is_some() { 4 } else { 3 };
    let field = |(k, name): (usize, &str)| (name.to_owned(), Field { offset: 8 * k, kind: NumberType::F64 });
    let named = FIELDS.into_iter().take(count).enumerate().map(field).collect();
    let layout = Layout::new(named, false, 8 * count as u32).map_err(wrong)?;
    Ok(Head { layout, points: las.points, body: Body::Las { compressed: las.laz.is_some() } })
}

/// Decodes the first `points` points, and forgets them.
pub(crate) fn decode(path: &Path, count: &ReadCount, points: u64) -> Result<(), LogError> {
    let mut file = LasPoints::open(path, count)?;
    let mut done = 0;
    while done < points {
        done += file.read(points - done)?.len() as u64;
    }
    Ok(())
}

/// Reads the first `points` points.
pub(crate) fn read_rows(
    path: &Path,
    count: &ReadCount,
    points: u64,
    layout: &Layout,
    rows: &mut Vec<u8>,
) -> Result<(), LogError> {
    let mut file = LasPoints::open(path, count)?;
    let timed = layout.field("gps_time").is_some();
    let mut done = 0;
    while done < points {
        let batch = file.read(points - done)?;
        let places = batch.x().zip(batch.y()).zip(batch.z());
        match batch.gps_time().filter(|_| timed) {
            Some(times) => {
                for (((x, y), z), time) in places.zip(times) {
                    rows.extend_from_slice([x, y, z, time].map(f64::to_le_bytes).as_flattened());
                }
            }
            None if timed => {
                let problem = "the file has changed since it was opened".to_owned();
                return Err(LogError::malformed(path, PlaceInFile::WholeFile, problem));
            }
            None => {
                for ((x, y), z) in places {
                    rows.extend_from_slice([x, y, z].map(f64::to_le_bytes).as_flattened());
                }
            }
        }
        done += batch.len() as u64;
    }
    Ok(())
}
