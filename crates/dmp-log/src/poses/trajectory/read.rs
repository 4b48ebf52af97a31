//! Reading a trajectory in a file of any format.

use dmp_lengths::thousands;
use dmp_sensor::{Trajectory, TrajectoryRepairs};

use super::error::TrajectoryParseError;
use super::euroc::parse_euroc_in;
use super::format::{TrajectoryFormat, find_format, no_poses};
use super::g2o::{GraphVertices, parse_g2o};
use super::kitti::parse_kitti;
use super::matrices::{self, parse_matrices_in};
use super::npy::{self, parse_npy};
use super::redwood::{self, parse_redwood_log};
use super::stamps;
use super::tum::parse_tum_in;
use crate::file::{
    MAX_LINE_BYTES, ReadCount, fingerprint, is_cut, open_sized, start_of, text, unit_of_large_numbers,
    unit_of_lines,
};
use crate::logs::ROS1_MAGIC;
use crate::poses::trajectory::named::parse_csv_in;
use crate::{LogError, TimeUnit};
use std::io::{BufRead as _, Read as _};
use std::path::Path;

/// Largest trajectory that is read. A day at 200 poses a second has 2 GiB; more is another file.
const MAX_BYTES: u64 = 2 << 30;

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

/// Reads a trajectory, `world_from_body` in metres, in the format that is found by looking: arrays by their first bytes,
/// text by its first line with data, or by the names of columns before it. Poses in a format without stamps (KITTI, `.npy`, Redwood) have those of a `times.txt`
/// beside the file where that has as many lines.
///
/// # Errors
/// When the file cannot be read, has no poses, is in no such format, or breaks it in some line.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("run.txt");
/// std::fs::write(&path, "# stamp tx ty tz qx qy qz qw\n1.0 0 0 0 0 0 0 1\n1.5 2 0 0 0 0 0 1\n")?;
/// let trajectory = dmp_log::read_trajectory(&path)?.trajectory;
/// assert_eq!(trajectory.stamps_ns(), Some(&[1_000_000_000, 1_500_000_000][..]));
/// assert_eq!(trajectory.poses()[1].translation.x, 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_trajectory(path: &Path) -> Result<TrajectoryFile, LogError> {
    read_trajectory_as(path, None, None)
}

/// As [`read_trajectory`], in this format and with stamps in this unit where they are given. Without a unit stamps are in
/// that of the format, seconds for TUM and nanoseconds for EuRoC, or of the column's name; those that no second of our days
/// has are taken for what they must be, and that is noted.
///
/// # Errors
/// As [`read_trajectory`], when a unit is given for a format without stamps, and when none is given for stamps that can be no
/// seconds and do not count from 1970.
pub fn read_trajectory_as(
    path: &Path,
    format: Option<TrajectoryFormat>,
    unit: Option<TimeUnit>,
) -> Result<TrajectoryFile, LogError> {
    let bytes = read_bytes(path)?;
    let fingerprint =
        fingerprint::of_file(path, &ReadCount::default()).map_err(|e| LogError::io(path, "read", e))?;
    let mut notes = Vec::new();
    let format = match (format, unit) {
        (Some(format), _) => format,
        (None, unit) => find_format(path, &bytes)?.with_stamps_in(unit),
    };
    let in_file = |error: TrajectoryParseError| match error {
        TrajectoryParseError::Poses(dmp_sensor::TrajectoryError::Empty) => no_poses(&bytes).in_file(path),
        error => error.in_file(path),
    };
    let repairs = match format {
        TrajectoryFormat::Tum => {
            let unit = unit.map_or_else(|| unit_of_lines(&bytes, None, &mut notes), Ok);
            parse_tum_in(&bytes, unit.map_err(|e| e.in_file(path))?).map_err(in_file)?
        }
        TrajectoryFormat::Matrices => {
            let unit = unit.map_or_else(|| unit_of_lines(&bytes, None, &mut notes), Ok);
            parse_matrices_in(&bytes, unit.map_err(|e| e.in_file(path))?).map_err(in_file)?
        }
        TrajectoryFormat::Euroc => {
            let unit = unit.unwrap_or_else(|| unit_of_large_numbers(&bytes, &mut notes));
            parse_euroc_in(&bytes, unit).map_err(in_file)?
        }
        TrajectoryFormat::Csv => parse_csv_in(&bytes, unit, &mut notes).map_err(in_file)?,
        _ if unit.is_some() => {
            let problem = format!("a unit of time was given, but a {} file has no stamps", format.name());
            return Err(LogError::Option { path: path.to_owned(), problem });
        }
        TrajectoryFormat::Numbered => matrices::read_numbered(path, &bytes, &mut notes)?,
        TrajectoryFormat::Kitti | TrajectoryFormat::Npy | TrajectoryFormat::RedwoodLog => {
            let parsed = match format {
                TrajectoryFormat::Kitti => parse_kitti(&bytes),
                TrajectoryFormat::Npy => parse_npy(&bytes),
                _ => parse_redwood_log(&bytes),
            };
            stamps::from_times_beside(path, parsed.map_err(in_file)?, &mut notes)?
        }
        TrajectoryFormat::G2o => of_graph(parse_g2o(&bytes).map_err(in_file)?, &mut notes),
    };
    if format != TrajectoryFormat::Npy && is_cut(&bytes) {
        notes.push("the last line has no end: it may be cut".into());
    }
    let TrajectoryRepairs { trajectory, out_of_order, repeated } = repairs;
    Ok(TrajectoryFile { format, trajectory, out_of_order, repeated, notes, fingerprint })
}

