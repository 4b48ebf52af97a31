//! A steady motion.

use nalgebra::{ComplexField, Isometry3, Translation3, UnitQuaternion, Vector3};

/// Below this angle, rad, the series of its functions are exact.
const SMALL_RAD: f64 = 1e-3;

/// The motion of a body that turns and moves steadily, both in its own frame, for a while: the exponential map of SE(3) at
/// `(turn_rad, shift_m)`, a rotation vector and what the body would move without turning.
pub fn moved_by(turn_rad: &Vector3<f64>, shift_m: &Vector3<f64>) -> Isometry3<f64> {
    let square = turn_rad.norm_squared();
    let angle = square.sqrt();
    // (1 − cos a) / a² and (a − sin a) / a³.
    let (first, second) = if angle < SMALL_RAD {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let half = ComplexField::sin(angle / 2.0) / angle;
        (2.0 * half * half, (angle - ComplexField::sin(angle)) / (angle * square))
    };
    let aside = turn_rad.cross(shift_m);
    let shift_m = shift_m + aside * first + turn_rad.cross(&aside) * second;
    Isometry3::from_parts(Translation3::from(shift_m), UnitQuaternion::from_scaled_axis(*turn_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_motion_is_that_of_many_small_ones(
            turn in prop::array::uniform3(-1.5..1.5_f64), shift in prop::array::uniform3(-5.0..5.0_f64), power in 0..5_i32,
        ) {
            let size = (0..power).fold(1.0, |size, _| size / 10.0);
            let (turn, shift) = (Vector3::from(turn) * size, Vector3::from(shift));
            // Squared twenty times: a millionth of it is a turn and a shift side by side.
            let part = 1.0 / f64::from(1 << 20);
            let mut slow = Isometry3::new(shift * part, turn * part);
            slow.translation.vector += turn.cross(&shift) * (part * part / 2.0);
            for _ in 0..20 {
                slow *= slow;
            }
            let found = moved_by(&turn, &shift);
            prop_assert!((found.translation.vector - slow.translation.vector).norm() < 1e-8 * shift.norm().max(1.0));
            prop_assert!(found.rotation.angle_to(&slow.rotation) < 1e-8);
        }
    }
}
