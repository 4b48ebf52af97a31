//! In which direction a body travels.

use crate::Trajectory;
use nalgebra::{Isometry3, Vector3};

/// Shortest mean step that is a movement, metres.
const MIN_STEP_M: f64 = 1e-3;
/// How much the directions of the steps must agree: length of the median of unit vectors.
const MIN_AGREEMENT: f64 = 0.5;

impl Trajectory {
    /// In which direction the body travels, seen from itself: the median over the steps from pose to pose,
    /// component by component, as a unit vector. Near +z for the axes of a camera that looks ahead, near
    /// +x for those of a vehicle.
    ///
    /// Steps shorter than the mean are left out, so that standing has no say. `None` where the body does
    /// not move or has no direction of its own.
    pub fn travel_in_body(&self) -> Option<Vector3<f64>> {
        let step = |pair: &[Isometry3<f64>]| match pair {
            [a, b] => a.rotation.inverse() * (b.translation.vector - a.translation.vector),
            _ => Vector3::zeros(),
        };
        let steps: Vec<Vector3<f64>> = self.poses().windows(2).map(step).collect();
        let mean_m = steps.iter().map(Vector3::norm).sum::<f64>() / steps.len().max(1) as f64;
        if mean_m < MIN_STEP_M {
            return None;
        }
        // A hair less than the mean: equal steps differ from their mean by rounding.
        let long = steps.iter().filter(|step| step.norm() >= 0.999 * mean_m).map(Vector3::normalize);
        let mut of_axes: [Vec<f64>; 3] = Default::default();
        for direction in long {
            for (axis, component) in of_axes.iter_mut().zip(direction.iter()) {
                axis.push(*component);
            }
        }
        let median = Vector3::from(of_axes.map(|mut components| {
            components.sort_by(f64::total_cmp);
            components.get(components.len() / 2).copied().unwrap_or(0.0)
        }));
        (median.norm() > MIN_AGREEMENT).then(|| median.normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, UnitQuaternion};

    /// A drive that goes `ahead` in the body's axes and turns about `up`, with stops.
    fn drive(ahead: Vector3<f64>, up: Vector3<f64>) -> Trajectory {
        let mut pose = Isometry3::identity();
        let mut poses = vec![pose];
        for k in 0..200 {
            let turn = if k % 50 < 20 { 0.05 } else { -0.01 };
            let step_m = if k % 3 == 0 { 0.0 } else { 1.0 };
            pose *= Isometry3::from_parts((step_m * ahead).into(), UnitQuaternion::new(turn * up));
            poses.push(pose);
        }
        Trajectory::unstamped(poses).unwrap()
    }

    #[test]
    fn vehicles_go_along_x_and_cameras_along_z() {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert!((drive(x, z).travel_in_body().unwrap() - x).norm() < 1e-9);
        assert!((drive(z, -y).travel_in_body().unwrap() - z).norm() < 1e-9);
        assert!((drive(-x, z).travel_in_body().unwrap() + x).norm() < 1e-9);
        let askew = Vector3::new(1.0, 1.0, 0.0).normalize();
        assert!((drive(askew, z).travel_in_body().unwrap() - askew).norm() < 1e-9);
    }

    #[test]
    fn where_the_world_lies_does_not_matter() {
        let world = Isometry3::from_parts(
            Vector3::new(5e5, 4e6, 100.0).into(),
            Rotation3::from_euler_angles(0.3, -1.2, 2.5).into(),
        );
        let poses = drive(Vector3::x(), Vector3::z()).poses().iter().map(|pose| world * pose).collect();
        let travel = Trajectory::unstamped(poses).unwrap().travel_in_body().unwrap();
        assert!((travel - Vector3::x()).norm() < 1e-6);
    }

    #[test]
    fn no_movement_has_no_direction() {
        let standing = Trajectory::unstamped(vec![Isometry3::identity(); 9]).unwrap();
        assert_eq!(standing.travel_in_body(), None);
        assert_eq!(Trajectory::unstamped(vec![Isometry3::identity()]).unwrap().travel_in_body(), None);
        // To and fro along all axes.
        let places = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 0]];
        let poses = places.iter().map(|p| Isometry3::from(p.map(f64::from))).collect();
        assert_eq!(Trajectory::unstamped(poses).unwrap().travel_in_body(), None);
    }
}
