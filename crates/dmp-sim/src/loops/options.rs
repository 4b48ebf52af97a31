//! How a simulated pose graph and its loop candidates are made.

use dmp_lengths::{LoopLengths, Scales, SimulatedLoopLengths};

use super::keyframes::Spacing;
use crate::error::{SimError, require};

/// How the pose graph of a drive, or of a walk through a room, is made, and which loop candidates are.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopGraphOptions {
    /// Seed of the odometry's noise and of all that is drawn for the candidates.
    pub seed: u64,
    /// Travel from one keyframe to the next, metres; with 0 every instant is a keyframe.
    pub spacing_m: f64,
    /// A turn after which there is a keyframe, too, however short the path, radians; `None` for none.
    pub spacing_rad: Option<f64>,
    /// Instants that may be keyframes, nanoseconds, in any order: the scans of a log. `None`: those of the
    /// trajectory's poses.
    pub instants_ns: Option<Vec<i64>>,
    /// Standard deviation of a step of one metre of the odometry along each axis, metres; that of other steps
    /// grows with the square root of their length.
    pub step_sigma_m: f64,
    /// The same of the rotation about each axis, radians.
    pub step_sigma_rad: f64,
    /// What the odometry turns too far to the left in each metre of travel, radians.
    pub yaw_bias_rad_per_m: f64,
    /// What counts as one place and as another, and what loops are off by.
    pub lengths: LoopLengths,
    /// Candidates that are [`LoopKind::True`](crate::LoopKind::True).
    pub true_loops: usize,
    /// Candidates that are [`LoopKind::False`](crate::LoopKind::False).
    pub false_loops: usize,
    /// Candidates that are [`LoopKind::Near`](crate::LoopKind::Near).
    pub near_loops: usize,
}

impl Default for LoopGraphOptions {
    fn default() -> Self {
        Self::on_scales(Scales::default())
    }
}

impl LoopGraphOptions {
    /// What is usual for a drive with a sensor that sees all around, or for a walk through a room with a camera in the hand.
    pub fn on_scales(scales: Scales) -> Self {
        let SimulatedLoopLengths {
            spacing_m,
            spacing_rad,
            step_sigma_m,
            step_sigma_rad,
            yaw_bias_rad_per_m,
            loops: lengths,
        } = scales.lengths().simulated_loops;
        Self {
            seed: 1,
            spacing_m,
            spacing_rad,
            instants_ns: None,
            step_sigma_m,
            step_sigma_rad,
            yaw_bias_rad_per_m,
            lengths,
            true_loops: 10,
            false_loops: 10,
            near_loops: 6,
        }
    }

    pub(super) fn spacing(&self) -> Spacing {
        Spacing { travel_m: self.spacing_m, turn_rad: self.spacing_rad.unwrap_or(f64::INFINITY) }
    }

    pub(super) fn check(&self) -> Result<(), SimError> {
        let within = |value: f64, most: f64| (0.0..=most).contains(&value);
        let turn = self.spacing_rad.unwrap_or(0.0);
        require(within(turn, 4.0), "the turn between keyframes in rad", "from 0 to 4", turn)?;
        require(within(self.spacing_m, 1000.0), "the spacing in m", "from 0 to 1000", self.spacing_m)?;
        require(within(self.step_sigma_m, 10.0), "the noise in m", "from 0 to 10", self.step_sigma_m)?;
        require(within(self.step_sigma_rad, 1.0), "the noise in rad", "from 0 to 1", self.step_sigma_rad)?;
        let bias = self.yaw_bias_rad_per_m;
        require(within(bias.abs(), 1.0), "the yaw bias in rad/m", "from -1 to 1", bias)
    }
}
