//! Trajectories as their files have them, nothing put right.

use super::format::TrajectoryFormat;
use super::format::{find_format, no_poses};
use super::numbers::numbers;
use super::read::read_bytes;
use super::{euroc, g2o, kitti, npy, redwood};
use crate::text::lines;
use crate::{LogError, ParseError};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// A trajectory as its file has it: in the order of its lines (of its ids, for a graph), nothing sorted, left out or rounded to
/// nanoseconds, and rotations not made orthogonal. For comparisons whose numbers depend on that.
#[derive(Debug, Clone, PartialEq)]
pub struct RawTrajectory {
    /// The file's format.
    pub format: TrajectoryFormat,
    /// Stamps, seconds, one a pose; `None` for formats without stamps.
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
        return Err(no_poses(&bytes).in_file(path));
    }
    Ok(raw)
}

/// Parses a trajectory line by line, as [`read_raw_trajectory`]. There may be no poses.
///
/// # Errors
/// In the first line that breaks the format.
pub fn parse_raw(bytes: &[u8], format: TrajectoryFormat) -> Result<RawTrajectory, ParseError> {
    let mut raw = RawTrajectory {
        format,
        stamps_s: format.has_stamps().then(Vec::new),
        rotations: Vec::new(),
        positions_m: Vec::new(),
        zero_quaternions: 0,
    };
    match format {
        TrajectoryFormat::Npy => npy::for_each_matrix(bytes, |_, rows| {
            raw.push_rows(rows);
            Ok(())
        })?,
        TrajectoryFormat::RedwoodLog => redwood::for_each_matrix(bytes, |_, rows| {
            raw.push_rows(rows);
            Ok(())
        })?,
        TrajectoryFormat::G2o => {
            let mut vertices = Vec::new();
            g2o::for_each_vertex(bytes, |vertex| {
                vertices.push(vertex);
                Ok(())
            })?;
            vertices.sort_by_key(|vertex| vertex.id);
            vertices.iter().for_each(|vertex| raw.push(vertex.position_m, vertex.quaternion));
        }
        TrajectoryFormat::Tum | TrajectoryFormat::Euroc | TrajectoryFormat::Kitti => raw.push_lines(bytes)?,
    }
    Ok(raw)
}

impl RawTrajectory {
    fn push_lines(&mut self, bytes: &[u8]) -> Result<(), ParseError> {
        let mut width = None;
        for line in lines(bytes) {
            let (place, columns) = line?;
            let (stamp_s, position_m, quaternion) = match self.format {
                TrajectoryFormat::Kitti => {
                    self.push_rows(numbers::<12>(place, &columns, kitti::ROW)?);
                    continue;
                }
                TrajectoryFormat::Euroc => {
                    let [stamp_ns, x, y, z, qw, qx, qy, qz] = euroc::row(place, &columns, &mut width)?;
                    (stamp_ns / 1e9, [x, y, z], [qx, qy, qz, qw])
                }
                _ => {
                    let [stamp_s, x, y, z, quaternion @ ..] =
                        numbers::<8>(place, &columns, "stamp tx ty tz qx qy qz qw")?;
                    (stamp_s, [x, y, z], quaternion)
                }
            };
            self.stamps_s.get_or_insert_default().push(stamp_s);
            self.push(position_m, quaternion);
        }
        Ok(())
    }

    fn push_rows(&mut self, [a, b, c, tx, d, e, f, ty, g, h, i, tz]: [f64; 12]) {
        self.rotations.push(Matrix3::new(a, b, c, d, e, f, g, h, i));
        self.positions_m.push(Vector3::new(tx, ty, tz));
    }

    /// A place and a quaternion x, y, z, w.
    fn push(&mut self, position_m: [f64; 3], quaternion: [f64; 4]) {
        let rotation = rotation_of(quaternion);
        self.zero_quaternions += usize::from(rotation.is_none());
        self.rotations.push(rotation.unwrap_or_else(Matrix3::identity));
        self.positions_m.push(position_m.into());
    }
}

/// The rotation of a quaternion x, y, z, w of any length; `None` where it has none.
fn rotation_of(q: [f64; 4]) -> Option<Matrix3<f64>> {
    // In the order w, x, y, z, in which others add, so that numbers agree to the last bit.
    let [x, y, z, w] = q;
    let square: f64 = [w, x, y, z].map(|c| c * c).iter().sum();
    if square < 4.0 * f64::EPSILON {
        return None;
    }
    let scale = (2.0 / square).sqrt();
    let [x, y, z, w] = q.map(|c| c * scale);
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
