//! Trajectories with a stamp and a matrix in each line.

use dmp_sensor::{Trajectory, TrajectoryRepairs};

use super::described::{has_matrix, is_frame, numbers_of};
use super::error::TrajectoryParseError;
use super::kitti;
use crate::file::{lines, pose_of_rows, to_ns};
use crate::{ParseError, PlaceInFile, TimeUnit};

/// Whether a line has a stamp and the 12 numbers of a 3 × 4 matrix or the 16 of a 4 × 4 one, by their values.
pub(super) fn is_line(columns: &[&str]) -> bool {
    let numbers = numbers_of(columns);
    [13, 17].contains(&columns.len())
        && numbers.is_some_and(|numbers| has_matrix(&numbers, 1) && !is_frame(numbers[0]))
}

/// The stamp of a line as written, and its rows.
pub(super) fn row<'a>(place: PlaceInFile, columns: &[&'a str]) -> Result<(&'a str, [f64; 12]), ParseError> {
    let (stamp, rest) =
        columns.split_first().ok_or_else(|| ParseError::new(place, "the line is empty".to_owned()))?;
    Ok((stamp, kitti::row(place, rest)?))
}

/// Parses lines of a stamp in this unit and the numbers of `[R t]`, or of the 4 × 4 matrix, row by row, `world_from_body`.
pub(super) fn parse_matrices_in(
    bytes: &[u8],
    unit: TimeUnit,
) -> Result<TrajectoryRepairs, TrajectoryParseError> {
    let mut poses = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let (stamp, rows) = row(place, &columns)?;
        let stamp_ns = to_ns(stamp, unit).map_err(|problem| ParseError::new(place, problem))?;
        poses.push((stamp_ns, pose_of_rows(place, rows)?));
    }
    Ok(Trajectory::stamped(poses)?)
}
