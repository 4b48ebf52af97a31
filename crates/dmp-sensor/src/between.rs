//! Poses between poses.

use nalgebra::{ComplexField, Isometry3, Quaternion, UnitQuaternion, Vector4};

/// The pose at a share of the path from `a` to `b`, 0 to 1: the place goes straight and evenly, the rotation turns evenly the
/// shorter way (slerp, Shoemake 1985); by half a turn, either.
pub fn pose_between(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    Between::new(a, b).at(share)
}

/// The motion from one pose to another: what all poses between them have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Between {
    a: Isometry3<f64>,
    b: Isometry3<f64>,
    turn: Turn,
}

#[derive(Debug, Clone, Copy)]
enum Turn {
    /// One rotation throughout: there is no turn, or one of half a circle.
    None(UnitQuaternion<f64>),
    /// From the rotation of `a` to `to`, by half the angle `half`, whose sine is `sine`.
    By { to: Vector4<f64>, half: f64, sine: f64 },
}

impl Between {
    pub(crate) fn new(a: &Isometry3<f64>, b: &Isometry3<f64>) -> Self {
        let (from, to) = (a.rotation.coords, b.rotation.coords);
        let to = if from.dot(&to) < 0.0 { -to } else { to };
        let cosine = from.dot(&to);
        let turn = if cosine >= 1.0 {
            Turn::None(UnitQuaternion::new_normalize(Quaternion::from(from)))
        } else {
            let half = ComplexField::acos(cosine);
            let sine = (1.0 - cosine * cosine).sqrt();
            if sine <= 1e-12 { Turn::None(a.rotation) } else { Turn::By { to, half, sine } }
        };
        Self { a: *a, b: *b, turn }
    }

    /// The pose at a share of the path.
    pub(crate) fn at(&self, share: f64) -> Isometry3<f64> {
        let rotation = match self.turn {
            Turn::None(rotation) => rotation,
            Turn::By { to, half, sine } => {
                let from_part = ComplexField::sin((1.0 - share) * half) / sine;
                let to_part = ComplexField::sin(share * half) / sine;
                let turned = self.a.rotation.coords * from_part + to * to_part;
                // Both its parts are divided by √(1 − cos²), of which little is right where the turn is small: of a turn of 2e-7
                // two digits, which would make everything a hundredth longer or shorter.
                UnitQuaternion::new_normalize(Quaternion::from(turned))
            }
        };
        let place = self.a.translation.vector.lerp(&self.b.translation.vector, share);
        Isometry3::from_parts(place.into(), rotation)
    }
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

    /// What this is written out from, of nalgebra.
    fn by_library(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
        let rotation = a
            .rotation
            .try_slerp(&b.rotation, share, 1e-12)
            .map_or(a.rotation, |turned| UnitQuaternion::new_normalize(turned.into_inner()));
        Isometry3::from_parts(a.translation.vector.lerp(&b.translation.vector, share).into(), rotation)
    }

    #[test]
    fn every_bit_is_that_of_the_library() {
        let bits = |pose: Isometry3<f64>| {
            let (q, t) = (pose.rotation.coords, pose.translation.vector);
            [q.x, q.y, q.z, q.w, t.x, t.y, t.z].map(f64::to_bits)
        };
        let mut turns: Vec<f64> = (0..=400).map(|k| 6.5 * 10.0_f64.powf(-f64::from(k) / 20.0)).collect();
        turns.extend([0.0, -0.0, std::f64::consts::PI, -2.0]);
        for radians in turns {
            let (a, b) = (turned(0.0), turned(radians));
            let opposite =
                Isometry3::from_parts(b.translation, UnitQuaternion::new_unchecked(-b.rotation.into_inner()));
            for b in [b, opposite] {
                for k in 0..=16 {
                    let share = f64::from(k) / 16.0;
                    let (pose, expected) = (pose_between(&a, &b, share), by_library(&a, &b, share));
                    assert_eq!(bits(pose), bits(expected), "{radians} {share}");
                }
            }
        }
    }
}
