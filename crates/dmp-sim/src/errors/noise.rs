//! White noise of poses.

use dmp_sensor::{Isometry3, UnitQuaternion, Vector3};

use super::poses::Poses;
use crate::error::{SimError, require};
use crate::random::Random;

/// White noise of a SLAM system that gives one pose a scan.
///
/// Where poses are `interval_ns` or more apart, and in runs without stamps, every pose gets noise of its own.
/// Where they are denser, each interval gets one draw and the poses between are blended from the draws
/// around them (with constant variance): a run of 100 poses a second is as wrong as one of 10, while the
/// motion *within* a scan stays true, as it would from a system that puts out a pose per scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation along each axis, metres.
    pub sigma_m: f64,
    /// Standard deviation of the rotation about each axis, radians.
    pub sigma_rad: f64,
    /// Time between independent draws, nanoseconds: the time between two scans.
    pub interval_ns: i64,
}

impl Noise {
    pub(super) fn check(&self) -> Result<(), SimError> {
        let finite = |sigma: f64| (0.0..1e6).contains(&sigma);
        require(finite(self.sigma_m), "the noise in m", "0 or more", self.sigma_m)?;
        require(finite(self.sigma_rad), "the noise in rad", "0 or more", self.sigma_rad)?;
        require(self.interval_ns > 0, "the noise interval in ns", "positive", self.interval_ns as f64)
    }

    /// Draw number `n`: shift in the world, rotation vector in the body.
    fn draw(&self, seed: u64, n: u64) -> (Vector3<f64>, Vector3<f64>) {
        let mut random = Random::new(seed, &[b'e'.into(), b'n'.into(), n]);
        let mut vector = |sigma: f64| Vector3::from_fn(|_, _| sigma * random.normal());
        (vector(self.sigma_m), vector(self.sigma_rad))
    }

    pub(super) fn add(&self, poses: &mut Poses, stamps_ns: Option<&[i64]>, seed: u64) {
        let dense = stamps_ns.filter(|stamps_ns| self.is_finer(stamps_ns));
        for (k, pose) in poses.iter_mut().enumerate() {
            let (shift, turn) = match dense {
                None => self.draw(seed, k as u64),
                Some(stamps_ns) => {
                    let since_ns = stamps_ns[k].abs_diff(stamps_ns[0]);
                    let interval_ns = self.interval_ns.unsigned_abs();
                    let n = since_ns / interval_ns;
                    let u = (since_ns % interval_ns) as f64 / interval_ns as f64;
                    let (a, b) = (self.draw(seed, n), self.draw(seed, n + 1));
                    // Blended draws have a smaller variance than either: put it right.
                    let norm = libm::hypot(1.0 - u, u);
                    let blend = |a: Vector3<f64>, b: Vector3<f64>| (a * (1.0 - u) + b * u) / norm;
                    (blend(a.0, b.0), blend(a.1, b.1))
                }
            };
            let rotation = pose.rotation * UnitQuaternion::from_scaled_axis(turn);
            *pose = Isometry3::from_parts((pose.translation.vector + shift).into(), rotation);
        }
    }

    /// Whether poses are typically closer in time than the draws; 1 % of leeway for uneven stamps.
    fn is_finer(&self, stamps_ns: &[i64]) -> bool {
        let mut gaps: Vec<u64> = stamps_ns.windows(2).map(|pair| pair[1].abs_diff(pair[0])).collect();
        gaps.sort_unstable();
        gaps.get(gaps.len() / 2).is_some_and(|&gap_ns| (gap_ns as f64) < 0.99 * self.interval_ns as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SlamErrors, tests::circle};
    use super::*;
    use dmp_sensor::Trajectory;

    /// Standard deviation of the shift along x and of the turn about z, and the mean product of
    /// neighbouring shifts over the variance.
    fn statistics(run: &Trajectory, wrong: &Trajectory) -> [f64; 3] {
        let pairs = || run.poses().iter().zip(wrong.poses());
        let shifts: Vec<f64> = pairs().map(|(t, w)| w.translation.x - t.translation.x).collect();
        let turns = pairs().map(|(t, w)| (t.rotation.inverse() * w.rotation).scaled_axis().z);
        let count = shifts.len() as f64;
        let variance = shifts.iter().map(|x| x * x).sum::<f64>() / count;
        let neighbours = shifts.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / count;
        [variance.sqrt(), (turns.map(|x| x * x).sum::<f64>() / count).sqrt(), neighbours / variance]
    }

    fn noisy(run: &Trajectory, interval_ns: i64) -> Trajectory {
        let noise = Some(Noise { sigma_m: 0.03, sigma_rad: 0.002, interval_ns });
        SlamErrors { noise, ..SlamErrors::default() }.apply(run).unwrap()
    }

    #[test]
    fn one_pose_a_scan_gets_independent_noise_and_so_does_each_without_a_stamp() {
        let run = circle(20_000);
        let unstamped = Trajectory::unstamped(run.poses().to_vec()).unwrap();
        for (run, interval_ns) in [(run, 100_000_000), (unstamped, 1_000_000_000)] {
            let [shift, turn, neighbours] = statistics(&run, &noisy(&run, interval_ns));
            assert!((shift / 0.03 - 1.0).abs() < 0.03 && (turn / 0.002 - 1.0).abs() < 0.03, "{shift} {turn}");
            assert!(neighbours.abs() < 0.03, "{neighbours}");
        }
    }

    #[test]
    fn many_poses_a_scan_share_it_and_keep_its_size() {
        let run = circle(20_000);
        let [shift, turn, neighbours] = statistics(&run, &noisy(&run, 1_000_000_000));
        assert!((shift / 0.03 - 1.0).abs() < 0.05 && (turn / 0.002 - 1.0).abs() < 0.05, "{shift} {turn}");
        assert!(neighbours > 0.95, "{neighbours}");
    }
}
