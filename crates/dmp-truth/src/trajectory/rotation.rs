//! Rotations as 3 × 3 matrices that were read from text: nearly orthogonal, not exactly.

use nalgebra::{Matrix3, Vector3};

/// The product `a b`, each element a chain of fused multiply–adds. This is how the usual BLAS rounds, and
/// a threshold on accumulated angles may hang on the last bit.
pub(crate) fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| a[(i, 2)].mul_add(b[(2, j)], a[(i, 1)].mul_add(b[(1, j)], a[(i, 0)] * b[(0, j)])))
}

/// Whether evo would call the matrix a rotation: its determinant and the diagonal of `R ᵀR` within
/// 1.1 · 10⁻⁵ of 1, the rest of `R ᵀR` within 10⁻⁶ of 0.
fn is_rotation(matrix: &Matrix3<f64>) -> bool {
    let gram = matrix.tr_mul(matrix);
    let near = |value: f64, target: f64| (value - target).abs() <= 1e-6 + 1e-5 * target;
    near(matrix.determinant(), 1.0)
        && (0..9).all(|k| near(gram[(k / 3, k % 3)], if k / 3 == k % 3 { 1.0 } else { 0.0 }))
}

/// The angle of a rotation, radians in [0, π]: the norm of its rotation vector. `None` where the matrix
/// is no rotation.
pub(crate) fn angle_rad(matrix: &Matrix3<f64>) -> Option<f64> {
    is_rotation(matrix).then(|| angle_of_quaternion_rad(&to_quaternion(matrix)))
}

/// The angle of a unit quaternion `(x, y, z, w)`, by way of its rotation vector, whose rounding it shares.
pub(crate) fn angle_of_quaternion_rad(q: &[f64; 4]) -> f64 {
    let [x, y, z, w] = if q[3] < 0.0 { q.map(|c| -c) } else { *q };
    let sine = (x * x + y * y + z * z).sqrt();
    let angle = 2.0 * libm::atan2(sine, w);
    let square = angle * angle;
    let scale = if angle <= 1e-3 {
        2.0 + square / 12.0 + 7.0 * square * square / 2880.0
    } else {
        angle / libm::sin(angle / 2.0)
    };
    Vector3::new(scale * x, scale * y, scale * z).norm()
}

/// The unit quaternion `(x, y, z, w)` of a matrix that is nearly a rotation; of the nearest rotation
/// where its columns are not orthogonal to 10⁻¹² (Markley, *Unit quaternion from rotation matrix*, 2008).
pub(crate) fn to_quaternion(matrix: &Matrix3<f64>) -> [f64; 4] {
    let gram = matrix * matrix.transpose();
    let orthogonal = (0..9).all(|k| {
        let target = if k / 3 == k % 3 { 1.0 } else { 0.0 };
        (gram[(k / 3, k % 3)] - target).abs() <= 1e-12 + 1e-5 * target
    });
    let m = if orthogonal { *matrix } else { nearest_rotation(matrix) };
    let trace = m[(0, 0)] + m[(1, 1)] + m[(2, 2)];
    let mut choice = 0;
    for k in 1..3 {
        if m[(k, k)] > m[(choice, choice)] {
            choice = k;
        }
    }
    let mut q = [0.0; 4];
    if trace > m[(choice, choice)] {
        q = [m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)], 1.0 + trace];
    } else {
        let (i, j, k) = (choice, (choice + 1) % 3, (choice + 2) % 3);
        q[i] = 1.0 - trace + 2.0 * m[(i, i)];
        q[j] = m[(j, i)] + m[(i, j)];
        q[k] = m[(k, i)] + m[(i, k)];
        q[3] = m[(k, j)] - m[(j, k)];
    }
    let norm = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    q.map(|c| c / norm)
}

/// The orthogonal factor of the polar decomposition, by Newton's iteration (Higham 1986).
fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let mut rotation = *matrix;
    for _ in 0..12 {
        let Some(inverse) = rotation.try_inverse() else { break };
        let next = (rotation + inverse.transpose()) * 0.5;
        let moved = (next - rotation).amax();
        rotation = next;
        if moved < 1e-15 {
            break;
        }
    }
    rotation
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(axis: [f64; 3], angle_rad: f64) -> Matrix3<f64> {
        let axis = nalgebra::Unit::new_normalize(Vector3::from(axis));
        nalgebra::Rotation3::from_axis_angle(&axis, angle_rad).into_inner()
    }

    #[test]
    fn angles_come_back_from_tiny_to_half_a_turn() {
        for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 2.0, -3.0], [-2.0, 1.0, 0.1]] {
            for angle in [0.0, 1e-6, 5e-4, 1e-3, 0.3, 1.6, 3.0, std::f64::consts::PI - 1e-7] {
                let found = angle_rad(&turn(axis, angle)).unwrap();
                assert!((found - angle).abs() < 1e-12, "{axis:?} {angle} {found}");
                let [x, y, z, w] = to_quaternion(&turn(axis, angle));
                let again = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
                assert!((again.to_rotation_matrix().into_inner() - turn(axis, angle)).amax() < 1e-14);
            }
        }
    }

    #[test]
    fn rounded_matrices_have_the_angle_of_the_nearest_rotation() {
        let exact = turn([1.0, 2.0, 3.0], 0.5);
        let rounded = exact.map(|c| (c * 1e6).round() / 1e6);
        assert_ne!(exact, rounded);
        assert!((angle_rad(&rounded).unwrap() - 0.5).abs() < 1e-6);
        let svd = rounded.svd(true, true);
        let oracle = svd.u.unwrap() * svd.v_t.unwrap();
        assert!((nearest_rotation(&rounded) - oracle).amax() < 1e-12);
    }

    #[test]
    fn what_is_no_rotation_has_no_angle() {
        assert_eq!(angle_rad(&(turn([0.0, 0.0, 1.0], 1.0) * 1.001)), None);
        assert_eq!(angle_rad(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0))), None);
        assert_eq!(angle_rad(&Matrix3::zeros()), None);
    }

    #[test]
    fn the_fused_product_is_the_product() {
        let (a, b) = (turn([1.0, 2.0, 3.0], 0.7), turn([-1.0, 0.2, 0.3], 2.7));
        assert!((product(&a, &b) - a * b).amax() < 1e-15);
    }
}
