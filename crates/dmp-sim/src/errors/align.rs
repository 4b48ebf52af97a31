//! How far two trajectories are apart after the best alignment.

use dmp_sensor::{Isometry3, Trajectory, Vector3};
use nalgebra::Matrix3;

/// Absolute trajectory error: RMSE of the places after the best rigid alignment, metres.
///
/// Pose k of one run is compared with pose k of the other, as far as both go. The alignment is that of
/// Umeyama (1991) without scale.
pub fn ate_rmse_m(estimate: &Trajectory, truth: &Trajectory) -> f64 {
    aligned_rmse_m(estimate.poses(), truth.poses())
}

pub(super) fn aligned_rmse_m(estimate: &[Isometry3<f64>], truth: &[Isometry3<f64>]) -> f64 {
    let pairs = || estimate.iter().zip(truth).map(|(e, t)| (e.translation.vector, t.translation.vector));
    let count = estimate.len().min(truth.len()) as f64;
    let (sum_e, sum_t) = pairs().fold((Vector3::zeros(), Vector3::zeros()), |s, p| (s.0 + p.0, s.1 + p.1));
    let (mean_e, mean_t) = (sum_e / count, sum_t / count);
    let covariance: Matrix3<f64> = pairs().map(|(e, t)| (t - mean_t) * (e - mean_e).transpose()).sum();
    let rotation = rotation_of(covariance);
    let square: f64 = pairs().map(|(e, t)| (t - mean_t - rotation * (e - mean_e)).norm_squared()).sum();
    libm::sqrt(square / count)
}

/// The rotation R that maximises the trace of Rᵀ · `covariance` (Umeyama 1991, eq. 40 and 43).
fn rotation_of(covariance: Matrix3<f64>) -> Matrix3<f64> {
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let mirrored = u.determinant() * v_t.determinant() < 0.0;
    // Singular values are sorted: the last axis is the one that may be turned about.
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, if mirrored { -1.0 } else { 1.0 }));
    u * sign * v_t
}

#[cfg(test)]
mod tests {
    use super::super::tests::circle;
    use super::*;

    #[test]
    fn a_rigid_motion_is_no_error() {
        let truth = circle(100);
        let motion = Isometry3::new(Vector3::new(5.0, -3.0, 1.0), Vector3::new(0.3, -0.2, 2.0));
        let moved: Vec<_> = truth.poses().iter().map(|pose| motion * pose).collect();
        assert!(aligned_rmse_m(&moved, truth.poses()) < 1e-9);
    }
}
