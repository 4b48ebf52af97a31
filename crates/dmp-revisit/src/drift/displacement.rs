//! The displacement between the second visit of a run and its own surfaces.

use dmp_sensor::{Isometry3, Matrix3, Vector3};

use crate::align::Alignment;
use serde::{Deserialize, Serialize};

/// A direction with a larger uncertainty counts as unknown, metres of a drive.
const KNOWN_M: f64 = 0.1;

/// The second visit's position in the run, minus its position by the surfaces, relative to the first visit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Displacement {
    /// Along the path of the first visit, metres; null where no surface constrains it.
    pub along_m: Option<f64>,
    /// To the left of the path.
    pub sideways_m: Option<f64>,
    /// Upwards.
    pub up_m: Option<f64>,
    /// Standard deviation of each of these three, metres.
    pub sigma_m: [f64; 3],
    /// Length of the three together, metres; null if one is unknown.
    pub distance_m: Option<f64>,
    /// Rotation about the path, about the left axis and about up, degrees.
    pub roll_deg: f64,
    /// See [`Self::roll_deg`].
    pub pitch_deg: f64,
    /// See [`Self::roll_deg`].
    pub yaw_deg: f64,
    /// Angle of the whole rotation, degrees.
    pub angle_deg: f64,
    /// The displacement in the run's own world, metres: 0 in an unknown direction.
    pub in_world_m: [f64; 3],
    /// The part of each of [`Self::sigma_m`] that allows for distortion within a visit, metres.
    pub allowance_m: f64,
    /// The share of a visit's surfaces that the other visit sees, the smaller of both.
    pub overlap: f64,
    /// Share of the surfaces that constrain the weakest direction; a third if all are constrained equally.
    pub held: f64,
}

/// The directions that a displacement is reported in, in the frame of the first place: along, left, up.
#[derive(Debug, Clone, Copy)]
pub struct Axes(Matrix3<f64>);

impl Axes {
    /// From a heading and the up direction, in the frame of the place; without motion, along is the sensor's
    /// own x axis.
    pub fn new(heading: Vector3<f64>, up: Vector3<f64>, x: Vector3<f64>, metre_m: f64) -> Self {
        let level = |v: Vector3<f64>| v - up * v.dot(&up);
        let along = [heading, x, up.cross(&Vector3::x()), up.cross(&Vector3::y())]
            .into_iter()
            .map(level)
            .find(|v| v.norm() > 0.1 * metre_m)
            .unwrap_or_else(Vector3::x)
            .normalize();
        Self(Matrix3::from_rows(&[along.transpose(), up.cross(&along).transpose(), up.transpose()]))
    }
}

impl Displacement {
    /// From the run's relative pose and the measured one, both in the frame of the first place;
    /// `world_from_place` is the run's own.
    pub fn new(
        claimed: &Isometry3<f64>,
        measured: &Alignment,
        axes: &Axes,
        world_from_place: &Isometry3<f64>,
        metre_m: f64,
    ) -> Self {
        let motion = &measured.target_from_source;
        let off = axes.0 * (claimed.translation.vector - motion.translation.vector);
        // A rotation applied before the motion also moves its translation.
        let place = motion.translation.vector;
        let by_turn = -place.cross_matrix();
        let part =
            |row: usize, column: usize| measured.covariance.fixed_view::<3, 3>(row, column).into_owned();
        let covariance = by_turn * part(0, 0) * by_turn.transpose()
            + by_turn * part(0, 3)
            + part(3, 0) * by_turn.transpose()
            + part(3, 3);
        let covariance = axes.0 * covariance * axes.0.transpose();
        let sigma_m = [0, 1, 2].map(|k| covariance[(k, k)].max(0.0).sqrt());
        let known = [0, 1, 2].map(|k| (sigma_m[k] <= KNOWN_M * metre_m).then_some(off[k]));
        let known_off = Vector3::from(known.map(|off| off.unwrap_or(0.0)));
        let turn = axes.0 * rotation_vector(&(claimed.rotation * motion.rotation.inverse()));
        let [roll_deg, pitch_deg, yaw_deg] = [turn.x, turn.y, turn.z].map(f64::to_degrees);
        Self {
            along_m: known[0],
            sideways_m: known[1],
            up_m: known[2],
            sigma_m,
            distance_m: known.iter().all(Option::is_some).then(|| off.norm()),
            roll_deg,
            pitch_deg,
            yaw_deg,
            angle_deg: turn.norm().to_degrees(),
            in_world_m: (world_from_place.rotation * (axes.0.transpose() * known_off)).into(),
            allowance_m: measured.allowance_m,
            overlap: measured.overlap[0].min(measured.overlap[1]),
            held: measured.held,
        }
    }

