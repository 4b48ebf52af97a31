//! From and to the types of the pipeline.

use dmp_sensor::{Isometry3, Quaternion, Trajectory, UnitQuaternion};

use super::rotation::to_quaternion;
use super::{Alignment, CompareError, Matching, Pose, PosePath, Preparation, Similarity};

impl PosePath {
    /// The poses and stamps of a trajectory.
    ///
    /// # Errors
    /// As [`PosePath::new`].
    pub fn of(trajectory: &Trajectory) -> Result<Self, CompareError> {
        let pose = |pose: &Isometry3<f64>| Pose {
            rotation: pose.rotation.to_rotation_matrix().into_inner(),
            position_m: pose.translation.vector,
        };
        let stamps_s =
            trajectory.stamps_ns().map(|stamps| stamps.iter().map(|&ns| ns as f64 / 1e9).collect());
        Self::new(trajectory.poses().iter().map(pose).collect(), stamps_s)
    }
}

impl Similarity {
    /// Its rotation and translation, without the scale.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x, y, z, w] = quaternion_xyzw(&self.pose);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Isometry3::from_parts(self.pose.position_m.into(), rotation)
    }
}

/// `reference_from_estimate` by [`umeyama`](super::umeyama) without scale, of the poses that belong together:
/// those nearest in time and at most 0.01 s apart; without stamps, line by line.
///
/// # Errors
/// When none belong together, when one has stamps and the other has none or a different number of poses, or
/// when their places lie on a line.
pub fn rigid_alignment(
    reference: &Trajectory,
    estimate: &Trajectory,
) -> Result<Isometry3<f64>, CompareError> {
    let preparation = Preparation {
        matching: Matching::default(),
        alignment: Alignment { pose: true, ..Alignment::default() },
        ..Preparation::default()
    };
    let prepared = preparation.apply(PosePath::of(reference)?, &PosePath::of(estimate)?)?;
    prepared.moved_by.map(|moved| moved.isometry()).ok_or(CompareError::NothingToAlign)
}

/// The unit quaternion `(x, y, z, w)` of a pose's rotation, `w` not negative.
pub fn quaternion_xyzw(pose: &Pose) -> [f64; 4] {
    let q = to_quaternion(&pose.rotation);
    if q[3] < 0.0 { q.map(|c| -c) } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Translation3;

    fn run(offset_ns: i64, step: usize, moved: &Isometry3<f64>) -> Trajectory {
        let pose = |k: usize| {
            let t = k as f64;
            let here = Isometry3::translation(4e6 + t, 20.0 * libm::sin(0.1 * t), 3.0 * libm::cos(0.2 * t));
            (k as i64 * 100_000_000 + offset_ns, moved * here)
        };
        Trajectory::stamped((0..100).step_by(step).map(pose).collect()).unwrap().trajectory
    }

    #[test]
    fn a_moved_run_is_moved_back_also_by_half_a_turn() {
        let reference = run(0, 1, &Isometry3::identity());
        let half = |[x, y, z]: [f64; 3]| UnitQuaternion::from_quaternion(Quaternion::new(0.0, x, y, z));
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.8, 0.6, 0.0]];
        for turn in axes.map(half).into_iter().chain([UnitQuaternion::from_euler_angles(0.3, -0.2, 2.0)]) {
            let moved = Isometry3::from_parts(Translation3::new(-4e6, 30.0, 5.0), turn);
            let found = rigid_alignment(&reference, &run(3_000_000, 3, &moved)).unwrap();
            for pose in reference.poses() {
                let back = found * (moved * pose);
                assert!((back.translation.vector - pose.translation.vector).norm() < 1e-6, "{turn}");
            }
        }
    }

    #[test]
    fn without_stamps_poses_belong_together_line_by_line() {
        let turn = UnitQuaternion::from_euler_angles(-0.1, 0.4, 1.0);
        let moved = Isometry3::from_parts(Translation3::new(10.0, 20.0, -3.0), turn);
        let lines = |moved: &Isometry3<f64>| run(0, 1, moved).poses().to_vec();
        let unstamped = |poses: &[Isometry3<f64>]| Trajectory::unstamped(poses.to_vec()).unwrap();
        let reference = unstamped(&lines(&Isometry3::identity()));
        let found = rigid_alignment(&reference, &unstamped(&lines(&moved))).unwrap();
        for (pose, line) in reference.poses().iter().zip(lines(&moved)) {
            assert!(((found * line).translation.vector - pose.translation.vector).norm() < 1e-6);
        }
        let error = rigid_alignment(&reference, &unstamped(&lines(&moved)[1..])).unwrap_err();
        assert_eq!(error, CompareError::Lengths { reference: 100, estimate: 99 });
    }

    #[test]
    fn what_does_not_belong_together_fails() {
        let reference = run(0, 1, &Isometry3::identity());
        let other_clock = run(1_000_000_000_000, 1, &Isometry3::identity());
        let error = rigid_alignment(&reference, &other_clock).unwrap_err();
        assert!(matches!(error, CompareError::NoMatches { .. }), "{error:?}");
        let line = |k: i64| (k * 100_000_000, Isometry3::translation(k as f64, 2.0 * k as f64, 0.0));
        let straight = Trajectory::stamped((0..50).map(line).collect()).unwrap().trajectory;
        let error = rigid_alignment(&straight, &straight).unwrap_err();
        assert!(matches!(error, CompareError::DegenerateAlignment), "{error:?}");
        let unstamped = Trajectory::unstamped(vec![Isometry3::identity(); 7]).unwrap();
        let error = rigid_alignment(&reference, &unstamped).unwrap_err();
        assert!(matches!(error, CompareError::OneWithoutStamps), "{error:?}");
    }
}
