//! Converts returns into rays, in each run.

use dmp_sensor::{
    DropReason, Isometry3, Matrix3, Ray, ReturnCounts, ReturnFilter, Scan, TrackCursor, Vector3,
    is_implausible,
};

use crate::asked::ReturnDraw;
use crate::runs::frame::PlannedFrame;
use crate::runs::known_poses::KnownPoses;
use crate::runs::path::RunPath;
use crate::runs::run_poses::{RunPoses, ScanPose};

/// Returns processed at a time, over all runs: limits the memory of a thread for any size of scan and number
/// of runs. No number depends on it.
pub const BLOCK_RAYS: usize = 28 << 10;
/// Least returns of a block, for any number of runs.
pub const MIN_BLOCK_RETURNS: usize = 1 << 10;

/// What a return is made into in a run.
pub trait OfReturn: Sized {
    /// Appends what these points in the sensor frame, metres, are at one pose.
    fn append(all: &mut Vec<Self>, world_from_sensor: &Isometry3<f64>, points_in_sensor_m: &[[f32; 3]]);
}

impl OfReturn for Ray {
    fn append(all: &mut Vec<Self>, world_from_sensor: &Isometry3<f64>, points_in_sensor_m: &[[f32; 3]]) {
        all.extend(points_in_sensor_m.iter().map(|&point| Self::of_return(world_from_sensor, point)));
    }
}

/// Where a return lies in the world, metres.
pub type WorldPoint = [f64; 3];

impl OfReturn for WorldPoint {
    fn append(all: &mut Vec<Self>, world_from_sensor: &Isometry3<f64>, points_in_sensor_m: &[[f32; 3]]) {
        let (rotation, origin) =
            (world_from_sensor.rotation.to_rotation_matrix(), world_from_sensor.translation.vector);
        let placed = |point: &[f32; 3]| Self::from(rotation * Vector3::from(point.map(f64::from)) + origin);
        all.extend(points_in_sensor_m.iter().map(placed));
    }
}

/// Some used returns of a scan, the same for every run.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a, R = Ray> {
    runs: &'a [RunCursor<'a, R>],
    /// Time of each after the scan's stamp, nanoseconds.
    pub offsets_ns: &'a [i64],
    /// In the sensor frame, metres.
    pub points_in_sensor_m: &'a [[f32; 3]],
}

impl<R> Block<'_, R> {
    /// The rays, or points, of the returns in one run, as many as [`Self::is_posed`] says are any; none where it has no pose for the
    /// scan.
    pub fn rays(&self, run: usize) -> &[R] {
        &self.runs[run].rays
    }

    /// For each of these rays whether the run has a pose at its time.
    pub fn is_posed(&self, run: usize) -> &[bool] {
        &self.runs[run].is_posed
    }

    /// Those for which the run has a pose, with the numbers of the returns.
    pub fn posed(&self, run: usize) -> impl Iterator<Item = (usize, &R)> {
        let rays = self.rays(run).iter().enumerate();
        rays.zip(self.is_posed(run)).filter_map(|(ray, &is_posed)| is_posed.then_some(ray))
    }

    /// Number of returns.
    pub fn returns(&self) -> usize {
        self.offsets_ns.len()
    }
}

/// The drawn returns of a scan.
#[derive(Debug, Clone, Copy)]
pub enum Drawn<'a> {
    /// Those that are to be drawn of a whole scan.
    Of(&'a Scan),
    /// All of `scan`: they were drawn before, of a scan of so many.
    Already {
        /// The drawn returns in their order.
        scan: &'a Scan,
        /// Returns of the whole scan.
        of: u64,
    },
}

/// Converts scans into rays, or points in the world: one for every run and every used return.
#[derive(Debug)]
pub struct Poser<'a, R = Ray> {
    filter: &'a ReturnFilter,
    one_in: u64,
    draw: ReturnDraw,
    runs: Vec<RunCursor<'a, R>>,
    known: KnownPoses,
    offsets_ns: Vec<i64>,
    points_in_sensor_m: Vec<[f32; 3]>,
}

/// The state of one run.
#[derive(Debug)]
struct RunCursor<'a, R> {
    poses: &'a RunPoses,
    path: &'a RunPath,
    cursor: TrackCursor<'a>,
    /// How poses are found in the current scan, and the pose of the current returns; `None` without any.
    of_scan: Option<ScanPose>,
    world_from_sensor: Option<Isometry3<f64>>,
    /// For the current block.
    rays: Vec<R>,
    is_posed: Vec<bool>,
}

