use super::las_header::{self, LasHeader};
use super::las_units::{self, ToMetres};
use super::{BATCH, Batches, CloudFormat, broken};
use crate::decimal::shorten;
use crate::{LengthUnit, LogError, Place};
use las::reader::{LazParallelism, ReaderOptions};
use las::{PointData, PointDataBuilder, Reader};
use std::fs::File;
use std::io::{BufReader, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
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
    let file = File::open(path).map_err(|e| LogError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| LogError::io(path, "read", e))?.len();
    let mut input = BufReader::with_capacity(1 << 16, file);
    let header = las_header::check(&mut input, length).map_err(|e| e.in_file(path))?;
    let ToMetres { scale, note } = match unit {
        Some(unit) => ToMetres { scale: [unit.metres(); 3], note: None },
        None => las_units::of(&header).map_err(|e| e.in_file(path))?,
    };
    let LasHeader { points, compressed, .. } = header;
    input.rewind().map_err(|e| LogError::io(path, "read", e))?;
    // Batches as small as these are not worth the parallel decoder, which trusts the chunk table more.
    let options = ReaderOptions::default().with_laz_parallelism(LazParallelism::No);
    let reader = guarded(|| Reader::with_options(input, options));
    let mut reader = reader.map_err(|problem| broken::<E>(path, Place::WholeFile, problem))?;
    let mut data = PointDataBuilder::new().for_header(reader.header()).build();
    let mut batches = Batches::scaled(sink, scale);
    while batches.points < points {
        let done = batches.points;
        let wanted = (points - done).min(BATCH as u64);
        let read = guarded(|| reader.fill_points(wanted, &mut data));
        match read {
            Ok(0) => {
                return Err(broken(
                    path,
                    Place::Point(done),
                    format!("the file ends after {done} of {points} points"),
                ));
            }
            Ok(_) => hand_over(&data, &mut batches)?,
            Err(problem) => {
                let problem = format!("cannot decode the points from here, of {points}: {problem}");
                return Err(broken(path, Place::Point(done), problem));
            }
        }
    }
    batches.flush()?;
    let format = if compressed { CloudFormat::Laz } else { CloudFormat::Las };
    Ok((format, points, note))
}

fn hand_over<E, F>(data: &PointData, batches: &mut Batches<'_, F>) -> Result<(), E>
where
    F: FnMut(&[[f64; 3]]) -> Result<(), E>,
{
    let mut points = data.x().zip(data.y()).zip(data.z());
    points.try_for_each(|((x, y), z)| batches.push([x, y, z]))
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
