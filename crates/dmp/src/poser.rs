//! Converts returns into rays, in each run.

use dmp_cast::Query;
use dmp_sensor::{
    DropReason, Isometry3, Matrix3, Ray, ReturnCounts, ReturnFilter, Scan, TrackCursor, Vector3,
    is_implausible,
};

use crate::frames::PlannedFrame;
use crate::known_poses::KnownPoses;
use crate::memory::{BLOCK_RAYS, MIN_BLOCK_RETURNS};
use crate::run_poses::{RunPoses, ScanPose};

/// Some used returns of a scan, the same in every run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block<'a> {
    runs: &'a [PosedRun<'a>],
    /// Time of each after the scan's stamp, nanoseconds.
    pub(crate) offsets_ns: &'a [i64],
    /// In the sensor frame, metres.
    pub(crate) points_in_sensor_m: &'a [[f32; 3]],
}

impl Block<'_> {
    /// The rays of the returns in one run.
    pub(crate) fn rays(&self, run: usize) -> &[Ray] {
        &self.runs[run].rays
    }

    /// Number of returns.
    pub(crate) fn len(&self) -> usize {
        self.offsets_ns.len()
    }
}

/// Converts scans into rays, one for every run and every used return.
#[derive(Debug)]
pub(crate) struct Poser<'a> {
    filter: &'a ReturnFilter,
    runs: Vec<PosedRun<'a>>,
    known: KnownPoses,
    offsets_ns: Vec<i64>,
    points_in_sensor_m: Vec<[f32; 3]>,
}

/// The state of one run.
#[derive(Debug)]
struct PosedRun<'a> {
    poses: &'a RunPoses,
    cursor: TrackCursor<'a>,
    /// How poses are found in the current scan, and the pose of the current returns.
    of_scan: ScanPose,
    world_from_sensor: Isometry3<f64>,
    /// For the current block.
    rays: Vec<Ray>,
}