/// How many poses a file has at most, and its bytes, by its lines: it is read in pieces and not held.
///
/// # Errors
/// When the file cannot be read.
pub fn poses_at_most(path: &Path) -> Result<(u64, u64), LogError> {
    /// Of a matrix of float32.
    const LEAST_ARRAY_BYTES: u64 = 12 * 4;
    let start = start_of(path)?;
    let (mut file, bytes) = open_sized(path)?;
    if start.starts_with(npy::MAGIC) {
        return Ok((bytes / LEAST_ARRAY_BYTES, bytes));
    }
    let failed = |error| LogError::io(path, "read", error);
    let (mut lines, mut is_redwood, mut line) = (0, None, Vec::new());
    while file.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line).map_err(failed)? > 0 {
        let text = line.trim_ascii();
        // Edges of a graph are no poses.
        if !text.is_empty() && !text.starts_with(b"#") && !text.starts_with(b"EDGE") {
            lines += 1;
            is_redwood.get_or_insert_with(|| {
                let columns: Vec<&str> =
                    std::str::from_utf8(text).unwrap_or("").split_ascii_whitespace().collect();
                redwood::is_head(&columns)
            });
        }
        line.clear();
    }
    Ok((if is_redwood == Some(true) { lines / 5 } else { lines }, bytes))
}

fn of_graph(graph: GraphVertices, notes: &mut Vec<String>) -> TrajectoryRepairs {
    let GraphVertices { trajectory, ids, out_of_order, repeated, other_vertices } = graph;
    if let (Some(first), Some(last)) = (ids.first(), ids.last()) {
        let whole = i64::try_from(ids.len()).is_ok_and(|count| last.checked_sub(*first) == Some(count - 1));
        let gaps = if whole { "" } else { ", not all of them" };
        notes.push(format!(
            "no stamps: the n-th pose in the order of the ids ({first} to {last}{gaps}) belongs to the n-th scan"
        ));
    }
    if other_vertices > 0 {
        notes.push(format!("{} vertices of other types skipped", thousands(other_vertices)));
    }
    TrajectoryRepairs { trajectory, out_of_order, repeated }
}

/// The bytes of a file that is not too large to be a trajectory.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, LogError> {
    let start = start_of(path)?;
    let is_text = ![npy::MAGIC, ROS1_MAGIC].iter().any(|magic| start.starts_with(magic));
    let read = if is_text { text::read_text } else { text::read_bytes };
    read(path, "trajectory", MAX_BYTES)
}
