//! Poses of a run, and the path along them.

use dmp_sensor::{Isometry3, Trajectory};

use crate::error::SimError;
use crate::ways::path;

pub(super) type Poses = Vec<Isometry3<f64>>;

/// Distance travelled until each pose, metres.
pub(super) struct Travel(pub(super) Vec<f64>);

impl Travel {
    pub(super) fn of(poses: &[Isometry3<f64>], what: &'static str) -> Result<Self, SimError> {
        let mut travel_m = vec![0.0; poses.len()];
        for k in 1..poses.len() {
            travel_m[k] =
                travel_m[k - 1] + (poses[k].translation.vector - poses[k - 1].translation.vector).norm();
        }
        let travel = Self(travel_m);
        if travel.total_m() > 0.0 { Ok(travel) } else { Err(SimError::NoTravel { what }) }
    }

    pub(super) fn total_m(&self) -> f64 {
        self.0.last().copied().unwrap_or(0.0)
    }

    /// Travel in the middle of the step from pose `k` to the next.
    pub(super) fn middle_m(&self, k: usize) -> f64 {
        f64::midpoint(self.0[k], self.0[k + 1])
    }
}

/// The same stamps with other poses.
pub(super) fn with_poses(run: &Trajectory, poses: Poses) -> Trajectory {
    let made = match run.stamps_ns() {
        Some(stamps_ns) => Trajectory::stamped(stamps_ns.iter().copied().zip(poses).collect())
            .map(|repaired| repaired.trajectory),
        None => Trajectory::unstamped(poses),
    };
    match made {
        Ok(trajectory) => trajectory,
        Err(error) => unreachable!("the stamps are those of a valid trajectory: {error}"),
    }
}

/// Rises smoothly from 0 at `u` ≤ 0 to 1 at `u` ≥ 1, without a jump of slope or curvature.
pub(super) fn smooth_step(u: f64) -> f64 {
    path::smooth_step(u.clamp(0.0, 1.0))
}
