//! The points of an E57 file as a cloud: those of all its scans, posed as it says.

use super::batches::{Batches, Sink, broken};
use super::format::CloudFormat;
use crate::file::open_sized;
use crate::{LogError, PlaceInFile};
use e57::{CartesianCoordinate, E57Reader};
use std::path::Path;

/// Points that it marks as invalid come as what is not finite.
pub(super) fn read<E: From<LogError>>(
    path: &Path,
    scale: [f64; 3],
    sink: &mut Sink<'_, E>,
) -> Result<(CloudFormat, u64), E> {
    let (input, _) = open_sized(path)?;
    let wrong = |error: e57::Error| broken::<E>(path, PlaceInFile::WholeFile, format!("E57: {error}"));
    let mut file = E57Reader::new(input).map_err(wrong)?;
    let mut batches = Batches::scaled(sink, scale);
    for scan in file.pointclouds() {
        let mut points = file.pointcloud_simple(&scan).map_err(wrong)?;
        points.apply_pose(true);
        points.intensity_to_color(false);
        for point in points {
            batches.push(match point.map_err(wrong)?.cartesian {
                CartesianCoordinate::Valid { x, y, z } => [x, y, z],
                _ => [f64::NAN; 3],
            })?;
        }
    }
    batches.flush()?;
    Ok((CloudFormat::E57, batches.points))
}
