use dmp_sensor::{
    DropReason, Isometry3, Ray, ReturnCounts, ReturnFilter, Scan, Track, TrackCursor, is_implausible,
};

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::plan::Heads;

/// Returns handled at a time, those of all runs together: bounds the memory of a thread however large a
/// scan is and however many the runs are. No number depends on it.
pub(crate) const BLOCK_RAYS: usize = 28 << 10;
const MIN_BLOCK_RETURNS: usize = 1 << 10;

/// How a run's poses are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Pairing {
    /// By the time of each return.
    #[serde(rename = "by stamp")]
    ByStamp,
    /// The n-th pose belongs to the n-th scan; times of returns count from the pose's stamp, where it
    /// has one.
    #[serde(rename = "line by line")]
    ByLine,
}

/// Where the sensor was in one run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunPoses<'a> {
    pub(crate) pairing: Pairing,
    /// Longest gap between poses that is interpolated over, nanoseconds.
    pub(crate) max_gap_ns: i64,
    track: Track<'a>,
}

impl<'a> RunPoses<'a> {
    /// Pairs the run's poses with the log's scans.
    pub(crate) fn new(heads: Heads<'_>, run: &'a Run, config: &Config) -> Result<Self, EvaluateError> {
        let max_gap_ns = config.max_time_gap_ns.unwrap_or_else(|| run.trajectory.usual_gap_ns());
        let track = Track::new(&run.trajectory, run.body_from_sensor(config), max_gap_ns);
        Ok(Self { pairing: pairing_of(heads, run)?, max_gap_ns, track })
    }

    /// The same pairing with other poses of as many lines.
    pub(crate) fn along<'b>(&self, track: Track<'b>) -> RunPoses<'b> {
        RunPoses { pairing: self.pairing, max_gap_ns: self.max_gap_ns, track }
    }

    /// The sensor's pose at the stamp of a frame, or in its line.
    pub(crate) fn of_frame(&self, frame: &PlannedFrame) -> Option<Isometry3<f64>> {
        match self.pairing {
            Pairing::ByStamp => self.track.world_from_sensor_at(frame.stamp_ns?),
            Pairing::ByLine => self.track.world_from_sensor_of_line(frame.number),
        }
    }

    /// The sensor's pose so long after the stamp of a frame, or in its line where that has no stamp.
    pub(crate) fn of_frame_after(&self, frame: &PlannedFrame, after_ns: i64) -> Option<Isometry3<f64>> {
        let stamp_ns = match self.pairing {
            Pairing::ByStamp => frame.stamp_ns,
            Pairing::ByLine => self.stamp_of_line(frame),
        };
        match stamp_ns {
            Some(stamp_ns) => self.track.world_from_sensor_at(stamp_ns.checked_add(after_ns)?),
            None => self.of_frame(frame),
        }
    }

    fn stamp_of_line(&self, frame: &PlannedFrame) -> Option<i64> {
        self.track.trajectory().stamps_ns()?.get(frame.number).copied()
    }

    /// Whether the log's times of points are of no use to this run, whose poses have no stamps.
    pub(crate) fn ignores_point_times(&self) -> bool {
        self.pairing == Pairing::ByLine && self.track.trajectory().stamps_ns().is_none()
    }

    /// How the poses of a scan's returns are found; `None` where the run has none for the scan.
    fn of_scan(&self, frame: &PlannedFrame, scan: &Scan) -> Option<ScanPose> {
        match self.pairing {
            Pairing::ByStamp => Some(ScanPose::After(frame.stamp_ns?)),
            Pairing::ByLine => match self.stamp_of_line(frame) {
                Some(stamp_ns) if !scan.time_offsets_ns.is_empty() => Some(ScanPose::After(stamp_ns)),
                _ => self.of_frame(frame).map(ScanPose::Rigid),
            },
        }
    }
}

fn pairing_of(heads: Heads<'_>, run: &Run) -> Result<Pairing, EvaluateError> {
    let scans = heads.scans_in_log();
    let log_stamped = heads.scans().all(|(_, info)| info.stamp_ns.is_some());
    let which = match (log_stamped, run.trajectory.stamps_ns().is_some()) {
        (true, true) => return Ok(Pairing::ByStamp),
        (true, false) => "in the trajectory",
        (false, true) => "in the log",
        (false, false) => "in either",
    };
    let poses = run.trajectory.len();
    if poses == scans {
        Ok(Pairing::ByLine)
    } else {
        Err(EvaluateError::LinePairing { run: run.name.clone(), poses, scans, which })
    }
}

/// The returns of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Returns<'a> {
    /// Time of each after the scan's stamp, nanoseconds.
    pub(crate) offsets_ns: &'a [i64],
    /// As the sensor has them, metres.
    pub(crate) points_in_sensor_m: &'a [[f32; 3]],
}

