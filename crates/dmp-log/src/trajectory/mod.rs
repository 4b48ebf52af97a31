//! Trajectories in text files.

mod euroc;
mod kitti;
mod raw;
mod tum;

pub use euroc::parse_euroc;
pub use kitti::{parse_kitti, write_kitti};
pub use raw::{RawTrajectory, parse_raw, read_raw_trajectory};
pub use tum::{parse_tum, write_tum};

use crate::decimal::shorten;
use crate::folder::parse_times;
use crate::text::lines;
use crate::{LogError, ParseError, Place, fingerprint};
use dmp_sensor::{Isometry3, Quaternion, Trajectory, TrajectoryRepairs, Translation3, UnitQuaternion};
use std::fs;
use std::path::Path;

/// Farthest a pose may be from the world's origin, metres: ten times the size of the Earth.
const MAX_PLACE_M: f64 = 1e8;
/// Largest trajectory that is read. A day at 200 poses a second has 2 GiB; more is another file.
const MAX_BYTES: u64 = 4 << 30;
/// How far the norm of a quaternion may be from 1: text is rounded, but not by this much.
const NORM_TOLERANCE: f64 = 0.1;

/// The formats of trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrajectoryFormat {
    /// Lines of `stamp tx ty tz qx qy qz qw`.
    Tum,
    /// Lines of the twelve numbers of a 3 × 4 matrix.
    Kitti,
    /// Lines of `stamp_ns,x,y,z,qw,qx,qy,qz` and perhaps more columns.
    Euroc,
}

impl TrajectoryFormat {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM",
            Self::Kitti => "KITTI",
            Self::Euroc => "EuRoC",
        }
    }
}

/// A trajectory read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryFile {
    /// The file's format.
    pub format: TrajectoryFormat,
    /// The poses, `world_from_body`, in order of time.
    pub trajectory: Trajectory,
    /// Poses whose stamp was smaller than the one before them; they were put in order.
    pub out_of_order: usize,
    /// Repeated poses that were left out.
    pub repeated: usize,
    /// What was guessed.
    pub notes: Vec<String>,
    /// Identifies the file, as `crc32:1a2b3c4d`.
    pub fingerprint: String,
}