impl<'a, R: OfReturn> Poser<'a, R> {
    /// For some runs; `filter` says which returns are used.
    pub fn new(
        runs: impl IntoIterator<Item = (&'a RunPoses, &'a RunPath)>,
        filter: &'a ReturnFilter,
    ) -> Self {
        let posed = |(poses, path): (&'a RunPoses, &'a RunPath)| RunCursor {
            poses,
            path,
            cursor: poses.track().cursor(),
            of_scan: None,
            world_from_sensor: None,
            rays: Vec::new(),
            is_posed: Vec::new(),
        };
        let runs = runs.into_iter().map(posed).collect();
        Self {
            filter,
            one_in: 1,
            draw: ReturnDraw::ALL,
            runs,
            known: KnownPoses::default(),
            offsets_ns: Vec::new(),
            points_in_sensor_m: Vec::new(),
        }
    }

    /// The same for one return in so many, drawn by its coordinates; the others cost little and are not counted.
    #[must_use]
    pub fn taking_one_in(self, one_in: u64) -> Self {
        Self { one_in: one_in.max(1), ..self }
    }

    /// The same for the returns that are drawn.
    #[must_use]
    pub fn drawing(self, draw: ReturnDraw) -> Self {
        Self { draw, ..self }
    }

    /// Passes `each` the used returns of the scan with this ordinal, block by block, if some run has a pose for it. The
    /// returned counts cover every return of the scan.
    ///
    /// # Errors
    /// The first of `each`.
    pub fn blocks<E>(
        &mut self,
        frame: (usize, &PlannedFrame),
        scan: &Scan,
        each: impl FnMut(Block<'_, R>) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        self.blocks_of(frame, Drawn::Of(scan), each)
    }

    /// The same where the returns may have been drawn before.
    ///
    /// # Errors
    /// The first of `each`.
    pub fn blocks_of<E>(
        &mut self,
        (ordinal, frame): (usize, &PlannedFrame),
        drawn: Drawn<'_>,
        each: impl FnMut(Block<'_, R>) -> Result<(), E>,
    ) -> Result<ReturnCounts, E> {
        let (scan, of, draw) = match drawn {
            Drawn::Of(scan) => (scan, scan.len() as u64, self.draw),
            Drawn::Already { scan, of } => (scan, of, ReturnDraw::ALL),
        };
        let mut counts = ReturnCounts::default();
        if !self.begin(ordinal, frame) {
            counts.add_dropped(DropReason::NoPose, of);
            return Ok(counts);
        }
        let drawn = self.each_block(draw.of_scan(frame.number, scan.len()), scan, &mut counts, each)?;
        counts.add_dropped(DropReason::NotDrawn, of - drawn);
        Ok(counts)
    }

    /// Passes `each` the used returns at these places of a scan; returns the number of places.
    fn each_block<E>(
        &mut self,
        places: impl Iterator<Item = usize>,
        scan: &Scan,
        counts: &mut ReturnCounts,
        mut each: impl FnMut(Block<'_, R>) -> Result<(), E>,
    ) -> Result<u64, E> {
        let block_returns = (BLOCK_RAYS / self.runs.len().max(1)).max(MIN_BLOCK_RETURNS);
        self.clear();
        self.known.clear();
        // The beams of a firing share their time and thus their poses.
        let mut posed_at_ns = None;
        let mut drawn = 0;
        for index in places {
            drawn += 1;
            let point = scan.points_in_sensor_m[index];
            if self.one_in > 1 && !drawn_by(point).is_multiple_of(self.one_in) {
                continue;
            }
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
                self.move_to(offset_ns);
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
        Ok(drawn)
    }

    /// Looks up how each run poses the scan; returns whether any does.
    fn begin(&mut self, ordinal: usize, frame: &PlannedFrame) -> bool {
        for run in &mut self.runs {
            run.of_scan = if run.path.has(ordinal) { run.poses.of_scan(frame) } else { None };
        }
        self.runs.iter().any(|run| run.of_scan.is_some())
    }

    /// Passes `each` the positions of some used returns of the scan in each run, metres in the frames of
    /// `own_from_world`, and the number of the run; runs without such a frame are skipped. Only returns whose
    /// index `is_drawn` are used; the others cost nothing.
    pub fn endpoints(
        &mut self,
        (ordinal, frame): (usize, &PlannedFrame),
        scan: &Scan,
        own_from_world: &[Option<Isometry3<f64>>],
        is_drawn: impl Fn(usize) -> bool,
        mut each: impl FnMut(usize, [f64; 3]),
    ) {
        self.begin(ordinal, frame);
        let mut posed_at_ns = None;
        let mut own_from_sensor: Vec<(usize, Matrix3<f64>, Vector3<f64>)> = Vec::new();
        let drawn = scan.points_in_sensor_m.iter().enumerate().filter(|&(index, _)| is_drawn(index));
        for (index, &point) in drawn.filter(|&(_, &point)| self.filter.check(point).is_ok()) {
            let offset_ns = scan.time_offsets_ns.get(index).copied().unwrap_or(0);
            if posed_at_ns != Some(offset_ns) {
                posed_at_ns = Some(offset_ns);
                own_from_sensor.clear();
                let posed = self.runs.iter_mut().zip(own_from_world).enumerate();
                own_from_sensor.extend(posed.filter_map(|(number, (run, own_from_world))| {
                    let pose = (*own_from_world)? * run.pose_at(offset_ns)?;
                    Some((number, *pose.rotation.to_rotation_matrix().matrix(), pose.translation.vector))
                }));
            }
            let in_sensor = Vector3::from(point.map(f64::from));
            for (run, rotation, translation) in &own_from_sensor {
                each(*run, (rotation * in_sensor + translation).into());
            }
        }
    }

    /// Moves the runs to this time after the scan's stamp.
    fn move_to(&mut self, offset_ns: i64) {
        if let Some(poses) = self.known.of(offset_ns) {
            self.runs.iter_mut().zip(poses).for_each(|(run, pose)| run.world_from_sensor = *pose);
            return;
        }
        self.runs.iter_mut().for_each(|run| run.world_from_sensor = run.pose_at(offset_ns));
        self.known.keep(offset_ns, self.runs.iter().map(|run| run.world_from_sensor));
    }

    /// Computes the rays of the new points, all at the current poses: those of a firing in one loop.
    fn pose_points(&mut self) {
        for run in self.runs.iter_mut().filter(|run| run.of_scan.is_some()) {
            let points = &self.points_in_sensor_m[run.rays.len()..];
            // A return without a pose has a ray all the same, which nobody takes.
            let pose = run.world_from_sensor.unwrap_or_default();
            R::append(&mut run.rays, &pose, points);
            run.is_posed.resize(run.rays.len(), run.world_from_sensor.is_some());
        }
    }

    fn clear(&mut self) {
        for run in &mut self.runs {
            run.rays.clear();
            run.is_posed.clear();
        }
        self.offsets_ns.clear();
        self.points_in_sensor_m.clear();
    }

    fn block(&self) -> Block<'_, R> {
        let Self { runs, offsets_ns, points_in_sensor_m, .. } = self;
        Block { runs, offsets_ns, points_in_sensor_m }
    }
}

/// A number that is as good as random, of the cell of 0.1 m that a point is in: neither its place in the scan nor the
/// rounding of a file changes what is drawn.
pub fn drawn_by(point: [f32; 3]) -> u64 {
    let mix = |hash: u64, c: &f32| {
        let cell = (c * 10.0).floor() as i32 as u32;
        (hash ^ u64::from(cell)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
    };
    point.iter().fold(0, mix) >> 20
}

impl<R> RunCursor<'_, R> {
    /// The pose of the returns at this time after the scan's stamp.
    fn pose_at(&mut self, offset_ns: i64) -> Option<Isometry3<f64>> {
        match self.of_scan? {
            ScanPose::Rigid(pose) => Some(pose),
            ScanPose::After(stamp_ns) => self.cursor.world_from_sensor_at(stamp_ns.checked_add(offset_ns)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seventh_is_drawn_evenly_whatever_the_rounding() {
        // Beams of 0.4 deg around a sensor: as many of each ring, near and far.
        let point = |k: u32| {
            let (bearing, up, range_m) =
                (f64::from(k) * 0.0017, f64::from(k % 64) * 0.007 - 0.3, 3.0 + f64::from(k % 97) * 0.4);
            [bearing.cos() * range_m, bearing.sin() * range_m, up * range_m].map(|c| c as f32)
        };
        let is_drawn = |point: [f32; 3]| drawn_by(point).is_multiple_of(7);
        let (mut drawn, mut otherwise, mut rings) = (0, 0, [0; 8]);
        for k in 0..50_000 {
            let rounded = point(k).map(|c| (c * 1e4).round() / 1e4);
            drawn += u32::from(is_drawn(point(k)));
            rings[k as usize % 8] += u32::from(is_drawn(point(k)));
            otherwise += u32::from(is_drawn(point(k)) != is_drawn(rounded));
        }
        assert!(drawn.abs_diff(50_000 / 7) < 300, "{drawn}");
        assert!(rings.iter().all(|ring| ring.abs_diff(50_000 / 56) < 120), "{rings:?}");
        assert!(otherwise < 50, "{otherwise} changed by rounding to 0.1 mm");
    }
}
