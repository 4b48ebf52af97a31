//! The least squares of one step.

use dmp_sensor::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3, by_motion};
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
    /// Of `place_m` to the plane through `mean_m`.
    pub(crate) fn new(place_m: Vector3<f64>, mean_m: &Vector3<f64>, normal: Vector3<f64>) -> Self {
        let jacobian = by_motion(&place_m, &normal);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn derivatives_are_those_of_small_motions(
            place_m in prop::array::uniform3(-50.0..50.0_f64), mean_m in prop::array::uniform3(-50.0..50.0_f64),
            normal in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let normal = Vector3::from(normal);
            prop_assume!(normal.norm() > 0.1);
            let (mean_m, normal) = (Vector3::from(mean_m), normal.normalize());
            let residual = Residual::new(place_m.into(), &mean_m, normal);
            for k in 0..6 {
                let moved_m = |by: f64| {
                    let mut step = Vector6::zeros();
                    step[k] = by;
                    let place_m = motion(&step) * nalgebra::Point3::from(place_m);
                    Residual::new(place_m.coords, &mean_m, normal).distance_m
                };
                let small = 1e-5;
                let expected = (moved_m(small) - moved_m(-small)) / (2.0 * small);
                prop_assert!((residual.jacobian[k] - expected).abs() < 1e-6, "{k}: {expected}");
            }
        }

        #[test]
        fn sums_are_those_of_matrices(
            places_m in prop::collection::vec(prop::array::uniform3(-5.0..5.0_f64), 1..20),
        ) {
            let normal = Vector3::new(0.6, 0.0, 0.8);
            let mut equations = NormalEquations::zero();
            let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
            for place_m in places_m {
                let residual = Residual::new(place_m.into(), &Vector3::zeros(), normal);
                let weight = residual.weight(1.0);
                equations.add(&residual, weight);
                information += residual.jacobian * residual.jacobian.transpose() * weight;
                gradient += residual.jacobian * (weight * residual.distance_m);
            }
            prop_assert!((equations.information() - information).norm() < 1e-9);
            prop_assert!((equations.gradient() - gradient).norm() < 1e-9);
            let translation = [(3, 3), (3, 4), (3, 5), (4, 4), (4, 5), (5, 5)].map(|place| information[place]);
            prop_assert!(equations.of_translation().iter().zip(translation).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
