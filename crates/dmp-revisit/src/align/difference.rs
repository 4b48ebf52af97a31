//! What lies between two motions that are nearly the same.

use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};
use nalgebra::Vector6;

use crate::align::normal_equations::motion;

/// The middle of two motions that are nearly the same, and half of what lies between them.
pub(crate) struct Difference {
    pub(crate) target_from_source: Isometry3<f64>,
    /// At the middle of the surfaces, metres.
    pub(crate) shift: Vector3<f64>,
    /// Rotation vector, radians.
    pub(crate) turn: Vector3<f64>,
}

impl Difference {
    pub(crate) fn of(a: &Isometry3<f64>, b: &Isometry3<f64>, middle_m: &Vector3<f64>) -> Self {
        let between = b * a.inverse();
        let quaternion = between.rotation.quaternion();
        let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
        // Of half a small angle, the sine is the angle.
        let turn = quaternion.imag() * sign;
        let half_turned = motion(&Vector6::new(turn.x, turn.y, turn.z, 0.0, 0.0, 0.0)).rotation;
        let shift = (between.rotation * middle_m + between.translation.vector - middle_m) / 2.0;
        // About the middle of the surfaces.
        let half = Isometry3::from_parts(
            Translation3::from(middle_m + shift - half_turned * middle_m),
            UnitQuaternion::new_normalize(half_turned.into_inner()),
        );
        Self { target_from_source: half * a, shift, turn }
    }
}
