//! Exports measured relative poses of visits as edges of a pose graph.

use dmp_sensor::transform_of;
use dmp_sensor::{Isometry3, Matrix3, Matrix6, PoseEdge};

use super::report::{RunDrift, VisitPairReport};

impl RunDrift {
    /// The relative poses measured, as edges between scans, identified by their numbers in the log. They lead from the first visit to the second and are poses of
    /// the body that carries the sensor.
    ///
    /// A direction that no surface constrains has a standard deviation of 50 m, in a room 5 m.
    pub fn constraints(&self, body_from_sensor: &Isometry3<f64>) -> Vec<PoseEdge> {
        let edge = |visit: &VisitPairReport| {
            let (from_from_to, information) = visit.constraint(body_from_sensor)?;
            Some(PoseEdge {
                from: visit.first.scan as i64,
                to: visit.second.scan as i64,
                from_from_to,
                information,
            })
        };
        self.visits.iter().filter_map(edge).collect()
    }
}

impl VisitPairReport {
    /// The pose of the body on the second visit relative to that on the first, with the information matrix in
    /// g2o's convention.
    fn constraint(&self, body_from_sensor: &Isometry3<f64>) -> Option<(Isometry3<f64>, Matrix6<f64>)> {
        let of_sensor = transform_of(&self.first_from_second?);
        let measured = body_from_sensor * of_sensor * body_from_sensor.inverse();
        let covariance = covariance_in(body_from_sensor, &whole(&self.covariance?));
        let error_by_motion = error_by_motion(&measured);
        let covariance = error_by_motion * covariance * error_by_motion.transpose();
        let information = covariance.cholesky()?.inverse();
        Some((measured, (information + information.transpose()) / 2.0))
    }
}

/// The symmetric matrix with this upper triangle, row by row.
fn whole(upper: &[f64; 21]) -> Matrix6<f64> {
    Matrix6::from_fn(|row, column| {
        let (row, column) = (row.min(column), row.max(column));
        upper[row * 6 - row * (row + 1) / 2 + column]
    })
}

/// Its upper triangle, row by row.
pub fn upper_triangle(matrix: &Matrix6<f64>) -> [f64; 21] {
    let mut upper = [0.0; 21];
    let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    upper.iter_mut().zip(places).for_each(|(value, place)| *value = matrix[place]);
    upper
}

/// The covariance of a motion, rotation vector and translation, in another frame.
pub fn covariance_in(other_from_frame: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let by_motion = motion_in(other_from_frame);
    by_motion * covariance * by_motion.transpose()
}

/// The adjoint: maps a motion in a frame to the same motion in another one.
fn motion_in(other_from_frame: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = *other_from_frame.rotation.to_rotation_matrix().matrix();
    let lever = other_from_frame.translation.vector.cross_matrix();
    of_blocks(&[[rotation, Matrix3::zeros()], [lever * rotation, rotation]])
}

/// The derivative of g2o's error (translation, then the vector part of the quaternion, in the measured frame)
/// with respect to a small motion applied before the true pose.
fn error_by_motion(measured: &Isometry3<f64>) -> Matrix6<f64> {
    let back = measured.rotation.inverse().to_rotation_matrix().matrix().to_owned();
    let lever = measured.translation.vector.cross_matrix();
    of_blocks(&[[-(back * lever), back], [back * 0.5, Matrix3::zeros()]])
}

fn of_blocks(blocks: &[[Matrix3<f64>; 2]; 2]) -> Matrix6<f64> {
    Matrix6::from_fn(|row, column| blocks[row / 3][column / 3][(row % 3, column % 3)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drift::VisitReport;
    use dmp_sensor::{Translation3, UnitQuaternion};

    fn pose(place_m: [f64; 3], euler_rad: [f64; 3]) -> Isometry3<f64> {
        let [roll, pitch, yaw] = euler_rad;
        Isometry3::from_parts(
            Translation3::from(place_m),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }

    /// The derivatives with respect to small motions of the sensor's relative pose.
    #[test]
    fn the_error_of_an_edge_follows_the_motion_of_the_sensor() {
        let body_from_sensor = pose([0.4, -0.2, 1.3], [0.1, -0.3, 2.0]);
        let of_sensor = pose([3.0, -1.0, 0.2], [0.02, 0.05, -2.7]);
        let of_body =
            |motion: &Isometry3<f64>| body_from_sensor * motion * of_sensor * body_from_sensor.inverse();
        let measured = of_body(&Isometry3::identity());
        let found = error_by_motion(&measured) * motion_in(&body_from_sensor);
        let step = 1e-6;
        for axis in 0..6 {
            let mut motion = [[0.0; 3]; 2];
            motion[axis / 3][axis % 3] = step;
            let turn = UnitQuaternion::from_scaled_axis(motion[0].into());
            let error = measured.inverse() * of_body(&Isometry3::from_parts(motion[1].into(), turn));
            let error = [error.translation.vector, error.rotation.quaternion().imag()];
            for row in 0..6 {
                let expected = error[row / 3][row % 3] / step;
                assert!((found[(row, axis)] - expected).abs() < 1e-4, "{row} {axis}: {found} {expected}");
            }
        }
    }

    #[test]
    fn an_edge_has_the_pose_and_the_information_of_what_was_measured() {
        let mut covariance = [0.0; 21];
        for (at, sigma) in [(0, 1e-3_f64), (6, 1e-3), (11, 1e-3), (15, 0.01), (18, 0.02), (20, 0.03)] {
            covariance[at] = sigma * sigma;
        }
        let visit = VisitReport { scan: 0, stamp_ns: None, scans: Vec::new() };
        let pair = VisitPairReport {
            first: visit.clone(),
            second: visit,
            apart_m: 0.0,
            way_m: 100.0,
            at_m: [0.0; 3],
            off: None,
            at_least_m: None,
            why_not: None,
            first_from_second: Some([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            covariance: Some(covariance),
        };
        let (measured, information) = pair.constraint(&Isometry3::identity()).unwrap();
        assert_eq!(measured, Isometry3::identity());
        for (k, sigma) in [0.01, 0.02, 0.03, 5e-4, 5e-4, 5e-4].into_iter().enumerate() {
            assert!((information[(k, k)] * sigma * sigma - 1.0).abs() < 1e-9, "{information}");
        }
        let refused = VisitPairReport { first_from_second: None, covariance: None, ..pair };
        assert_eq!(refused.constraint(&Isometry3::identity()), None);
    }
}
