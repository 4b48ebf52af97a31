//! Trajectories as Redwood has them, read and written.

use dmp_sensor::Trajectory;

use super::error::TrajectoryParseError;
use crate::file::columns::numbers;
use crate::file::{lines, pose_of_rows, shorten};
use crate::{ParseError, PlaceInFile};
use std::io::{self, Write};

/// Whether a line begins a block: three whole numbers.
pub(super) fn is_head(columns: &[&str]) -> bool {
    columns.len() == 3 && columns.iter().all(|column| column.parse::<i64>().is_ok())
}

/// Parses Redwood's `.log`: for each pose a line of three whole numbers, which are not used, and the four rows of a
/// 4 x 4 matrix, `world_from_body`, without stamps. Rounded rotations are made exact.
///
/// # Errors
/// In the first line that has another number of columns, something that is no finite number, a matrix that is no
/// rotation or a position 10⁸ m away, a last row other than 0 0 0 1; where a block is cut; and where there is no pose.
pub fn parse_redwood_log(bytes: &[u8]) -> Result<Trajectory, TrajectoryParseError> {
    let mut poses = Vec::new();
    for_each_matrix(bytes, |place, rows| {
        poses.push(pose_of_rows(place, rows)?);
        Ok(())
    })?;
    Ok(Trajectory::unstamped(poses)?)
}

/// Hands over the first three rows of every matrix, and where the first of them is.
pub(super) fn for_each_matrix(
    bytes: &[u8],
    mut take: impl FnMut(PlaceInFile, [f64; 12]) -> Result<(), ParseError>,
) -> Result<(), ParseError> {
    let mut lines = lines(bytes);
    while let Some(head) = lines.next() {
        let (head_place, columns) = head?;
        if !is_head(&columns) {
            let found = shorten(&columns.join(" "));
            let problem = format!("`{found}` begins no pose: three whole numbers must, and four rows follow");
            return Err(ParseError::new(head_place, problem));
        }
        let (mut matrix, mut place) = ([[0.0; 4]; 4], head_place);
        for (k, row) in matrix.iter_mut().enumerate() {
            let Some(line) = lines.next() else {
                let problem = format!("the pose that begins here has {k} of 4 rows: is the file cut?");
                return Err(ParseError::new(head_place, problem));
            };
            let (row_place, columns) = line?;
            *row = numbers::<4>(row_place, &columns, "a row of a 4 x 4 matrix")?;
            if k == 0 {
                place = row_place;
            }
            #[expect(clippy::float_cmp, reason = "what is written is exact")]
            if k == 3 && *row != [0.0, 0.0, 0.0, 1.0] {
                let problem = format!("the last row is {row:?}, not 0 0 0 1");
                return Err(ParseError::new(row_place, problem));
            }
        }
        let [[a, b, c, tx], [d, e, f, ty], [g, h, i, tz], _] = matrix;
        take(place, [a, b, c, tx, d, e, f, ty, g, h, i, tz])?;
    }
    Ok(())
}

/// Writes Redwood's `.log`. Stamps have no place in it.
///
/// # Errors
/// As `out` does.
pub fn write_redwood_log(out: &mut impl Write, trajectory: &Trajectory) -> io::Result<()> {
    for (number, pose) in trajectory.poses().iter().enumerate() {
        writeln!(out, "{number} {number} {}", number + 1)?;
        let rows = pose.to_homogeneous();
        for row in 0..4 {
            let numbers: Vec<String> = (0..4).map(|column| rows[(row, column)].to_string()).collect();
            writeln!(out, "{}", numbers.join(" "))?;
        }
    }
    Ok(())
}
