//! Least-squares alignment of one set of places to another: Umeyama, *Least-squares estimation of
//! transformation parameters between two point patterns*, IEEE PAMI 1991, cited by its equations.

use super::sum::sum;
use super::{CompareError, Pose, PosePath};
use nalgebra::{Matrix3, Vector3};

/// A similarity: scale first, then the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Rotation and translation, `reference_from_estimate`.
    pub pose: Pose,
    /// Scale factor; 1 where it was not asked for.
    pub scale: f64,
}

impl Similarity {
    /// As a 4 × 4 matrix, row by row.
    pub fn rows(&self) -> [[f64; 4]; 4] {
        let (r, t) = (&self.pose.rotation, &self.pose.position_m);
        std::array::from_fn(|i| {
            if i == 3 {
                [0.0, 0.0, 0.0, 1.0]
            } else {
                [self.scale * r[(i, 0)], self.scale * r[(i, 1)], self.scale * r[(i, 2)], t[i]]
            }
        })
    }
}

/// The similarity (rigid where not `with_scale`) that brings the estimate's places nearest to the
/// reference's, pose by pose.
///
/// # Errors
/// When they differ in number, are none, or lie on a line or a point, so that the rotation is not
/// determined.
pub fn umeyama(
    reference: &PosePath,
    estimate: &PosePath,
    with_scale: bool,
) -> Result<Similarity, CompareError> {
    let (x, y) = (estimate.poses(), reference.poses());
    if x.len() != y.len() {
        return Err(CompareError::Lengths { reference: y.len(), estimate: x.len() });
    }
    if x.is_empty() {
        return Err(CompareError::NothingToAlign);
    }
    let share = 1.0 / x.len() as f64;
    let (mean_x, mean_y) = (mean(x), mean(y)); // eq. 34, 35
    let from_mean = |pose: &Pose| (pose.position_m - mean_x).norm_squared();
    let variance_x = share * sum(x.iter().map(from_mean)); // eq. 36
    // eq. 38
    let covariance = Matrix3::from_fn(|i, j| {
        let product = |(x, y): (&Pose, &Pose)| (y.position_m[i] - mean_y[i]) * (x.position_m[j] - mean_x[j]);
        share * sum(x.iter().zip(y).map(product))
    });
    let Svd { u, d, v } = svd(&covariance);
    // evo's bound is absolute; below the relative one a value is rounding, and so would the rotation be.
    if d[1] <= f64::EPSILON * (3.0 * d[0]).max(1.0) {
        return Err(CompareError::DegenerateAlignment);
    }
    // eq. 43: no reflection.
    let sign = if u.determinant() * v.determinant() < 0.0 { -1.0 } else { 1.0 };
    let s = Vector3::new(1.0, 1.0, sign);
    let rotation = u * Matrix3::from_diagonal(&s) * v.transpose(); // eq. 40
    let scale = if with_scale { d.dot(&s) / variance_x } else { 1.0 }; // eq. 42
    let position_m = mean_y - rotation * mean_x * scale; // eq. 41
    Ok(Similarity { pose: Pose { rotation, position_m }, scale })
}

fn mean(poses: &[Pose]) -> Vector3<f64> {
    let component = |k: usize| sum(poses.iter().map(|pose| pose.position_m[k])) / poses.len() as f64;
    Vector3::new(component(0), component(1), component(2))
}

/// `u diag(d) vᵀ`, `d` descending and not negative.
struct Svd {
    u: Matrix3<f64>,
    d: Vector3<f64>,
    v: Matrix3<f64>,
}

