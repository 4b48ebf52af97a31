use dmp_sensor::{DropReason, Isometry3, Ray, ReturnCounts, Scan, TrackCursor};

use crate::config::{Config, Run};
use crate::plan::{Pairing, Plan, PlannedFrame};

/// Returns handled at a time: bounds the memory of a thread however large a scan is.
const BLOCK_RETURNS: usize = 1 << 14;

/// Turns scans into rays, one for every run and every return that is used.
#[derive(Debug)]
pub(crate) struct Poser<'a> {
    plan: &'a Plan,
    cursors: Vec<TrackCursor<'a>>,
    config: &'a Config,
    runs: &'a [Run],
    rays: Vec<Vec<Ray>>,
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
    pub(crate) fn new(plan: &'a Plan, runs: &'a [Run], config: &'a Config) -> Self {
        let cursors = plan.tracks(runs, config).iter().map(dmp_sensor::Track::cursor).collect();
        Self { plan, cursors, config, runs, rays: vec![Vec::new(); runs.len()], poses: Vec::new() }
    }

    /// Gives `each` the rays of the scan's used returns, block by block: one list for every run, the
    /// same returns in all of them. Every return of the scan is counted in the answer.
    pub(crate) fn blocks<E>(
        &mut self,
        frame: &PlannedFrame,
        scan: &Scan,
        mut each: impl FnMut(&[Vec<Ray>]) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        let mut counts = ReturnCounts::default();
        let Some(scan_poses) = self.scan_poses(frame, scan) else {
            counts.add_dropped(DropReason::NoPose, scan.len() as u64);
            return Ok(counts);
        };
        self.clear();
        for (index, &point) in scan.points_in_sensor_m.iter().enumerate() {
            if let Err(reason) = self.plan.filter.check(point) {
                counts.add_dropped(reason, 1);
                continue;
            }
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            if !self.pose_return(&scan_poses, offset_ns) {
                counts.add_dropped(DropReason::NoPose, 1);
                continue;
            }
            counts.add_used();
            for (rays, pose) in self.rays.iter_mut().zip(&self.poses) {
                rays.push(Ray::of_return(pose, point));
            }
            if self.rays[0].len() == BLOCK_RETURNS {
                each(&self.rays)?;
                self.clear();
            }
        }
        if !self.rays[0].is_empty() {
            each(&self.rays)?;
        }
        Ok(counts)
    }

    fn clear(&mut self) {
        self.rays.iter_mut().for_each(Vec::clear);
    }

    /// How each run's poses are found within the scan; `None` where a run has none for it.
    fn scan_poses(&self, frame: &PlannedFrame, scan: &Scan) -> Option<Vec<ScanPose>> {
        let timed = !scan.time_offsets_ns.is_empty();
        let of_run = |(run, pairing): (usize, &Pairing)| match pairing {
            Pairing::ByStamp => Some(ScanPose::After(frame.stamp_ns?)),
            Pairing::ByLine => {
                let trajectory = &self.runs[run].trajectory;
                match trajectory.stamps_ns() {
                    Some(stamps) if timed => Some(ScanPose::After(*stamps.get(frame.frame)?)),
                    _ => {
                        let pose = trajectory.poses().get(frame.frame)?;
                        Some(ScanPose::Rigid(pose * self.config.body_from_sensor))
                    }
                }
            }
        };
        self.plan.pairings.iter().enumerate().map(of_run).collect()
    }

    /// Finds every run's pose of one return; `false` where a run has none.
    #[inline]
    fn pose_return(&mut self, scan_poses: &[ScanPose], offset_ns: i64) -> bool {
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