/// What can be wrong with a trajectory's text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryParseError {
    /// A line is wrong.
    #[error(transparent)]
    Line(#[from] ParseError),
    /// The lines are well, the poses contradict each other.
    #[error(transparent)]
    Poses(#[from] dmp_sensor::TrajectoryError),
}

impl TrajectoryParseError {
    /// The same with the name of the file.
    pub fn in_file(self, path: &Path) -> LogError {
        match self {
            Self::Line(error) => error.in_file(path),
            Self::Poses(source) => LogError::Trajectory { path: path.into(), source },
        }
    }
}

/// Reads a trajectory in TUM, KITTI or EuRoC format, told apart by the columns of its first line. Poses in
/// KITTI format have the stamps of a `times.txt` beside the file where that has as many lines.
///
/// # Errors
/// When the file cannot be read, has no poses, is in no such format, or breaks it in some line.
pub fn read_trajectory(path: &Path) -> Result<TrajectoryFile, LogError> {
    let bytes = read_bytes(path)?;
    let fingerprint = fingerprint::of_file(path).map_err(|e| LogError::io(path, "read", e))?;
    let mut notes = Vec::new();
    let format = find_format(path, &bytes)?;
    let repairs = match format {
        TrajectoryFormat::Tum => parse_tum(&bytes).map_err(|e| e.in_file(path))?,
        TrajectoryFormat::Euroc => parse_euroc(&bytes).map_err(|e| e.in_file(path))?,
        TrajectoryFormat::Kitti => read_kitti(path, &bytes, &mut notes)?,
    };
    let TrajectoryRepairs { trajectory, out_of_order, repeated } = repairs;
    Ok(TrajectoryFile { format, trajectory, out_of_order, repeated, notes, fingerprint })
}

/// The bytes of a file that is not too large to be a trajectory.
fn read_bytes(path: &Path) -> Result<Vec<u8>, LogError> {
    let length = fs::metadata(path).map_err(|e| LogError::io(path, "open", e))?.len();
    if length > MAX_BYTES {
        let problem = format!("{length} bytes are no trajectory, at most {MAX_BYTES} are read");
        return Err(LogError::malformed(path, Place::WholeFile, problem));
    }
    fs::read(path).map_err(|e| LogError::io(path, "read", e))
}

/// The format, by the first line with data.
fn find_format(path: &Path, bytes: &[u8]) -> Result<TrajectoryFormat, LogError> {
    let Some(first) = lines(bytes).next() else {
        let problem = format!("no poses in {} bytes", bytes.len());
        return Err(LogError::malformed(path, Place::WholeFile, problem));
    };
    let (place, columns) = first.map_err(|e| e.in_file(path))?;
    if is_euroc(bytes, place, &columns) {
        return Ok(TrajectoryFormat::Euroc);
    }
    match columns.len() {
        8 => Ok(TrajectoryFormat::Tum),
        12 => Ok(TrajectoryFormat::Kitti),
        count => {
            let first = columns.first().copied().unwrap_or_default();
            let problem = format!(
                "{count} columns starting with `{}`: neither TUM (8: stamp tx ty tz qx qy qz qw) nor KITTI (12) \
                nor EuRoC (8 or more with commas: stamp_ns,x,y,z,qw,qx,qy,qz)",
                shorten(first)
            );
            Err(LogError::malformed(path, place, problem))
        }
    }
}

/// Whether the lines are EuRoC's: parted by commas, and stamps in nanoseconds, by the heading (`[ns]`) or
/// by their digits (TUM's seconds since 1970 have ten before the point).
fn is_euroc(bytes: &[u8], place: Place, columns: &[&str]) -> bool {
    let Place::Line(number) = place else { return false };
    let count = usize::try_from(number).unwrap_or(usize::MAX);
    let mut commented = bytes.split(|&c| c == b'\n').take(count);
    let line = commented.clone().last().unwrap_or_default();
    let mut in_ns = || commented.any(|line| line.starts_with(b"#") && line.windows(4).any(|w| w == b"[ns]"));
    let whole = |stamp: &&str| stamp.len() >= 15 && stamp.bytes().all(|c| c.is_ascii_digit());
    columns.len() >= euroc::COLUMNS && line.contains(&b',') && (columns.first().is_some_and(whole) || in_ns())
}

fn read_kitti(path: &Path, bytes: &[u8], notes: &mut Vec<String>) -> Result<TrajectoryRepairs, LogError> {
    let trajectory = parse_kitti(bytes).map_err(|e| e.in_file(path))?;
    let times = path.with_file_name("times.txt");
    if times.is_file() && times != path {
        let text = fs::read(&times).map_err(|e| LogError::io(&times, "read", e))?;
        let stamps_ns = parse_times(&text).map_err(|e| e.in_file(&times))?;
        if stamps_ns.len() == trajectory.len() {
            notes.push(format!("stamps from {}", times.display()));
            let poses = stamps_ns.into_iter().zip(trajectory.poses().iter().copied()).collect();
            return Trajectory::stamped(poses)
                .map_err(|source| LogError::Trajectory { path: times.clone(), source });
        }
        notes.push(format!(
            "{} has {} lines for {} poses and is not used: the n-th pose belongs to the n-th scan",
            times.display(),
            stamps_ns.len(),
            trajectory.len()
        ));
    } else {
        notes.push("no stamps: the n-th pose belongs to the n-th scan".into());
    }
    Ok(TrajectoryRepairs { trajectory, out_of_order: 0, repeated: 0 })
}

/// The columns of a line as `N` finite numbers.
fn numbers<const N: usize>(place: Place, columns: &[&str], what: &str) -> Result<[f64; N], ParseError> {
    if columns.len() != N {
        let problem = format!("{} columns, expected {N} ({what}): is the line cut?", columns.len());
        return Err(ParseError::new(place, problem));
    }
    values(place, columns)
}

/// The first `N` columns as finite numbers. There must be as many.
fn values<const N: usize>(place: Place, columns: &[&str]) -> Result<[f64; N], ParseError> {
    let mut values = [0.0; N];
    for (value, &column) in values.iter_mut().zip(columns) {
        *value = match column.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            Ok(_) => return Err(ParseError::new(place, format!("`{}` is not finite", shorten(column)))),
            Err(_) => return Err(ParseError::new(place, format!("`{}` is not a number", shorten(column)))),
        };
    }
    Ok(values)
}

/// A pose of a place and a quaternion `(x, y, z, w)` that is nearly of unit length.
fn pose_of(
    place: Place,
    position_m: [f64; 3],
    [qx, qy, qz, qw]: [f64; 4],
) -> Result<Isometry3<f64>, ParseError> {
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let norm = quaternion.norm();
    if norm < 1e-6 {
        let problem = format!("the quaternion ({qx}, {qy}, {qz}, {qw}) is zero: no rotation");
        return Err(ParseError::new(place, problem));
    }
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        let problem = format!("the quaternion ({qx}, {qy}, {qz}, {qw}) has the norm {norm:.4}, not 1");
        return Err(ParseError::new(place, problem));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(Isometry3::from_parts(Translation3::from(position_m), rotation))
}

fn check_place(place: Place, position_m: [f64; 3]) -> Result<(), ParseError> {
    let [x, y, z] = position_m;
    match position_m.into_iter().find(|c| c.abs() > MAX_PLACE_M) {
        None => Ok(()),
        Some(far) => {
            Err(ParseError::new(place, format!("the position ({x}, {y}, {z}) is {far:e} m from the origin")))
        }
    }
}
