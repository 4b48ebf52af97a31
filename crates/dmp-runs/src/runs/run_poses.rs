//! The sensor's poses in each run.

use std::sync::Arc;

use dmp_report::Pairing;
use dmp_sensor::{Isometry3, Track, Trajectory};

use crate::asked::{Run, Settings};
use crate::runs::clock::OnClock;
use crate::runs::frame::PlannedFrame;
use crate::runs::sparse::Sparse;

/// The sensor's poses in one run.
#[derive(Debug, Clone)]
pub struct RunPoses {
    /// How poses are paired with scans.
    pub pairing: Pairing,
    /// Longest gap between poses that is interpolated, nanoseconds.
    pub max_gap_ns: i64,
    body_from_sensor: Isometry3<f64>,
    /// On the log's clock.
    trajectory: Arc<Trajectory>,
    /// Shift from its own stamps to those of the poses, nanoseconds.
    shift_ns: i64,
    /// The uncertainty in its long gaps.
    sparse: Option<Arc<Sparse>>,
    /// From the stamp of a scan to its first and its last return, nanoseconds.
    sweep_ns: [i64; 2],
}

impl RunPoses {
    /// Pairs the poses of a run, on the log's clock and in some frame, with the log's scans.
    pub fn new(run: &Run, on_clock: OnClock, settings: &Settings) -> Self {
        let OnClock { pairing, trajectory, shift_ns, period_ns, sweep_ns } = on_clock;
        let max_gap_ns = settings.max_time_gap_ns.unwrap_or_else(|| trajectory.usual_gap_ns());
        // A user who sets the longest gap has checked the poses.
        let looks = settings.max_time_gap_ns.is_none();
        let sparse = looks
            .then(|| Sparse::new(&trajectory, period_ns, max_gap_ns, settings.metre_m()))
            .flatten()
            .map(Arc::new);
        let body_from_sensor = settings.body_from_sensor(run);
        let trajectory = Arc::new(trajectory);
        Self { pairing, max_gap_ns, body_from_sensor, trajectory, shift_ns, sparse, sweep_ns }
    }

    /// The same in the frame of `new_from_world`.
    #[must_use]
    pub fn moved(&self, new_from_world: &Isometry3<f64>) -> Self {
        let trajectory = Arc::new(self.trajectory.moved(new_from_world));
        Self { trajectory, sparse: self.sparse.clone(), ..*self }
    }

    /// The sensor's poses at any time.
    pub fn track(&self) -> Track<'_> {
        Track::new(&self.trajectory, self.body_from_sensor, self.max_gap_ns)
    }

    /// The sensor's pose at the stamp of a frame, or of its line.
    pub fn of_frame(&self, frame: &PlannedFrame) -> Option<Isometry3<f64>> {
        self.of_frame_after(frame, 0)
    }

    /// The sensor's pose at this time after the stamp of a frame, or of its line if it has no stamp.
    pub fn of_frame_after(&self, frame: &PlannedFrame, after_ns: i64) -> Option<Isometry3<f64>> {
        let stamp_ns = match self.pairing {
            Pairing::ByStamp => frame.stamp_ns,
            Pairing::ByLine => self.stamp_of_line(frame),
        };
        match (stamp_ns, self.pairing) {
            (Some(stamp_ns), _) => self.track().world_from_sensor_at(stamp_ns.checked_add(after_ns)?),
            (None, Pairing::ByStamp) => None,
            (None, Pairing::ByLine) => self.track().world_from_sensor_of_line(frame.number),
        }
    }

    /// The body's pose at the stamp of a frame, or of its line, and its position among the run's own poses:
    /// the number of a pose, with a fraction between two.
    pub fn body_of_frame(&self, frame: &PlannedFrame) -> Option<(f64, Isometry3<f64>)> {
        let world_from_body = self.of_frame(frame)? * self.body_from_sensor.inverse();
        let (stamps_ns, stamp_ns) = match (self.trajectory.stamps_ns(), self.pairing) {
            (Some(stamps_ns), Pairing::ByStamp) => (stamps_ns, frame.stamp_ns?),
            (Some(stamps_ns), Pairing::ByLine) => (stamps_ns, self.stamp_of_line(frame)?),
            (None, _) => return Some((frame.number as f64, world_from_body)),
        };
        let before = stamps_ns.partition_point(|&ns| ns <= stamp_ns).checked_sub(1)?;
        let part = stamps_ns.get(before + 1).map_or(0.0, |after_ns| {
            stamp_ns.saturating_sub(stamps_ns[before]) as f64
                / after_ns.saturating_sub(stamps_ns[before]) as f64
        });
        Some((before as f64 + part, world_from_body))
    }

    /// Whether the poses are near enough in time to a frame's scan to locate it.
    pub fn carries(&self, frame: &PlannedFrame) -> bool {
        let Some(sparse) = &self.sparse else { return true };
        let stamp_ns = match self.pairing {
            Pairing::ByStamp => frame.stamp_ns,
            Pairing::ByLine => self.stamp_of_line(frame),
        };
        let [first_ns, last_ns] = self.sweep_ns;
        stamp_ns.is_none_or(|ns| sparse.carries(ns.saturating_add(first_ns), ns.saturating_add(last_ns)))
    }

    /// The longest time between two poses, seconds.
    pub fn longest_gap_s(&self) -> Option<f64> {
        let stamps_ns = self.trajectory.stamps_ns()?;
        let longest_ns = stamps_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).max()?;
        Some(longest_ns as f64 / 1e9)
    }

    /// The longest time between two poses, seconds, and the largest uncertainty between poses, metres; `None`
    /// without long gaps.
    pub fn left_open(&self) -> Option<(f64, f64)> {
        Some((self.longest_gap_s()?, self.sparse.as_ref()?.most_m()))
    }

    /// The scan's stamp, if known from the line of its pose.
    fn stamp_of_line(&self, frame: &PlannedFrame) -> Option<i64> {
        self.trajectory.stamps_ns()?.get(frame.number)?.checked_sub(self.shift_ns)
    }

    /// Whether the log's point times are useless for this run, whose poses have no stamps.
    pub fn ignores_point_times(&self) -> bool {
        self.pairing == Pairing::ByLine && self.trajectory.stamps_ns().is_none()
    }

    /// How the poses of a scan's returns are found; `None` if the run has none for the scan.
    pub fn of_scan(&self, frame: &PlannedFrame) -> Option<ScanPose> {
        match self.pairing {
            Pairing::ByStamp => Some(ScanPose::After(frame.stamp_ns?)),
            Pairing::ByLine => match self.stamp_of_line(frame) {
                Some(stamp_ns) => Some(ScanPose::After(stamp_ns)),
                None => self.of_frame(frame).map(ScanPose::Rigid),
            },
        }
    }
}

/// How one run's poses are found within one scan.
#[derive(Debug, Clone, Copy)]
pub enum ScanPose {
    /// One pose for the whole scan.
    Rigid(Isometry3<f64>),
    /// Each return at its own time after this instant, nanoseconds.
    After(i64),
}