/// One-sided Jacobi (Hestenes 1958): exact also for the small values of long thin paths, which a
/// decomposition of `AᵀA` would lose.
fn svd(matrix: &Matrix3<f64>) -> Svd {
    let mut a = *matrix;
    let mut v = Matrix3::<f64>::identity();
    for _sweep in 0..60 {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (alpha, beta) = (a.column(p).norm_squared(), a.column(q).norm_squared());
            let gamma = a.column(p).dot(&a.column(q));
            if gamma == 0.0 || gamma.abs() <= f64::EPSILON * (alpha * beta).sqrt() {
                continue;
            }
            rotated = true;
            let zeta = (beta - alpha) / (2.0 * gamma);
            let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sine = cosine * tangent;
            for m in [&mut a, &mut v] {
                let (left, right) = (m.column(p).into_owned(), m.column(q).into_owned());
                m.set_column(p, &(left * cosine - right * sine));
                m.set_column(q, &(left * sine + right * cosine));
            }
        }
        if !rotated {
            break;
        }
    }
    let norms: [f64; 3] = std::array::from_fn(|k| a.column(k).norm());
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let d = Vector3::from_fn(|k, _| norms[order[k]]);
    let v = Matrix3::from_fn(|i, k| v[(i, order[k])]);
    let unit = |k: usize| a.column(order[k]) / if d[k] > 0.0 { d[k] } else { 1.0 };
    let (first, second) = (unit(0), unit(1));
    // The third is what the first two leave, whichever way its column points: that may be all rounding.
    let third = first.cross(&second);
    let third = if third.dot(&a.column(order[2])) < 0.0 { -third } else { third };
    Svd { u: Matrix3::from_columns(&[first, second, third]), d, v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Rotation3};

    fn path(points: &[[f64; 3]]) -> PosePath {
        let pose = |&p: &[f64; 3]| Pose { position_m: p.into(), ..Pose::identity() };
        PosePath::new(points.iter().map(pose).collect(), None).unwrap()
    }

    const POINTS: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.2, 0.0],
        [2.0, 0.1, 0.5],
        [2.5, 1.7, 0.4],
        [2.0, 3.0, -0.3],
        [-1.0, 2.0, 0.1],
    ];

    fn moved(similarity: &Similarity, points: &[[f64; 3]]) -> PosePath {
        let mut path = path(points);
        path.scale(similarity.scale);
        path.transform(&similarity.pose);
        path
    }

    fn known(scale: f64) -> Similarity {
        let rotation = Rotation3::from_euler_angles(0.3, -1.2, 2.5).into_inner();
        Similarity { pose: Pose { rotation, position_m: Vector3::new(10.0, -20.0, 5.0) }, scale }
    }

    fn assert_near(a: &Similarity, b: &Similarity, tolerance: f64) {
        assert!((a.pose.rotation - b.pose.rotation).amax() < tolerance, "{a:?} {b:?}");
        assert!((a.pose.position_m - b.pose.position_m).amax() < tolerance, "{a:?} {b:?}");
        assert!((a.scale - b.scale).abs() < tolerance, "{a:?} {b:?}");
    }

    #[test]
    fn a_known_similarity_comes_back() {
        for (scale, with_scale) in [(1.0, false), (1.0, true), (2.5, true), (1e-3, true)] {
            let truth = known(scale);
            let found = umeyama(&moved(&truth, &POINTS), &path(&POINTS), with_scale).unwrap();
            // At a small scale, few digits of the places are left beside the translation.
            assert_near(&found, &truth, 1e-13 / scale.min(1.0));
        }
        // In a plane the third singular value is zero; the rotation is determined all the same.
        let flat = POINTS.map(|[x, y, _]| [x, y, 0.0]);
        let found = umeyama(&moved(&known(1.0), &flat), &path(&flat), false).unwrap();
        assert_near(&found, &known(1.0), 1e-13);
    }

    #[test]
    fn a_mirror_image_is_answered_with_a_rotation() {
        // Umeyama's own example (section IV): a reflection would fit better.
        let x = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let y = [[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let found = umeyama(&path(&y), &path(&x), false).unwrap();
        assert!((found.pose.rotation.determinant() - 1.0).abs() < 1e-14);
        let mirrored = POINTS.map(|[x, y, z]| [x, y, -z]);
        let found = umeyama(&path(&mirrored), &path(&POINTS), false).unwrap();
        assert!((found.pose.rotation.determinant() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn lines_and_points_have_no_rotation() {
        let line: Vec<[f64; 3]> = (0..5).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        // Oblique and far from the origin, so that rounding leaves something beside the line.
        let oblique: Vec<[f64; 3]> =
            (0..50).map(f64::from).map(|k| [5e5 + 7.3 * k, 0.7 * k, -3.1 * k]).collect();
        for places in [line, oblique] {
            let refused = umeyama(&path(&places), &path(&places), false);
            assert_eq!(refused, Err(CompareError::DegenerateAlignment));
        }
        let refused = umeyama(&path(&POINTS), &path(&POINTS[..3]), false);
        assert_eq!(refused, Err(CompareError::Lengths { reference: 6, estimate: 3 }));
    }

    #[test]
    fn decompositions_are_as_good_as_the_librarys() {
        for (k, spread) in [1.0, 1e-3, 1e-6, 1e-9].into_iter().enumerate() {
            let left = Rotation3::from_euler_angles(0.1 + k as f64, 0.7, -0.4).into_inner();
            let right = Rotation3::from_euler_angles(-0.9, 0.2 * k as f64, 1.4).into_inner();
            let truth = Vector3::new(1e4, 10.0, spread);
            let matrix = left * Matrix3::from_diagonal(&truth) * right;
            let Svd { u, d, v } = svd(&matrix);
            assert!((u * Matrix3::from_diagonal(&d) * v.transpose() - matrix).amax() < 1e-11);
            assert!((u.tr_mul(&u) - Matrix3::identity()).amax() < 1e-14);
            assert!((v.tr_mul(&v) - Matrix3::identity()).amax() < 1e-14);
            // A matrix of any size goes through Golub and Kahan's algorithm.
            let library = DMatrix::from_column_slice(3, 3, matrix.as_slice()).singular_values();
            assert!((0..3).all(|i| (d[i] - library[i]).abs() < 1e-11), "{d} {library}");
        }
    }
}
