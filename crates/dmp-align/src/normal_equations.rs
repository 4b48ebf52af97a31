//! The least squares of one step.

use dmp_sensor::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};
use nalgebra::{Quaternion, Vector6};

/// What each unknown gets beside what the surfaces say, in parts of the mean of the diagonal: what no surface holds stays.
const DAMPING: f64 = 1e-6;

/// Sums of weighted residuals and of their derivatives: `JᵀWJ` and `JᵀWr`, for a motion (rotation vector, then translation)
/// put before the pose so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalEquations {
    /// The upper half, row by row.
    information: [f64; 21],
    gradient: [f64; 6],
    pub(crate) weight: f64,
    /// Of the places by their weights.
    places_m: [f64; 3],
}

/// A place that was moved, and the plane that it should lie in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    pub(crate) place_m: Vector3<f64>,
    /// Of the plane, unit length.
    pub(crate) normal: Vector3<f64>,
    /// Signed distance from the plane, metres.
    pub(crate) distance_m: f64,
    /// Of the distance by a small rotation and translation.
    pub(crate) jacobian: Vector6<f64>,
}

impl Residual {
    /// Of `place_m` to the plane through `mean_m`: the derivative by a rotation vector ω is `(p × n)·ω`, by a translation `n`.
    pub(crate) fn new(place_m: Vector3<f64>, mean_m: &Vector3<f64>, normal: Vector3<f64>) -> Self {
        let turn = place_m.cross(&normal);
        let jacobian = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
        Self { place_m, normal, distance_m: normal.dot(&(place_m - mean_m)), jacobian }
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
        Self { information: [0.0; 21], gradient: [0.0; 6], weight: 0.0, places_m: [0.0; 3] }
    }

    #[inline]
    pub(crate) fn add(&mut self, residual: &Residual, weight: f64) {
        let jacobian: &[f64; 6] = &residual.jacobian.into();
        let mut sums = self.information.iter_mut();
        for row in 0..6 {
            let weighted = jacobian[row] * weight;
            // The iterator ends with the last row.
            for (column, sum) in jacobian[row..].iter().zip(&mut sums) {
                *sum += weighted * column;
            }
            self.gradient[row] += weighted * residual.distance_m;
        }
        for (sum_m, place_m) in self.places_m.iter_mut().zip(&residual.place_m) {
            *sum_m += weight * place_m;
        }
        self.weight += weight;
    }

    /// The whole of `JᵀWJ`.
    pub(crate) fn information(&self) -> Matrix6<f64> {
        let mut whole = Matrix6::zeros();
        let mut sums = self.information.iter();
        for row in 0..6 {
            for (column, &sum) in (row..6).zip(&mut sums) {
                (whole[(row, column)], whole[(column, row)]) = (sum, sum);
            }
        }
        whole
    }

    /// Of the translation alone: xx, xy, xz, yy, yz, zz.
    pub(crate) fn of_translation(&self) -> [f64; 6] {
        std::array::from_fn(|k| self.information[15 + k])
    }

    /// The whole of `JᵀWJ`, damped.
    pub(crate) fn damped(&self) -> Matrix6<f64> {
        let whole = self.information();
        whole + Matrix6::from_diagonal_element(DAMPING * whole.trace() / 6.0)
    }

    pub(crate) fn gradient(&self) -> Vector6<f64> {
        self.gradient.into()
    }

    /// The middle of the surfaces, metres.
    pub(crate) fn middle_m(&self) -> Vector3<f64> {
        Vector3::from(self.places_m) / self.weight.max(f64::MIN_POSITIVE)
    }
}

/// A small motion. The rotation is that of the quaternion (1, ω/2): exact to the third order of ω, without a sine.
pub(crate) fn motion(step: &Vector6<f64>) -> Isometry3<f64> {
    let half = [step[0], step[1], step[2]].map(|turn| turn / 2.0);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(1.0, half[0], half[1], half[2]));
    Isometry3::from_parts(Translation3::new(step[3], step[4], step[5]), rotation)
}