/// Turns scans into rays, one for every run and every return that is used.
#[derive(Debug)]
pub(crate) struct Poser<'a> {
    filter: &'a ReturnFilter,
    runs: &'a [RunPoses<'a>],
    cursors: Vec<TrackCursor<'a>>,
    rays: Vec<Vec<Ray>>,
    offsets_ns: Vec<i64>,
    points_in_sensor_m: Vec<[f32; 3]>,
    poses: Vec<Isometry3<f64>>,
}

/// How one run's poses are found within one scan.
#[derive(Debug, Clone, Copy)]
enum ScanPose {
    /// One pose for the whole scan.
    Rigid(Isometry3<f64>),
    /// Each return at its own time after this instant, nanoseconds.
    After(i64),
}

impl<'a> Poser<'a> {
    pub(crate) fn new(runs: &'a [RunPoses<'a>], filter: &'a ReturnFilter) -> Self {
        let cursors = runs.iter().map(|run| run.track.cursor()).collect();
        let rays = vec![Vec::new(); runs.len()];
        let (offsets_ns, points_in_sensor_m) = (Vec::new(), Vec::new());
        Self { filter, runs, cursors, rays, offsets_ns, points_in_sensor_m, poses: Vec::new() }
    }

    /// Gives `each` the rays of the scan's used returns, block by block: one list for every run, the
    /// same returns in all of them. Every return of the scan is counted in the answer.
    pub(crate) fn blocks<E>(
        &mut self,
        frame: &PlannedFrame,
        scan: &Scan,
        mut each: impl FnMut(&[Vec<Ray>]) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        self.blocks_with_returns(frame, scan, |rays, _| each(rays))
    }

    /// The same with what else is known of each return.
    pub(crate) fn blocks_with_returns<E>(
        &mut self,
        frame: &PlannedFrame,
        scan: &Scan,
        mut each: impl FnMut(&[Vec<Ray>], Returns<'_>) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        let mut counts = ReturnCounts::default();
        let scan_poses: Option<Vec<ScanPose>> =
            self.runs.iter().map(|run| run.of_scan(frame, scan)).collect();
        let Some(scan_poses) = scan_poses else {
            counts.add_dropped(DropReason::NoPose, scan.len() as u64);
            return Ok(counts);
        };
        let block_returns = (BLOCK_RAYS / self.runs.len().max(1)).max(MIN_BLOCK_RETURNS);
        self.clear();
        // The beams of a firing share their time, and so their poses.
        let mut posed_at_ns = None;
        for (index, &point) in scan.points_in_sensor_m.iter().enumerate() {
            if let Err(reason) = self.filter.check(point) {
                counts.add_dropped(reason, 1);
                if is_implausible(point) {
                    counts.add_implausible();
                }
                continue;
            }
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            if posed_at_ns != Some(offset_ns) {
                if !self.pose_returns(&scan_poses, offset_ns) {
                    posed_at_ns = None;
                    counts.add_dropped(DropReason::NoPose, 1);
                    continue;
                }
                posed_at_ns = Some(offset_ns);
            }
            counts.add_used();
            for (rays, pose) in self.rays.iter_mut().zip(&self.poses) {
                rays.push(Ray::of_return(pose, point));
            }
            self.offsets_ns.push(offset_ns);
            self.points_in_sensor_m.push(point);
            if self.rays[0].len() == block_returns {
                each(&self.rays, self.returns())?;
                self.clear();
            }
        }
        if !self.rays[0].is_empty() {
            each(&self.rays, self.returns())?;
        }
        Ok(counts)
    }

    fn clear(&mut self) {
        self.rays.iter_mut().for_each(Vec::clear);
        self.offsets_ns.clear();
        self.points_in_sensor_m.clear();
    }

    fn returns(&self) -> Returns<'_> {
        Returns { offsets_ns: &self.offsets_ns, points_in_sensor_m: &self.points_in_sensor_m }
    }

    /// Finds every run's pose of the returns at one time; `false` where a run has none.
    fn pose_returns(&mut self, scan_poses: &[ScanPose], offset_ns: i64) -> bool {
        self.poses.clear();
        for (cursor, scan_pose) in self.cursors.iter_mut().zip(scan_poses) {
            let pose = match *scan_pose {
                ScanPose::Rigid(pose) => Some(pose),
                ScanPose::After(stamp_ns) => {
                    stamp_ns.checked_add(offset_ns).and_then(|ns| cursor.world_from_sensor_at(ns))
                }
            };
            match pose {
                Some(pose) => self.poses.push(pose),
                None => return false,
            }
        }
        true
    }
}
