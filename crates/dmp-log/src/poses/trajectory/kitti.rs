//! Trajectories as KITTI has them, read and written.

use dmp_sensor::Trajectory;

use super::error::TrajectoryParseError;
use crate::file::columns::numbers;
use crate::file::{lines, pose_of_rows};
use crate::{ParseError, PlaceInFile};
use std::io::{self, Write};

const ROW: &str = "a 3 x 4 matrix";

/// Parses the KITTI format: lines with the twelve numbers of `[R t]`, or the sixteen of the 4 × 4 matrix, row by row,
/// `world_from_body`, without stamps. Rounded rotations are made exact.
///
/// # Errors
/// In the first line that has another number of columns, something that is no finite number, a matrix
/// that is no rotation or a position 10⁸ m away; and where there is no pose.
pub fn parse_kitti(bytes: &[u8]) -> Result<Trajectory, TrajectoryParseError> {
    let mut poses = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        poses.push(pose_of_rows(place, row(place, &columns)?)?);
    }
    Ok(Trajectory::unstamped(poses)?)
}

/// The rows of `[R t]`; a fourth row may follow, 0 0 0 1.
pub(super) fn row(place: PlaceInFile, columns: &[&str]) -> Result<[f64; 12], ParseError> {
    let Some((rows, last)) = columns.split_at_checked(12).filter(|_| columns.len() == 16) else {
        return numbers::<12>(place, columns, ROW);
    };
    let last = numbers::<4>(place, last, "the last row of a 4 x 4 matrix")?;
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(ParseError::new(place, format!("the last row is {last:?}, not 0 0 0 1")));
    }
    numbers::<12>(place, rows, ROW)
}

/// Writes the KITTI format. Stamps have no place in it.
///
/// # Errors
/// As `out` does.
pub fn write_kitti(out: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    for pose in trajectory.poses() {
        let rows = pose.to_homogeneous();
        let numbers: Vec<String> =
            (0..3).flat_map(|row| (0..4).map(move |column| rows[(row, column)].to_string())).collect();
        writeln!(out, "{}", numbers.join(" "))?;
    }
    Ok(())
}
