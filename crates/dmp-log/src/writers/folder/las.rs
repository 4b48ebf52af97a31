//! Scans as LAS or LAZ.

use dmp_sensor::Scan;
use las::point::Format;
use las::{Builder, Point, Transform, Vector, Writer};
use std::io::Cursor;

/// Metres of a step. 32 bits of it reach 214 km.
const STEP_M: f64 = 1e-4;
/// With times, and kept in layers by LAZ.
const POINT_FORMAT: u8 = 6;

/// Writes a scan in memory, so that a full disk meets no writer that cannot say so. What cannot be written is
/// said with its value.
pub(super) fn write(scan: &Scan, is_compressed: bool, bytes: &mut Vec<u8>) -> Result<(), String> {
    let encoded = || -> las::Result<Vec<u8>> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(POINT_FORMAT)?;
        builder.point_format.is_compressed = is_compressed;
        builder.generating_software = "dmp".into();
        // Files that are made again are the same.
        builder.date = None;
        let axis = Transform { scale: STEP_M, offset: 0.0 };
        builder.transforms = Vector { x: axis, y: axis, z: axis };
        let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
        for (k, place) in scan.points_in_sensor_m.iter().enumerate() {
            let [x, y, z] = if place.iter().all(|c| c.is_finite()) { place.map(f64::from) } else { [0.0; 3] };
            let offset_ns = scan.time_offsets_ns.get(k).copied().unwrap_or(0);
            let gps_time = Some(offset_ns as f64 / 1e9);
            let point =
                Point { x, y, z, gps_time, return_number: 1, number_of_returns: 1, ..Point::default() };
            writer.write_point(point)?;
        }
        writer.close()?;
        Ok(writer.into_inner()?.into_inner())
    };
    if let Some(beyond) = scan.points_in_sensor_m.iter().flatten().find(|c| is_beyond(**c)) {
        return Err(format!("a coordinate of {beyond} m is beyond 32 bits of {STEP_M} m"));
    }
    *bytes = encoded().map_err(|error| error.to_string())?;
    Ok(())
}

fn is_beyond(coordinate_m: f32) -> bool {
    coordinate_m.is_finite() && f64::from(coordinate_m.abs()) > STEP_M * f64::from(i32::MAX)
}