impl<'a> Poser<'a> {
    pub(crate) fn new(runs: impl IntoIterator<Item = &'a RunPoses>, filter: &'a ReturnFilter) -> Self {
        let unknown = Isometry3::identity();
        let posed = |poses: &'a RunPoses| PosedRun {
            poses,
            cursor: poses.track().cursor(),
            of_scan: ScanPose::Rigid(unknown),
            world_from_sensor: unknown,
            rays: Vec::new(),
        };
        let runs = runs.into_iter().map(posed).collect();
        Self {
            filter,
            runs,
            known: KnownPoses::default(),
            offsets_ns: Vec::new(),
            points_in_sensor_m: Vec::new(),
        }
    }

    /// Passes `each` the scan's used returns, block by block. The returned counts cover every return of the
    /// scan.
    pub(crate) fn blocks<E>(
        &mut self,
        frame: &PlannedFrame,
        scan: &Scan,
        mut each: impl FnMut(Block<'_>) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        let mut counts = ReturnCounts::default();
        for run in &mut self.runs {
            let Some(of_scan) = run.poses.of_scan(frame) else {
                counts.add_dropped(DropReason::NoPose, scan.len() as u64);
                return Ok(counts);
            };
            run.of_scan = of_scan;
        }
        let block_returns = (BLOCK_RAYS / self.runs.len().max(1)).max(MIN_BLOCK_RETURNS);
        self.clear();
        self.known.clear();
        // The beams of a firing share their time and thus their poses.
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
                self.pose_points();
                if !self.move_to(offset_ns) {
                    posed_at_ns = None;
                    counts.add_dropped(DropReason::NoPose, 1);
                    continue;
                }
                posed_at_ns = Some(offset_ns);
            }
            counts.add_used();
            self.offsets_ns.push(offset_ns);
            self.points_in_sensor_m.push(point);
            if self.offsets_ns.len() == block_returns {
                self.pose_points();
                each(self.block())?;
                self.clear();
            }
        }
        if !self.offsets_ns.is_empty() {
            self.pose_points();
            each(self.block())?;
        }
        Ok(counts)
    }

    /// Passes `each` the positions of some used returns of the scan in each run, metres in the frames of
    /// `own_from_world`, and the number of the run; runs without such a frame are skipped. Only returns whose
    /// index `is_drawn` are used; the others cost nothing.
    pub(crate) fn endpoints(
        &mut self,
        frame: &PlannedFrame,
        scan: &Scan,
        own_from_world: &[Option<Isometry3<f64>>],
        is_drawn: impl Fn(usize) -> bool,
        mut each: impl FnMut(usize, [f64; 3]),
    ) {
        for run in &mut self.runs {
            let Some(of_scan) = run.poses.of_scan(frame) else { return };
            run.of_scan = of_scan;
        }
        let mut posed_at_ns = None;
        let mut own_from_sensor: Vec<(usize, Matrix3<f64>, Vector3<f64>)> = Vec::new();
        let drawn = scan.points_in_sensor_m.iter().enumerate().filter(|&(index, _)| is_drawn(index));
        for (index, &point) in drawn.filter(|&(_, &point)| self.filter.check(point).is_ok()) {
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            if posed_at_ns != Some(offset_ns) {
                posed_at_ns = Some(offset_ns);
                own_from_sensor.clear();
                if self.runs.iter_mut().all(|run| run.move_to(offset_ns)) {
                    let posed = self.runs.iter().zip(own_from_world).enumerate();
                    own_from_sensor.extend(posed.filter_map(|(number, (run, own_from_world))| {
                        let pose = (*own_from_world)? * run.world_from_sensor;
                        Some((number, *pose.rotation.to_rotation_matrix().matrix(), pose.translation.vector))
                    }));
                }
            }
            let in_sensor = Vector3::from(point.map(f64::from));
            for (run, rotation, translation) in &own_from_sensor {
                each(*run, (rotation * in_sensor + translation).into());
            }
        }
    }

    /// Moves the runs to this time after the scan's stamp; `false` if one has no pose there.
    fn move_to(&mut self, offset_ns: i64) -> bool {
        if let Some(poses) = self.known.of(offset_ns) {
            self.runs.iter_mut().zip(poses).for_each(|(run, pose)| run.world_from_sensor = *pose);
            return true;
        }
        let is_found = self.runs.iter_mut().all(|run| run.move_to(offset_ns));
        if is_found {
            self.known.keep(offset_ns, self.runs.iter().map(|run| run.world_from_sensor));
        }
        is_found
    }

    /// Computes the rays of the new points, all at the current poses: those of a firing in one loop.
    fn pose_points(&mut self) {
        for run in &mut self.runs {
            let (pose, posed) = (run.world_from_sensor, run.rays.len());
            let points = &self.points_in_sensor_m[posed..];
            run.rays.extend(points.iter().map(|&point| Ray::of_return(&pose, point)));
        }
    }

    fn clear(&mut self) {
        self.runs.iter_mut().for_each(|run| run.rays.clear());
        self.offsets_ns.clear();
        self.points_in_sensor_m.clear();
    }

    fn block(&self) -> Block<'_> {
        let Self { runs, offsets_ns, points_in_sensor_m, .. } = self;
        Block { runs, offsets_ns, points_in_sensor_m }
    }
}

impl PosedRun<'_> {
    /// Finds the pose of the returns at this time after the scan's stamp; `false` if there is none.
    fn move_to(&mut self, offset_ns: i64) -> bool {
        let pose = match self.of_scan {
            ScanPose::Rigid(pose) => Some(pose),
            ScanPose::After(stamp_ns) => {
                stamp_ns.checked_add(offset_ns).and_then(|ns| self.cursor.world_from_sensor_at(ns))
            }
        };
        pose.is_some_and(|pose| {
            self.world_from_sensor = pose;
            true
        })
    }
}

/// The query along a ray; `segment` is that in which the return was measured, for maps with segments.
pub(crate) fn query_of(ray: &Ray, segment: Option<i32>) -> Query {
    Query {
        origin_in_world_m: ray.origin_in_world,
        direction_in_world: ray.direction_in_world,
        measured_m: ray.range_m,
        segment,
    }
}
