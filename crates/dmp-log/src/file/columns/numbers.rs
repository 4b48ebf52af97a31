//! Numbers of a line, and the poses they make.

use dmp_sensor::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, nearest_rotation};

use crate::file::decimal::shorten;
use crate::{ParseError, PlaceInFile};

/// Farthest a pose may be from the world's origin, metres: ten times the size of the Earth.
const MAX_PLACE_M: f64 = 1e8;
/// How far the norm of a quaternion may be from 1: text is rounded, but not by this much.
const NORM_TOLERANCE: f64 = 0.1;

/// The columns of a line as `N` finite numbers.
pub(crate) fn numbers<const N: usize>(
    place: PlaceInFile,
    columns: &[&str],
    what: &str,
) -> Result<[f64; N], ParseError> {
    if columns.len() != N {
        let problem = format!("{} columns, expected {N} ({what}): is the line cut?", columns.len());
        return Err(ParseError::new(place, problem));
    }
    values(place, columns)
}

/// The first `N` columns as finite numbers. There must be as many.
pub(crate) fn values<const N: usize>(place: PlaceInFile, columns: &[&str]) -> Result<[f64; N], ParseError> {
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

/// A pose of a place, metres, and a quaternion `(x, y, z, w)` that is nearly of unit length.
pub(crate) fn pose_of(
    place: PlaceInFile,
    position_m: [f64; 3],
    [qx, qy, qz, qw]: [f64; 4],
) -> Result<Isometry3<f64>, ParseError> {
    if position_m.iter().chain(&[qx, qy, qz, qw]).any(|number| !number.is_finite()) {
        let problem =
            format!("the pose {position_m:?} m, quaternion ({qx}, {qy}, {qz}, {qw}), is not finite");
        return Err(ParseError::new(place, problem));
    }
    check_place(place, position_m)?;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    // In pairs, so that a trajectory turned by half a turn about an axis, which only swaps and negates these, has the
    // same norms to the last bit.
    let norm = ((qx * qx + qy * qy) + (qz * qz + qw * qw)).sqrt();
    if norm < 1e-6 {
        let problem = format!("the quaternion ({qx}, {qy}, {qz}, {qw}) is zero: no rotation");
        return Err(ParseError::new(place, problem));
    }
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        let problem = format!("the quaternion ({qx}, {qy}, {qz}, {qw}) has the norm {norm:.4}, not 1");
        return Err(ParseError::new(place, problem));
    }
    let rotation = UnitQuaternion::new_unchecked(quaternion / norm);
    Ok(Isometry3::from_parts(Translation3::from(position_m), rotation))
}

/// A pose of the twelve numbers of `[R t]`, row by row, where R is a rotation but for rounding.
pub(crate) fn pose_of_rows(place: PlaceInFile, rows: [f64; 12]) -> Result<Isometry3<f64>, ParseError> {
    let [a, b, c, tx, d, e, f, ty, g, h, i, tz] = rows;
    check_place(place, [tx, ty, tz])?;
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let rotation = nearest_rotation(matrix).map_err(|problem| ParseError::new(place, problem.to_string()))?;
    Ok(Isometry3::from_parts(Translation3::new(tx, ty, tz), rotation))
}

fn check_place(place: PlaceInFile, position_m: [f64; 3]) -> Result<(), ParseError> {
    let [x, y, z] = position_m;
    match position_m.into_iter().find(|c| c.abs() > MAX_PLACE_M) {
        None => Ok(()),
        Some(far) => {
            Err(ParseError::new(place, format!("the position ({x}, {y}, {z}) is {far:e} m from the origin")))
        }
    }
}
