//! What a file in world coordinates was made with.

use dmp_sensor::{Isometry3, Trajectory};

/// Length of the scans that a file is cut into where nothing is said, nanoseconds.
const USUAL_SCAN_NS: i64 = 100_000_000;

/// What a file with points in world coordinates was made with: where the sensor was.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MadeWith {
    /// The trajectory, `world_from_body`, with stamps.
    pub trajectory: Trajectory,
    /// Where the sensor sits on the body.
    pub body_from_sensor: Isometry3<f64>,
    /// Added to the times of points before poses are looked up, nanoseconds. The log's stamps stay as they are.
    pub time_offset_ns: i64,
    /// Poses further apart are not interpolated between, nanoseconds; `None` for
    /// [`Trajectory::usual_gap_ns`].
    pub max_gap_ns: Option<i64>,
    /// Length of a scan, nanoseconds, more than 0.
    pub scan_period_ns: i64,
}

impl MadeWith {
    /// This trajectory, the sensor in the body's place, on the same clock, scans of 0.1 s.
    pub fn new(trajectory: Trajectory) -> Self {
        Self {
            trajectory,
            body_from_sensor: Isometry3::identity(),
            time_offset_ns: 0,
            max_gap_ns: None,
            scan_period_ns: USUAL_SCAN_NS,
        }
    }

    pub(super) fn gap_ns(&self) -> i64 {
        self.max_gap_ns.unwrap_or_else(|| self.trajectory.usual_gap_ns())
    }
}
