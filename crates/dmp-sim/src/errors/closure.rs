//! A correct loop closure of the whole path.

use dmp_sensor::{Isometry3, Trajectory, UnitQuaternion, Vector3};
use nalgebra::{Matrix3, Matrix6, Vector6};

use super::poses::{Poses, Travel, with_poses};
use crate::error::SimError;

/// The error of odometry in a metre of travel, as a pose graph has it: metres and radians. Their ratio
/// decides how a correction is shared between places and directions.
const SIGMA_M: f64 = 0.01;
const SIGMA_RAD: f64 = 0.0005;
/// The end is met to this, metres and radians; two or three rounds suffice.
const MET: f64 = 1e-10;
const ROUNDS: usize = 50;

/// The estimate after a closure of its whole path: its first and last pose become those of `truth`, as if the
/// last place had been recognised, and the correction is spread over all steps between.
///
/// The steps of the estimate are the edges of a pose graph, each with a covariance that grows with its
/// length, and the closure is a constraint. The least-squares corrections of the steps (twists δₖ in the
/// frame before each) are δ = Σ Adᵀ λ with λ = (Σ Ad Σ Adᵀ)⁻¹ · the error at the end; Gauss and Newton's
/// rounds take care of what is not linear. What drifted as odometry drifts comes back to the truth nearly
/// everywhere; what did not stays wrong between the ends.
///
/// # Errors
/// When the estimate does not move.
pub fn close_loop(estimate: &Trajectory, truth: &Trajectory) -> Result<Trajectory, SimError> {
    let travel = Travel::of(estimate.poses(), "a loop closure")?;
    let (Some(first), Some(last)) = (truth.poses().first(), truth.poses().last()) else {
        return Ok(estimate.clone());
    };
    let poses = estimate.poses();
    let steps: Vec<_> = poses.windows(2).map(|pair| pair[0].inv_mul(&pair[1])).collect();
    let variances: Vec<Vector6<f64>> = travel
        .0
        .windows(2)
        .map(|pair| {
            let length_m = pair[1] - pair[0];
            let (place, turn) = (SIGMA_M * SIGMA_M * length_m, SIGMA_RAD * SIGMA_RAD * length_m);
            Vector6::new(place, place, place, turn, turn, turn)
        })
        .collect();
    let mut twists = vec![Vector6::zeros(); steps.len()];
    let mut closed = chain(*first, &steps, &twists);
    for _ in 0..ROUNDS {
        let error = twist_to(&closed[closed.len() - 1], last);
        if error.amax() < MET {
            break;
        }
        // About the end, where the error is known: a twist of step k moves the end by its adjoint.
        let end = closed[closed.len() - 1].translation.vector;
        let moves: Vec<_> = closed.iter().take(steps.len()).map(|pose| adjoint(pose, &end)).collect();
        let normal: Matrix6<f64> =
            moves.iter().zip(&variances).map(|(m, v)| m * Matrix6::from_diagonal(v) * m.transpose()).sum();
        let Some(inverse) = normal.try_inverse() else { break };
        let pull = inverse * error;
        for ((twist, variance), moved) in twists.iter_mut().zip(&variances).zip(&moves) {
            *twist += variance.component_mul(&(moved.transpose() * pull));
        }
        closed = chain(*first, &steps, &twists);
    }
    Ok(with_poses(estimate, closed))
}

/// The path from `first` along the steps, each after its correction.
fn chain(first: Isometry3<f64>, steps: &[Isometry3<f64>], twists: &[Vector6<f64>]) -> Poses {
    let mut poses = vec![first];
    let mut at = first;
    for (step, twist) in steps.iter().zip(twists) {
        let (shift, turn) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
        at *= Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn)) * step;
        at.rotation.renormalize();
        poses.push(at);
    }
    poses
}

/// Shift and turn, both in the world, from one pose to another.
fn twist_to(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// How a small twist in the frame of `pose` shifts and turns a body at `end`, in the world.
fn adjoint(pose: &Isometry3<f64>, end: &Vector3<f64>) -> Matrix6<f64> {
    let rotation: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
    let lever = end - pose.translation.vector;
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    // A turn ω shifts the end by ω × lever = −lever × ω.
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-lever.cross_matrix() * rotation));
    matrix
}

#[cfg(test)]
mod tests {
    use super::super::tests::circle;
    use super::super::{SlamErrors, ate_rmse_m};
    use super::*;

    fn drifted(truth: &Trajectory, ate_m: f64, seed: u64) -> Trajectory {
        SlamErrors { seed, drift_ate_m: Some(ate_m), ..SlamErrors::default() }.apply(truth).unwrap()
    }

    #[test]
    fn both_ends_are_true_and_the_path_between_is_better() {
        let truth = circle(800);
        for (seed, ate_m) in [(1, 1.0), (2, 3.0), (5, 3.0)] {
            let wrong = drifted(&truth, ate_m, seed);
            let closed = close_loop(&wrong, &truth).unwrap();
            assert_eq!(closed.stamps_ns(), truth.stamps_ns());
            for end in [0, 799] {
                let error = closed.poses()[end].inv_mul(&truth.poses()[end]);
                assert!(error.translation.vector.norm() < 1e-8, "{error}");
                assert!(error.rotation.angle() < 1e-8, "{error}");
            }
            let after_m = ate_rmse_m(&closed, &truth);
            assert!((0.005..0.8 * ate_m).contains(&after_m), "{ate_m} m became {after_m} m");
        }
    }

    #[test]
    fn a_correction_is_smooth_and_no_smaller_one_meets_the_end() {
        let truth = circle(300);
        let wrong = drifted(&truth, 0.5, 3);
        let closed = close_loop(&wrong, &truth).unwrap();
        // The weighted squares of the corrections of all steps.
        let cost = |run: &[Isometry3<f64>]| -> f64 {
            let steps = run.windows(2).zip(wrong.poses().windows(2));
            steps
                .map(|(a, b)| {
                    let twist = a[0].inv_mul(&a[1]) * b[0].inv_mul(&b[1]).inverse();
                    let length_m = (b[1].translation.vector - b[0].translation.vector).norm();
                    let (shift, turn) = (twist.translation.vector, twist.rotation.scaled_axis());
                    (shift.norm_squared() / SIGMA_M.powi(2) + turn.norm_squared() / SIGMA_RAD.powi(2))
                        / length_m
                })
                .sum()
        };
        let best = cost(closed.poses());
        // Other paths that keep both ends cost more.
        for (at, shift) in [(50, [0.01, 0.0, 0.0]), (150, [0.0, 0.02, 0.0]), (250, [0.0, 0.0, -0.01])] {
            let mut other = closed.poses().to_vec();
            for (k, pose) in other.iter_mut().enumerate() {
                let bump = (1.0 - (k as f64 - f64::from(at)).abs() / 50.0).max(0.0);
                pose.translation.vector += Vector3::from(shift) * bump;
            }
            assert!(cost(&other) > best, "{} {best}", cost(&other));
        }
    }
}
