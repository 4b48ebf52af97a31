//! Poses as a file has them.

use super::CompareError;
use super::rotation::{angle_rad, product};
use nalgebra::{Matrix3, Vector3};

/// One pose `world_from_body`: a place in metres and a rotation as it was read, not made orthogonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// `world_from_body`, nearly orthogonal.
    pub rotation: Matrix3<f64>,
    /// The body's place in the world, metres.
    pub position_m: Vector3<f64>,
}

impl Pose {
    /// The pose that changes nothing.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), position_m: Vector3::zeros() }
    }

    /// `self` after `right`: `a_from_b` times `b_from_c`.
    #[must_use]
    pub fn times(&self, right: &Self) -> Self {
        let (r, t) = (&self.rotation, &right.position_m);
        let place = |i: usize| {
            r[(i, 2)].mul_add(t[2], r[(i, 1)].mul_add(t[1], r[(i, 0)] * t[0])) + self.position_m[i]
        };
        Self { rotation: product(r, &right.rotation), position_m: Vector3::new(place(0), place(1), place(2)) }
    }

    /// The inverse, the rotation's by transposition.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, position_m: -(rotation * self.position_m) }
    }

    /// Roll, pitch and yaw: angles about the fixed axes x, y, z, in this order, radians.
    pub fn roll_pitch_yaw_rad(&self) -> [f64; 3] {
        euler_rad(&self.rotation)
    }

    /// `self⁻¹ other`: the other pose as seen from this one.
    #[must_use]
    pub fn to(&self, other: &Self) -> Self {
        self.inverse().times(other)
    }
}

/// Poses in the order of their file, with stamps in seconds or without. Unlike
/// [`dmp_sensor::Trajectory`] nothing is sorted or excluded: the numbers of a comparison depend
/// on both.
#[derive(Debug, Clone, PartialEq)]
pub struct PosePath {
    stamps_s: Option<Vec<f64>>,
    poses: Vec<Pose>,
}

impl PosePath {
    /// Poses with their stamps, if they have any.
    ///
    /// # Errors
    /// When there is no pose, or not one stamp for each.
    pub fn new(poses: Vec<Pose>, stamps_s: Option<Vec<f64>>) -> Result<Self, CompareError> {
        if poses.is_empty() {
            return Err(CompareError::Empty);
        }
        match &stamps_s {
            Some(stamps) if stamps.len() != poses.len() => {
                Err(CompareError::Stamps { stamps: stamps.len(), poses: poses.len() })
            }
            _ => Ok(Self { stamps_s, poses }),
        }
    }

    /// The poses `world_from_body`.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// The stamps, seconds; `None` where the format has none.
    pub fn stamps_s(&self) -> Option<&[f64]> {
        self.stamps_s.as_deref()
    }

    /// Number of poses. Zero only after [`cut`](Self::cut) to a time without poses.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether a cut has left nothing.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Distance travelled up to each pose, metres; the first is 0.
    pub fn distances_m(&self) -> Vec<f64> {
        let mut way_m = 0.0;
        let first = self.poses.first().map(|_| 0.0);
        let steps = self.poses.windows(2).map(|pair| (pair[0].position_m - pair[1].position_m).norm());
        let rest = steps.map(|step_m| {
            way_m += step_m;
            way_m
        });
        first.into_iter().chain(rest).collect()
    }

    /// Only these poses, in this order. Indices must be smaller than the length.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        Self {
            stamps_s: self.stamps_s.as_ref().map(|stamps| indices.iter().map(|&i| stamps[i]).collect()),
            poses: indices.iter().map(|&i| self.poses[i]).collect(),
        }
    }

    /// Only the poses from `start_s` to `end_s`, both included; `None` is the stamp of the first or the
    /// last line. Without stamps nothing changes.
    ///
    /// # Errors
    /// When the start is after the end.
    pub fn cut(&mut self, start_s: Option<f64>, end_s: Option<f64>) -> Result<(), CompareError> {
        let Some(stamps) = &self.stamps_s else { return Ok(()) };
        let (Some(&first), Some(&last)) = (stamps.first(), stamps.last()) else { return Ok(()) };
        let (start_s, end_s) = (start_s.unwrap_or(first), end_s.unwrap_or(last));
        if start_s > end_s {
            return Err(CompareError::StartAfterEnd { start_s, end_s });
        }
        let inside = (0..self.len()).filter(|&k| stamps[k] >= start_s && stamps[k] <= end_s);
        *self = self.select(&inside.collect::<Vec<_>>());
        Ok(())
    }

    /// Every place times `scale`; rotations stay.
    pub fn scale(&mut self, scale: f64) {
        self.poses.iter_mut().for_each(|pose| pose.position_m *= scale);
    }

    /// Every pose moved by `left` in the world.
    pub fn transform(&mut self, left: &Pose) {
        self.poses.iter_mut().for_each(|pose| *pose = left.times(pose));
    }
}

/// The angle between two rotations, radians; an error that names the later pose where it is none.
pub(crate) fn turn_between(poses: &[Pose], a: usize, b: usize) -> Result<f64, CompareError> {
    let relative = product(&poses[a].rotation.transpose(), &poses[b].rotation);
    angle_rad(&relative).ok_or(CompareError::NotARotation { index: b })
}

/// Euler angles about the fixed axes x, y, z, in this order.
fn euler_rad(m: &Matrix3<f64>) -> [f64; 3] {
    let cosine = (m[(0, 0)] * m[(0, 0)] + m[(1, 0)] * m[(1, 0)]).sqrt();
    let pitch = libm::atan2(-m[(2, 0)], cosine);
    if cosine > 4.0 * f64::EPSILON {
        [libm::atan2(m[(2, 1)], m[(2, 2)]), pitch, libm::atan2(m[(1, 0)], m[(0, 0)])]
    } else {
        [libm::atan2(-m[(1, 2)], m[(1, 1)]), pitch, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn line(count: usize) -> PosePath {
        let pose = |k: usize| Pose {
            rotation: Rotation3::from_euler_angles(0.0, 0.0, 0.1 * k as f64).into_inner(),
            position_m: Vector3::new(k as f64, 0.0, 1.0),
        };
        PosePath::new((0..count).map(pose).collect(), Some((0..count).map(|k| k as f64).collect())).unwrap()
    }

    fn xs(path: &PosePath) -> Vec<f64> {
        path.poses().iter().map(|pose| pose.position_m.x).collect()
    }

    #[test]
    fn a_pose_and_its_inverse_are_nothing() {
        let rotation = Rotation3::from_euler_angles(0.3, -0.2, 2.0).into_inner();
        let pose = Pose { rotation, position_m: Vector3::new(1.0, 2.0, 3.0) };
        let none = pose.to(&pose);
        assert!((none.rotation - Matrix3::identity()).amax() < 1e-15 && none.position_m.amax() < 1e-15);
    }

    #[test]
    fn a_cut_includes_its_ends() {
        let mut path = line(10);
        path.cut(Some(2.0), Some(4.0)).unwrap();
        assert_eq!(xs(&path), [2.0, 3.0, 4.0]);
        path.cut(Some(2.5), None).unwrap();
        assert_eq!(xs(&path), [3.0, 4.0]);
        assert!(path.clone().cut(Some(5.0), None).is_err());
        path.cut(Some(10.0), Some(11.0)).unwrap();
        assert!(path.is_empty() && path.distances_m().is_empty());
    }
}
