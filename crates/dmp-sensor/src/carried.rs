//! Sparse poses, with what happened between them from elsewhere.

use nalgebra::Isometry3;

use crate::between::pose_between;
use crate::trajectory::Trajectory;

impl Trajectory {
    /// These poses with those of an `odometry` of the same body between them, whose own world may be any: from each pose on as the
    /// odometry goes, and its error at the next is spread evenly over the time between. Outside the odometry's time
    /// there is nothing between two poses. `None` where either has no stamps, or the odometry has no pose between any two.
    ///
    /// ```
    /// use dmp_sensor::{Isometry3, Trajectory};
    ///
    /// let at = |ns, x| (ns, Isometry3::translation(x, 0.0, 0.0));
    /// let keyframes = Trajectory::stamped(vec![at(0, 5.0), at(100, 16.0)])?.trajectory;
    /// let odometry = Trajectory::stamped(vec![at(0, 0.0), at(20, 1.0), at(100, 10.0)])?.trajectory;
    /// let dense = keyframes.carried_by(&odometry, 1000).expect("poses in between");
    /// assert_eq!(dense.stamps_ns(), Some(&[0, 20, 100][..]));
    /// // As the odometry, and a fifth of the metre that it lacks.
    /// assert!((dense.poses()[1].translation.x - 6.2).abs() < 1e-12);
    /// # Ok::<(), dmp_sensor::TrajectoryError>(())
    /// ```
    #[must_use]
    pub fn carried_by(&self, odometry: &Self, max_gap_ns: i64) -> Option<Self> {
        let (stamps_ns, odometry_ns) = (self.stamps_ns()?, odometry.stamps_ns()?);
        let mut all = Vec::with_capacity(stamps_ns.len() + odometry_ns.len());
        let mut any = false;
        for (k, pair_ns) in stamps_ns.windows(2).enumerate() {
            let [from_ns, to_ns] = [pair_ns[0], pair_ns[1]];
            let (from, to) = (self.poses()[k], self.poses()[k + 1]);
            all.push((from_ns, from));
            let at = |ns: i64| odometry.world_from_body_at(ns, max_gap_ns);
            let Some((start, end)) = at(from_ns).zip(at(to_ns)) else { continue };
            let lacking = (from * (start.inverse() * end)).inverse() * to;
            let first = odometry_ns.partition_point(|&ns| ns <= from_ns);
            let last = odometry_ns.partition_point(|&ns| ns < to_ns);
            let between = odometry_ns[first..last].iter().zip(&odometry.poses()[first..last]);
            for (&ns, pose) in between {
                let share = (ns - from_ns) as f64 / (to_ns - from_ns) as f64;
                all.push((ns, from * (start.inverse() * pose) * part(&lacking, share)));
                any = true;
            }
        }
        all.push((*stamps_ns.last()?, *self.poses().last()?));
        if any { Some(Self::stamped(all).ok()?.trajectory) } else { None }
    }
}

/// Part of a motion: of its turn, and of its shift.
fn part(motion: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    pose_between(&Isometry3::identity(), motion, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    /// A drive in a circle with a bump.
    fn truth(ns: i64) -> Isometry3<f64> {
        let s = ns as f64 / 1e9;
        let turn = UnitQuaternion::from_euler_angles(0.02 * (3.0 * s).sin(), 0.0, 0.3 * s);
        Isometry3::from_parts(
            Vector3::new(20.0 * (0.3 * s).sin(), 20.0 * (0.3 * s).cos(), 0.1 * s).into(),
            turn,
        )
    }

    #[test]
    fn a_true_odometry_in_another_world_gives_the_truth() {
        const STEP_NS: i64 = 50_000_000;
        let world = Isometry3::from_parts(
            Vector3::new(3.0, -7.0, 1.0).into(),
            UnitQuaternion::from_euler_angles(0.1, 0.2, 2.0),
        );
        let dense = (0..200).map(|k| (k * STEP_NS, world * truth(k * STEP_NS))).collect();
        let odometry = Trajectory::stamped(dense).unwrap().trajectory;
        let keyframes = (0..5).map(|k| (k * 40 * STEP_NS + 7, truth(k * 40 * STEP_NS + 7))).collect();
        let keyframes = Trajectory::stamped(keyframes).unwrap().trajectory;
        let carried = keyframes.carried_by(&odometry, 1_000_000_000).unwrap();
        assert_eq!(carried.len(), 5 + 160);
        for (&ns, pose) in carried.stamps_ns().unwrap().iter().zip(carried.poses()) {
            let off = truth(ns).inverse() * pose;
            assert!(off.translation.vector.norm() < 1e-3 && off.rotation.angle() < 1e-4, "{ns}: {off}");
        }
        // The keyframes themselves stay to the bit.
        for (ns, pose) in keyframes.stamps_ns().unwrap().iter().zip(keyframes.poses()) {
            assert_eq!(carried.world_from_body_at(*ns, 0), Some(*pose));
        }
    }

    #[test]
    fn an_odometry_of_another_time_carries_nothing() {
        let at = |ns| (ns, truth(ns));
        let keyframes = Trajectory::stamped(vec![at(0), at(100)]).unwrap().trajectory;
        let later = Trajectory::stamped(vec![at(500), at(600)]).unwrap().trajectory;
        assert_eq!(keyframes.carried_by(&later, 1000), None);
        let unstamped = Trajectory::unstamped(vec![truth(0)]).unwrap();
        assert_eq!(keyframes.carried_by(&unstamped, 1000), None);
    }
}
