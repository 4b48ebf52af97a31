//! Estimates the uncertainty of interpolated poses in long gaps.
//!
//! Between two poses the sensor is assumed to move uniformly; a trajectory of keyframes omits its real
//! motion. The poses themselves give the error: each is compared with the interpolation between its
//! neighbours. This error grows with the product of the times to both, as for a constant acceleration.

use dmp_sensor::{Isometry3, Trajectory, pose_between};

/// Longer gaps than this many scans are checked.
const SCANS: i64 = 3;
/// Largest error of a used scan, metres of a drive; a rotation counts at this distance.
const ALLOWED_M: f64 = 0.05;
const REACH_M: f64 = 10.0;

/// The uncertainty in long gaps between poses.
#[derive(Debug, Clone)]
pub(crate) struct Sparse {
    /// For every pose but the last, of the gap after it: the growth rate of the interpolation error, m/s²; 0
    /// for short gaps.
    astray_m_per_s2: Vec<f64>,
    stamps_ns: Vec<i64>,
    allowed_m: f64,
}

impl Sparse {
    /// `None` for poses without long gaps. Gaps beyond `max_gap_ns`, which are never interpolated, do not
    /// count.
    pub(crate) fn new(
        trajectory: &Trajectory,
        period_ns: Option<i64>,
        max_gap_ns: i64,
        metre_m: f64,
    ) -> Option<Self> {
        let (stamps_ns, poses) = (trajectory.stamps_ns()?, trajectory.poses());
        let long_ns = period_ns?.saturating_mul(SCANS);
        let gap_ns = |k: usize| stamps_ns[k + 1].saturating_sub(stamps_ns[k]);
        let gaps = stamps_ns.len().saturating_sub(1);
        let is_long = |k: usize| gap_ns(k) > long_ns && gap_ns(k) <= max_gap_ns;
        if !(0..gaps).any(is_long) {
            return None;
        }
        // The error of a pose interpolated between its neighbours, divided by the product of the times to
        // both.
        let at = |k: usize| -> f64 {
            if k == 0 || k == gaps {
                return 0.0;
            }
            let (before_s, after_s) = (gap_ns(k - 1) as f64 / 1e9, gap_ns(k) as f64 / 1e9);
            let expected = pose_between(&poses[k - 1], &poses[k + 1], before_s / (before_s + after_s));
            off_m(&expected, &poses[k], REACH_M * metre_m) / (before_s * after_s)
        };
        let astray = |k: usize| if is_long(k) { at(k).max(at(k + 1)) } else { 0.0 };
        let astray_m_per_s2 = (0..gaps).map(astray).collect();
        Some(Self { astray_m_per_s2, stamps_ns: stamps_ns.to_vec(), allowed_m: ALLOWED_M * metre_m })
    }

    /// The uncertainty of the sensor's position at an instant, metres.
    pub(crate) fn off_m(&self, at_ns: i64) -> f64 {
        let after = self.stamps_ns.partition_point(|&stamp_ns| stamp_ns <= at_ns);
        let Some(before) = after.checked_sub(1).filter(|_| after < self.stamps_ns.len()) else { return 0.0 };
        let s = |ns: i64| ns as f64 / 1e9;
        let (since_s, until_s) =
            (s(at_ns - self.stamps_ns[before]), s(self.stamps_ns[after].saturating_sub(at_ns)));
        self.astray_m_per_s2[before] * since_s * until_s
    }

    /// Whether the poses are accurate enough for a scan with returns from one instant to another.
    pub(crate) fn carries(&self, from_ns: i64, to_ns: i64) -> bool {
        let middle_ns = from_ns / 2 + to_ns / 2;
        [from_ns, middle_ns, to_ns].into_iter().all(|at_ns| self.off_m(at_ns) <= self.allowed_m)
    }

    /// The largest uncertainty in the middle of a gap, metres.
    pub(crate) fn most_m(&self) -> f64 {
        let middle = |(k, astray): (usize, &f64)| {
            let half_s = 0.5 * self.stamps_ns[k + 1].saturating_sub(self.stamps_ns[k]) as f64 / 1e9;
            astray * half_s * half_s
        };
        self.astray_m_per_s2.iter().enumerate().map(middle).fold(0.0, f64::max)
    }
}

fn off_m(a: &Isometry3<f64>, b: &Isometry3<f64>, reach_m: f64) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + reach_m * a.rotation.angle_to(&b.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    fn accelerating(step_ns: i64) -> Trajectory {
        let pose = |k: i64| {
            let s = (k * step_ns) as f64 / 1e9;
            (k * step_ns, Isometry3::translation(s * s, 0.0, 0.0))
        };
        Trajectory::stamped((0..20).map(pose).collect()).unwrap().trajectory
    }

    #[test]
    fn what_an_even_acceleration_leaves_out_is_found() {
        // 2 m/s²: in the middle of two seconds, a quarter of 2 m/s² · 2 s² is missing, 1 m.
        let sparse = Sparse::new(&accelerating(2 * SECOND_NS), Some(SECOND_NS / 10), i64::MAX, 1.0).unwrap();
        assert!((sparse.most_m() - 1.0).abs() < 1e-9, "{}", sparse.most_m());
        assert!((sparse.off_m(5 * SECOND_NS) - 1.0).abs() < 1e-9);
        assert_eq!(sparse.off_m(4 * SECOND_NS), 0.0);
        assert!(!sparse.carries(5 * SECOND_NS, 5 * SECOND_NS));
        assert!(sparse.carries(4 * SECOND_NS - 20_000_000, 4 * SECOND_NS + 20_000_000));
        // Beyond the poses there is none at all: another check reports that.
        assert_eq!(sparse.off_m(-SECOND_NS), 0.0);
    }

    #[test]
    fn poses_for_every_scan_are_not_sparse() {
        assert!(Sparse::new(&accelerating(SECOND_NS / 10), Some(SECOND_NS / 10), i64::MAX, 1.0).is_none());
        assert!(Sparse::new(&accelerating(2 * SECOND_NS), Some(SECOND_NS / 10), SECOND_NS, 1.0).is_none());
        assert!(Sparse::new(&accelerating(SECOND_NS), None, i64::MAX, 1.0).is_none());
        let evenly = |k: i64| (k * SECOND_NS, Isometry3::translation(10.0 * k as f64, 0.0, 0.0));
        let evenly = Trajectory::stamped((0..20).map(evenly).collect()).unwrap().trajectory;
        let sparse = Sparse::new(&evenly, Some(SECOND_NS / 10), i64::MAX, 1.0).unwrap();
        assert!(sparse.most_m() < 1e-9 && sparse.carries(SECOND_NS / 2, SECOND_NS / 2));
    }
}
