//! The points of a LAS or LAZ file as a cloud, in metres.

use super::batches::Batches;
use super::format::CloudFormat;
use super::las_points::LasPoints;
use super::las_units::{self, ToMetres};
use crate::reads::ReadCount;
use crate::{LengthUnit, LogError};
use las::PointData;
use std::path::Path;

/// Reads the points of a LAS or LAZ file batch by batch, in `unit` or in what the file says. Also answers what
/// is to be said of the unit.
pub(super) fn read<E, F>(
    path: &Path,
    unit: Option<LengthUnit>,
    sink: &mut F,
) -> Result<(CloudFormat, u64, Option<String>), E>
where
    E: From<LogError>,
    F: FnMut(&[[f64; 3]]) -> Result<(), E>,
{
    let mut file = LasPoints::open(path, &ReadCount::default())?.ahead();
    let ToMetres { scale, note } = match unit {
        Some(unit) => ToMetres { scale: [unit.metres(); 3], note: None },
        None => las_units::of(file.header()).map_err(|e| e.in_file(path))?,
    };
    let points = file.header().points;
    let mut batches = Batches::scaled(sink, scale);
    while batches.points < points {
        let left = points - batches.points;
        hand_over(file.read(left)?, &mut batches)?;
    }
    batches.flush()?;
    let format = if file.header().laz.is_some() { CloudFormat::Laz } else { CloudFormat::Las };
    Ok((format, points, note))
}

fn hand_over<E, F>(data: &PointData, batches: &mut Batches<'_, F>) -> Result<(), E>
where
    F: FnMut(&[[f64; 3]]) -> Result<(), E>,
{
    let mut points = data.x().zip(data.y()).zip(data.z());
    points.try_for_each(|((x, y), z)| batches.push([x, y, z]))
}
