//! The points of a LAS or LAZ file as a cloud, in metres.

use super::batches::{Batches, Sink};
use super::format::CloudFormat;
use super::las_points::LasPoints;
use super::las_units::{self, ToMetres};
use crate::file::ReadCount;
use crate::{LengthUnit, LogError};
use std::path::Path;

/// Reads the points of a LAS or LAZ file batch by batch, in `unit` or in what the file says. Also answers what
/// is to be said of the unit.
pub(super) fn read<E: From<LogError>>(
    path: &Path,
    unit: Option<LengthUnit>,
    sink: &mut Sink<'_, E>,
) -> Result<(CloudFormat, u64, Option<String>), E> {
    let mut file = LasPoints::open(path, &ReadCount::default())?.ahead();
    let ToMetres { scale, note } = match unit {
        Some(unit) => ToMetres { scale: [unit.metres(); 3], note: None },
        None => las_units::of(file.header()).map_err(|e| e.in_file(path))?,
    };
    let points = file.header().points;
    let mut batches = Batches::scaled(sink, scale);
    while batches.points < points {
        let data = file.read(points - batches.points)?;
        let mut places = data.x().zip(data.y()).zip(data.z());
        places.try_for_each(|((x, y), z)| batches.push([x, y, z]))?;
    }
    batches.flush()?;
    let format = if file.header().laz.is_some() { CloudFormat::Laz } else { CloudFormat::Las };
    Ok((format, points, note))
}
