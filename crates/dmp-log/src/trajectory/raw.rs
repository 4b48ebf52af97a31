use super::{TrajectoryFormat, euroc, find_format, numbers, read_bytes};
use crate::text::lines;
use crate::{LogError, ParseError};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// A trajectory as its file has it: in the order of its lines, nothing sorted, left out or rounded to
/// nanoseconds, and rotations not made orthogonal. For comparisons whose numbers depend on that.
#[derive(Debug, Clone, PartialEq)]
pub struct RawTrajectory {
    /// The file's format.
    pub format: TrajectoryFormat,
    /// Stamps, seconds, one a pose; `None` for KITTI.
    pub stamps_s: Option<Vec<f64>>,
    /// Rotations `world_from_body`: quaternions normalised, matrices as written.
    pub rotations: Vec<Matrix3<f64>>,
    /// The body's places in the world, metres.
    pub positions_m: Vec<Vector3<f64>>,
    /// Quaternions of length zero, which were taken for no rotation.
    pub zero_quaternions: usize,
}

/// Reads a trajectory line by line, in `format` or, without one, in that which [`super::read_trajectory`]
/// would find.
///
/// # Errors
/// When the file cannot be read, has no poses, or in the first line that breaks the format.
pub fn read_raw_trajectory(path: &Path, format: Option<TrajectoryFormat>) -> Result<RawTrajectory, LogError> {
    let bytes = read_bytes(path)?;
    let format = match format {
        Some(format) => format,
        None => find_format(path, &bytes)?,
    };
    let raw = parse_raw(&bytes, format).map_err(|e| e.in_file(path))?;
    if raw.rotations.is_empty() {
        let problem = format!("no poses in {} bytes", bytes.len());
        return Err(LogError::malformed(path, crate::Place::WholeFile, problem));
    }
    Ok(raw)
}

/// Parses a trajectory line by line, as [`read_raw_trajectory`]. There may be no poses.
///
/// # Errors
/// In the first line that breaks the format.
pub fn parse_raw(bytes: &[u8], format: TrajectoryFormat) -> Result<RawTrajectory, ParseError> {
    let (mut stamps_s, mut rotations, mut positions_m) = (Vec::new(), Vec::new(), Vec::new());
    let mut zero_quaternions = 0;
    let mut width = None;
    for line in lines(bytes) {
        let (place, columns) = line?;
        let (position, [w, x, y, z]) = match format {
            TrajectoryFormat::Tum => {
                let [stamp_s, tx, ty, tz, qx, qy, qz, qw] =
                    numbers::<8>(place, &columns, "stamp tx ty tz qx qy qz qw")?;
                stamps_s.push(stamp_s);
                ([tx, ty, tz], [qw, qx, qy, qz])
            }
            TrajectoryFormat::Euroc => {
                let [stamp_ns, x, y, z, quaternion @ ..] = euroc::row(place, &columns, &mut width)?;
                stamps_s.push(stamp_ns / 1e9);
                ([x, y, z], quaternion)
            }
            TrajectoryFormat::Kitti => {
                let [a, b, c, tx, d, e, f, ty, g, h, i, tz] =
                    numbers::<12>(place, &columns, "a 3 x 4 matrix")?;
                rotations.push(Matrix3::new(a, b, c, d, e, f, g, h, i));
                positions_m.push(Vector3::new(tx, ty, tz));
                continue;
            }
        };
        let rotation = rotation_of([w, x, y, z]);
        zero_quaternions += usize::from(rotation.is_none());
        rotations.push(rotation.unwrap_or_else(Matrix3::identity));
        positions_m.push(position.into());
    }
    let stamps_s = (format != TrajectoryFormat::Kitti).then_some(stamps_s);
    Ok(RawTrajectory { format, stamps_s, rotations, positions_m, zero_quaternions })
}

/// The rotation of a quaternion of any length; `None` where it has none.
fn rotation_of(q: [f64; 4]) -> Option<Matrix3<f64>> {
    let square: f64 = q.iter().map(|c| c * c).sum();
    if square < 4.0 * f64::EPSILON {
        return None;
    }
    let scale = (2.0 / square).sqrt();
    let [w, x, y, z] = q.map(|c| c * scale);
    Some(Matrix3::new(
        1.0 - y * y - z * z,
        x * y - z * w,
        x * z + y * w,
        x * y + z * w,
        1.0 - x * x - z * z,
        y * z - x * w,
        x * z - y * w,
        y * z + x * w,
        1.0 - x * x - y * y,
    ))
}
