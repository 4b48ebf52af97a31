//! Trajectories as their files have them, nothing put right.

use super::described::{has_matrix, may_be_quaternion};
use super::format::{TrajectoryFormat, find_format, no_poses};
use super::read::read_bytes;
use super::{euroc, g2o, kitti, matrices, npy, redwood};
use crate::file::columns::numbers;
use crate::file::{lines, unit_of_large_numbers, unit_of_lines};
use crate::poses::trajectory::named::csv;
use crate::{LogError, ParseError, PlaceInFile, TimeUnit};
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
    /// Rotations `world_from_body`: quaternions normalised, matrices as written; none of them turns where there are places alone.
    pub rotations: Vec<Matrix3<f64>>,
    /// Whether these are of the file.
    pub has_rotations: bool,
    /// The body's places in the world, metres.
    pub positions_m: Vec<Vector3<f64>>,
    /// Quaternions of length zero, which were taken for no rotation.
    pub zero_quaternions: usize,
    /// What was guessed.
    pub notes: Vec<String>,
}

/// Reads a trajectory line by line, in `format` or, without one, in that which [`super::read_trajectory`]
/// would find.
///
/// # Errors
/// When the file cannot be read, has no poses, or in the first line that breaks the format.
pub fn read_raw_trajectory(path: &Path, format: Option<TrajectoryFormat>) -> Result<RawTrajectory, LogError> {
    read_raw_trajectory_as(path, format, None)
}

/// As [`read_raw_trajectory`], with stamps in this unit where they may be of several and would be refused without it.
///
/// # Errors
/// As [`read_raw_trajectory`], and when no unit is given for stamps that can be no seconds and do not count from 1970.
pub fn read_raw_trajectory_as(
    path: &Path,
    format: Option<TrajectoryFormat>,
    unit: Option<TimeUnit>,
) -> Result<RawTrajectory, LogError> {
    let bytes = read_bytes(path)?;
    let is_found = format.is_none();
    let format = match format {
        Some(format) => format,
        None => find_format(path, &bytes)?.with_stamps_in(unit),
    };
    let mut notes = Vec::new();
    let found = match format {
        TrajectoryFormat::Tum | TrajectoryFormat::Matrices => {
            Some(unit_of_lines(&bytes, unit, &mut notes).map_err(|e| e.in_file(path))?)
        }
        TrajectoryFormat::Euroc => Some(unit_of_large_numbers(&bytes, &mut notes)),
        _ => unit,
    };
    let mut raw = parse_raw_in(&bytes, format, found, is_found).map_err(|e| e.in_file(path))?;
    raw.notes.splice(..0, notes);
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
    parse_raw_in(bytes, format, None, false)
}

/// The same with stamps in this unit, or in that of the format. Where the format was found from the first line, rotations of all
/// lines must be some.
fn parse_raw_in(
    bytes: &[u8],
    format: TrajectoryFormat,
    unit: Option<TimeUnit>,
    is_found: bool,
) -> Result<RawTrajectory, ParseError> {
    let mut raw = RawTrajectory {
        format,
        stamps_s: format.has_stamps().then(Vec::new),
        rotations: Vec::new(),
        has_rotations: true,
        positions_m: Vec::new(),
        zero_quaternions: 0,
        notes: Vec::new(),
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
        TrajectoryFormat::Csv => raw.push_named(bytes, unit, is_found)?,
        TrajectoryFormat::Tum
        | TrajectoryFormat::Euroc
        | TrajectoryFormat::Kitti
        | TrajectoryFormat::Matrices
        | TrajectoryFormat::Numbered => {
            raw.push_lines(bytes, unit, is_found)?;
        }
    }
    Ok(raw)
}

impl RawTrajectory {
    fn push_named(&mut self, bytes: &[u8], unit: Option<TimeUnit>, is_found: bool) -> Result<(), ParseError> {
        let header = csv::header_of(bytes)?;
        let unit = csv::unit_in(bytes, &header, header.unit(), unit, &mut self.notes)?;
        self.has_rotations = header.quaternion.is_ok();
        csv::for_each_row(bytes, &header, |row| {
            self.stamps_s.get_or_insert_default().push(row.stamp.in_s(unit));
            let none = [0.0, 0.0, 0.0, 1.0];
            check(is_found, row.place, row.quaternion.as_ref().unwrap_or(&none))?;
            self.push(row.position_m, row.quaternion.unwrap_or(none));
            Ok(())
        })
    }

    fn push_lines(&mut self, bytes: &[u8], unit: Option<TimeUnit>, is_found: bool) -> Result<(), ParseError> {
        let per_s = |of_format: TimeUnit| 1e9 / unit.unwrap_or(of_format).in_ns() as f64;
        let mut width = None;
        for line in lines(bytes) {
            let (place, columns) = line?;
            let (stamp_s, position_m, quaternion) = match self.format {
                TrajectoryFormat::Kitti => {
                    let rows = kitti::row(place, &columns)?;
                    check(is_found, place, &rows)?;
                    self.push_rows(rows);
                    continue;
                }
                TrajectoryFormat::Matrices | TrajectoryFormat::Numbered => {
                    let (stamp, rows) = matrices::row(place, &columns)?;
                    let [stamp] = numbers::<1>(place, &[stamp], "a stamp")?;
                    check(is_found, place, &rows)?;
                    self.stamps_s.get_or_insert_default().push(stamp / per_s(TimeUnit::Seconds));
                    self.push_rows(rows);
                    continue;
                }
                TrajectoryFormat::Euroc => {
                    let [stamp_ns, x, y, z, qw, qx, qy, qz] = euroc::row(place, &columns, &mut width)?;
                    (stamp_ns / per_s(TimeUnit::Nanoseconds), [x, y, z], [qx, qy, qz, qw])
                }
                _ => {
                    let [stamp, x, y, z, quaternion @ ..] =
                        numbers::<8>(place, &columns, "stamp tx ty tz qx qy qz qw")?;
                    (stamp / per_s(TimeUnit::Seconds), [x, y, z], quaternion)
                }
            };
            self.stamps_s.get_or_insert_default().push(stamp_s);
            check(is_found, place, &quaternion)?;
            self.push(position_m, quaternion);
        }
        if self.format == TrajectoryFormat::Numbered {
            self.notes.push("no stamps: poses of the same frame number (column 1) are one".to_owned());
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

/// Whether the numbers of a line, those of a quaternion or the rows of `[R t]`, are a rotation, where their columns were found from
/// the first line. Who names the format has the numbers as they are.
fn check(is_found: bool, place: PlaceInFile, numbers: &[f64]) -> Result<(), ParseError> {
    let problem = match numbers {
        _ if !is_found => return Ok(()),
        &[qx, qy, qz, qw] if !may_be_quaternion(numbers) => {
            let norm = ((qx * qx + qy * qy) + (qz * qz + qw * qw)).sqrt();
            format!("the quaternion ({qx}, {qy}, {qz}, {qw}) has the norm {norm:.4}, not 1")
        }
        rows if rows.len() == 12 && !has_matrix(rows, 0) => {
            let [a, b, c, _, d, e, f, _, g, h, i, _] = rows else { return Ok(()) };
            format!("the 3 x 3 part ({a}, {b}, {c}; {d}, {e}, {f}; {g}, {h}, {i}) is no rotation")
        }
        _ => return Ok(()),
    };
    Err(ParseError::new(place, problem))
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
