//! Poses between poses.

use nalgebra::{Isometry3, UnitQuaternion};

/// The pose a share of the way from `a` to `b`, 0 to 1: the place goes straight and evenly, the rotation turns evenly the
/// shorter way (slerp, Shoemake 1985); by half a turn, either.
pub fn pose_between(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let rotation = a.rotation.try_slerp(&b.rotation, share, 1e-12).map_or(a.rotation, |turned| {
        // Both its parts are divided by √(1 − cos²), of which little is right where the turn is small: of a turn of 2e-7 two
        // digits, which would make everything a hundredth longer or shorter.
        UnitQuaternion::new_normalize(turned.into_inner())
    });
    Isometry3::from_parts(a.translation.vector.lerp(&b.translation.vector, share).into(), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn turned(radians: f64) -> Isometry3<f64> {
        let whole = UnitQuaternion::from_euler_angles(0.3, -0.2, 2.0);
        Isometry3::from_parts(
            Vector3::new(1e6, -2e6, 3.0).into(),
            whole * UnitQuaternion::from_euler_angles(0.0, 0.0, radians),
        )
    }

    /// A vehicle that stands still turns by next to nothing, and a wall 100 m off must stay where it is.
    #[test]
    fn a_turn_however_small_keeps_lengths() {
        for exponent in 0..=170 {
            let radians = 3.0 * 10.0_f64.powf(-f64::from(exponent) / 10.0);
            let (a, b) = (turned(0.0), turned(radians));
            for share in [0.0, 0.1, 0.5, 0.9, 1.0] {
                let pose = pose_between(&a, &b, share);
                let norm = pose.rotation.into_inner().norm();
                assert!((norm - 1.0).abs() < 1e-15, "{radians} {share}: {norm}");
                let wall = Vector3::new(60.0, -80.0, 0.0);
                let apart_m = (pose.rotation * wall - turned(share * radians).rotation * wall).norm();
                assert!(apart_m < 5e-6, "{radians} {share}: {apart_m} m");
            }
        }
    }
}
