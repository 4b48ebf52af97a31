//! The least squares of one step.

use dmp_sensor::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};
use nalgebra::{Quaternion, Vector6};

/// What each unknown gets beside what the surfaces say, in parts of the mean of the diagonal: what no surface holds stays.
const DAMPING: f64 = 1e-6;

/// Sums of weighted residuals and of their derivatives: `JᵀWJ` and `JᵀWr`, for a motion (rotation vector, then translation)
/// put before the pose so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalEquations {
    pub(crate) information: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
    pub(crate) weight: f64,
}

/// A place that was moved, and the plane that it should lie in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Signed distance from the plane, metres.
    pub(crate) distance_m: f64,
    /// Of the distance by a small rotation and translation.
    pub(crate) jacobian: Vector6<f64>,
}

impl Residual {
    /// Of `place_m` to the plane through `mean_m`: the derivative by a rotation vector ω is `(p × n)·ω`, by a translation `n`.
    pub(crate) fn new(place_m: &Vector3<f64>, mean_m: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let turn = place_m.cross(normal);
        let jacobian = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
        Self { distance_m: normal.dot(&(place_m - mean_m)), jacobian }
    }

    /// Geman and McClure's weight at a distance of `scale_m`: 1 at none.
    pub(crate) fn weight(&self, scale_m: f64) -> f64 {
        let part = self.distance_m / scale_m;
        let share = 1.0 / (1.0 + part * part);
        share * share
    }
}

impl NormalEquations {
    pub(crate) fn zero() -> Self {
        Self { information: Matrix6::zeros(), gradient: Vector6::zeros(), weight: 0.0 }
    }

    pub(crate) fn add(&mut self, residual: &Residual, weight: f64) {
        let weighted = residual.jacobian * weight;
        for column in 0..6 {
            for row in 0..=column {
                self.information[(row, column)] += weighted[row] * residual.jacobian[column];
            }
        }
        self.gradient += weighted * residual.distance_m;
        self.weight += weight;
    }

    /// The whole of `JᵀWJ`, damped.
    pub(crate) fn damped(&self) -> Matrix6<f64> {
        let damping = DAMPING * self.information.trace() / 6.0;
        Matrix6::from_fn(|row, column| {
            self.information[(row.min(column), row.max(column))] + if row == column { damping } else { 0.0 }
        })
    }

    /// The motion that the step calls for; `None` where nothing does.
    pub(crate) fn step(&self) -> Option<Vector6<f64>> {
        Some(self.damped().cholesky()?.solve(&-self.gradient))
    }
}

/// A small motion. The rotation is that of the quaternion (1, ω/2): exact to the third order of ω, without a sine.
pub(crate) fn motion(step: &Vector6<f64>) -> Isometry3<f64> {
    let half = [step[0], step[1], step[2]].map(|turn| turn / 2.0);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(1.0, half[0], half[1], half[2]));
    Isometry3::from_parts(Translation3::new(step[3], step[4], step[5]), rotation)
}
