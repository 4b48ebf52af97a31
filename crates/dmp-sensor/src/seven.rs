//! Transforms as seven numbers and as matrices, as in files.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};

/// How far R ᵀR may be from 1, in any element, for R to be a rotation that was rounded.
const ROTATION_TOLERANCE: f64 = 0.05;

/// What makes a matrix unusable as a rotation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RotationError {
    /// Its columns are not at right angles, or not of unit length.
    #[error("the 3 x 3 part is no rotation: its columns are off by {off:.3}")]
    NotOrthonormal {
        /// The largest element of `RᵀR − 1`.
        off: f64,
    },
    /// It mirrors.
    #[error("the 3 x 3 part is a reflection: its determinant is {determinant:.3}")]
    Reflection {
        /// About −1.
        determinant: f64,
    },
}

/// The rotation nearest to a matrix that is one but for rounding: the orthogonal factor of its polar
/// decomposition, by Newton's iteration (Higham 1986), which doubles the right digits each time.
///
/// # Errors
/// When it is no rotation, even roughly.
pub fn nearest_rotation(matrix: Matrix3<f64>) -> Result<UnitQuaternion<f64>, RotationError> {
    let off = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    let determinant = matrix.determinant();
    if off.is_nan() || off > ROTATION_TOLERANCE {
        return Err(RotationError::NotOrthonormal { off });
    }
    if determinant < 0.0 {
        return Err(RotationError::Reflection { determinant });
    }
    let mut rotation = matrix;
    for _ in 0..8 {
        let Some(inverse) = rotation.try_inverse() else { break };
        rotation = (rotation + inverse.transpose()) * 0.5;
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
}

/// A transform as x, y, z (metres), qx, qy, qz, qw.
pub fn seven(transform: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (transform.translation.vector, transform.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

/// The transform of [`seven`] numbers.
pub fn transform_of([x, y, z, i, j, k, w]: &[f64; 7]) -> Isometry3<f64> {
    let turn = UnitQuaternion::new_normalize(Quaternion::new(*w, *i, *j, *k));
    Isometry3::from_parts(Translation3::new(*x, *y, *z), turn)
}