    /// Variance of the squared distance, m⁴, for three independent normal parts: for a part o with deviation
    /// σ, `4 o² σ² + 2 σ⁴`. `None` if one is unknown.
    pub fn variance_of_square_m4(&self) -> Option<f64> {
        let of = |off_m: Option<f64>, sigma_m: f64| {
            let (off_m2, sigma_m2) = (off_m? * off_m?, sigma_m * sigma_m);
            Some(4.0 * off_m2 * sigma_m2 + 2.0 * sigma_m2 * sigma_m2)
        };
        let [along, sideways, up] = self.sigma_m;
        Some(of(self.along_m, along)? + of(self.sideways_m, sideways)? + of(self.up_m, up)?)
    }

    /// The expected increase of each part's square by measurement noise, m²: the scatter of the surfaces.
    pub fn noise_m2(&self) -> [f64; 3] {
        self.sigma_m.map(|sigma_m| sigma_m * sigma_m - self.allowance_m * self.allowance_m)
    }
}

/// Angle times axis.
fn rotation_vector(rotation: &dmp_sensor::UnitQuaternion<f64>) -> Vector3<f64> {
    let quaternion = rotation.quaternion();
    let (imaginary, real) = (quaternion.imag(), quaternion.w);
    let sine = imaginary.norm();
    let angle = 2.0 * libm::atan2(sine, real.abs());
    if sine > 0.0 { imaginary * (real.signum() * angle / sine) } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::{Matrix6, UnitQuaternion};

    fn diagonal(values: [f64; 6]) -> Matrix6<f64> {
        Matrix6::from_fn(|row, column| if row == column { values[row] } else { 0.0 })
    }

    fn measured(motion: Isometry3<f64>, covariance: &Matrix6<f64>) -> Alignment {
        let least_held = Vector3::x();
        let (allowance_m, overlap) = (0.01, [0.7, 0.6]);
        Alignment {
            target_from_source: motion,
            covariance: *covariance,
            overlap,
            allowance_m,
            held: 0.1,
            least_held,
            unheld: None,
        }
    }

    /// A second visit 10 m ahead, reported as 0.3 m too far ahead, 0.1 m too far left and 0.2 m too low, and 1° turned to the left.
    #[test]
    fn a_displacement_is_reported_along_the_path() {
        let turned = |deg: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), deg.to_radians());
        // The path leads north, the frame of the place is turned by 30°.
        let place_from_way = turned(30.0);
        let at = |v: [f64; 3], deg: f64| {
            Isometry3::from_parts((place_from_way * Vector3::from(v)).into(), turned(deg))
        };
        let world_from_place = Isometry3::from_parts([5.0, 6.0, 7.0].into(), turned(60.0));
        let axes = Axes::new(place_from_way * Vector3::x() * 24.0, Vector3::z(), Vector3::x(), 1.0);
        let covariance = diagonal([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 4e-4]);
        let found = measured(at([10.0, 0.0, 0.0], 5.0), &covariance);
        let off = Displacement::new(&at([10.3, 0.1, -0.2], 6.0), &found, &axes, &world_from_place, 1.0);
        let near = |value: Option<f64>, expected: f64| value.is_some_and(|v| (v - expected).abs() < 1e-9);
        assert!(near(off.along_m, 0.3) && near(off.sideways_m, 0.1) && near(off.up_m, -0.2), "{off:?}");
        assert!(near(Some(off.yaw_deg), 1.0) && near(Some(off.roll_deg), 0.0), "{off:?}");
        assert!(near(Some(off.in_world_m[1]), 0.3) && near(Some(off.in_world_m[0]), -0.1), "{off:?}");
        // Sideways and up also vary by the rotations, 10 m away by 1 mrad.
        let sigma_m = [1e-4_f64, 1e-4 + 1e-4, 4e-4 + 1e-4].map(f64::sqrt);
        assert!((0..3).all(|k| (off.sigma_m[k] - sigma_m[k]).abs() < 1e-9), "{off:?}");
        assert!(near(off.distance_m, 0.14_f64.sqrt()) && near(Some(off.noise_m2().iter().sum()), 5e-4));
    }

    #[test]
    fn an_unconstrained_direction_is_not_reported() {
        let covariance = diagonal([0.0, 0.0, 0.0, 2500.0, 1e-4, 1e-4]);
        let found = measured(Isometry3::identity(), &covariance);
        let claimed = Isometry3::translation(3.0, 0.2, 0.0);
        let axes = Axes::new(Vector3::x(), Vector3::z(), Vector3::x(), 1.0);
        let off = Displacement::new(&claimed, &found, &axes, &Isometry3::identity(), 1.0);
        assert_eq!((off.along_m, off.sideways_m, off.distance_m), (None, Some(0.2), None));
        assert_eq!(off.in_world_m, [0.0, 0.2, 0.0]);
    }
}
