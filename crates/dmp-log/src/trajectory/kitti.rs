use super::{TrajectoryParseError, check_place, numbers};
use crate::text::lines;
use crate::{ParseError, Place};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion};
use nalgebra::{Matrix3, Rotation3};
use std::io::{self, Write};

/// How far R ᵀR may be from 1, in any element, for R to be a rotation that was rounded.
const ROTATION_TOLERANCE: f64 = 0.05;

/// Parses the KITTI format: lines with the twelve numbers of `[R t]`, row by row, `world_from_body`,
/// without stamps. Rounded rotations are made exact.
///
/// # Errors
/// In the first line that has another number of columns, something that is no finite number, a matrix
/// that is no rotation or a position 10⁸ m away; and where there is no pose.
pub fn parse_kitti(bytes: &[u8]) -> Result<Trajectory, TrajectoryParseError> {
    let mut poses = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        poses.push(parse_line(place, &columns)?);
    }
    Ok(Trajectory::unstamped(poses)?)
}

fn parse_line(place: Place, columns: &[&str]) -> Result<Isometry3<f64>, ParseError> {
    let [a, b, c, tx, d, e, f, ty, g, h, i, tz] = numbers::<12>(place, columns, "a 3 x 4 matrix")?;
    check_place(place, [tx, ty, tz])?;
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let rotation = nearest_rotation(matrix).map_err(|problem| ParseError::new(place, problem))?;
    Ok(Isometry3::from_parts(Translation3::new(tx, ty, tz), rotation))
}

/// The rotation nearest to a matrix that is one but for rounding: the orthogonal factor of its polar
/// decomposition, by Newton's iteration (Higham 1986), which doubles the right digits each time.
fn nearest_rotation(matrix: Matrix3<f64>) -> Result<UnitQuaternion<f64>, String> {
    let off = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    let determinant = matrix.determinant();
    if off.is_nan() || off > ROTATION_TOLERANCE {
        return Err(format!("the 3 x 3 part is no rotation: its columns are off by {off:.3}"));
    }
    if determinant < 0.0 {
        return Err(format!("the 3 x 3 part is a reflection: its determinant is {determinant:.3}"));
    }
    let mut rotation = matrix;
    for _ in 0..8 {
        let Some(inverse) = rotation.try_inverse() else { break };
        rotation = (rotation + inverse.transpose()) * 0.5;
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
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
