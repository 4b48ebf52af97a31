//! Where the sensor is, and what that changes with what is looked for.

use dmp_sensor::{
    Isometry3, Plane, PosedReturn, Track, TrackCursor, Trajectory, Translation3, UnitQuaternion, Vector3,
    point_to_plane,
};

use crate::calibrate::axis::{AXES, Axis, Vector};
use crate::calibrate::sample::Snapshot;

/// A run's poses on the log's clock, and where the sensor sits on the body that they move.
#[derive(Debug, Clone, Copy)]
pub struct Mount<'a> {
    /// The poses.
    pub trajectory: &'a Trajectory,
    /// Where the sensor sits.
    pub body_from_sensor: Isometry3<f64>,
    /// Poses further apart are not interpolated between, nanoseconds.
    pub max_gap_ns: i64,
    /// How much later its stamps are than those of the scans of its lines, nanoseconds: for a log whose scans have none.
    pub later_than_lines_ns: i64,
}

impl Mount<'_> {
    /// When a scan was made: at its stamp, or where the log has none, at that of its line in this run.
    pub(crate) fn stamp_ns(&self, scan: &Snapshot) -> Option<i64> {
        let of_line = || self.trajectory.stamps_ns()?.get(scan.number)?.checked_sub(self.later_than_lines_ns);
        scan.stamp_ns.or_else(of_line)
    }
}

/// The errors that are tried, in units of [`Axis::step`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trial<'a> {
    pub(crate) mount: Mount<'a>,
    track: Track<'a>,
    later_s: f64,
    sweep: f64,
    /// To either side of an instant, for the velocity there, seconds.
    half_s: f64,
}

/// The sensor at one instant, and how it moves there: as a body of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    world_from_sensor: Isometry3<f64>,
    velocity_m_s: Vector3<f64>,
    turn_rate_rad_s: Vector3<f64>,
}

impl<'a> Trial<'a> {
    pub(crate) fn new(mount: &Mount<'a>, steps: &Vector, metre_m: f64) -> Self {
        let value = |k: usize| steps[k] * Axis::ALL[k].step(metre_m);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(value(2), value(3), value(4)));
        let shift_m = Vector3::new(value(5), value(6), value(7));
        let body_from_sensor =
            mount.body_from_sensor * Isometry3::from_parts(Translation3::from(shift_m), turn);
        // Between poses the velocity is that from one to the next; over a whole interval noise of single poses weighs
        // as much on one side as on the other.
        let usual_s = mount.trajectory.usual_step_ns() as f64 / 1e9;
        Self {
            mount: *mount,
            track: Track::new(mount.trajectory, body_from_sensor, mount.max_gap_ns),
            later_s: value(0),
            sweep: 1.0 + value(1),
            half_s: (0.5 * usual_s).clamp(0.005, 0.1),
        }
    }

    /// For the instants before, at and after those of returns, which follow each other.
    pub(crate) fn cursors(&self) -> [TrackCursor<'a>; 3] {
        [(); 3].map(|()| self.track.cursor())
    }

    /// The sensor when it measured a return so long after the stamp of its scan; `None` where the run does not say.
    pub(crate) fn at(
        &self,
        [before, now, after]: &mut [TrackCursor<'a>; 3],
        stamp_ns: i64,
        after_ns: i64,
    ) -> Option<Moment> {
        let after_s = self.sweep * (after_ns as f64 / 1e9) + self.later_s;
        let at = |cursor: &mut TrackCursor<'a>, s: f64| {
            cursor.world_from_sensor_at(stamp_ns.checked_add((s * 1e9).round() as i64)?)
        };
        let (before, after) = (at(before, after_s - self.half_s)?, at(after, after_s + self.half_s)?);
        let per_s = 0.5 / self.half_s;
        Some(Moment {
            world_from_sensor: at(now, after_s)?,
            velocity_m_s: (after.translation.vector - before.translation.vector) * per_s,
            turn_rate_rad_s: (after.rotation * before.rotation.inverse()).scaled_axis() * per_s,
        })
    }
}

impl Moment {
    pub(crate) fn place(&self, in_sensor_m: &Vector3<f64>) -> Vector3<f64> {
        self.world_from_sensor.translation.vector + self.world_from_sensor.rotation * in_sensor_m
    }

    /// How far a return moves along `normal` with one unit of each axis.
    pub(crate) fn gradient(
        &self,
        in_sensor_m: &Vector3<f64>,
        after_ns: i64,
        normal: &Vector3<f64>,
        metre_m: f64,
    ) -> [f64; AXES] {
        let posed = PosedReturn {
            world_from_body: self.world_from_sensor,
            body_from_sensor: Isometry3::identity(),
            velocity_m_s: self.velocity_m_s,
            turn_rate_rad_s: self.turn_rate_rad_s,
            point_in_sensor_m: *in_sensor_m,
        };
        let plane = Plane { mean_m: self.world_from_sensor.translation.vector, normal: *normal };
        let moved = point_to_plane(&posed, &plane);
        let [time, sweep, angle, .., length] = Axis::ALL.map(|axis| axis.step(metre_m));
        let [roll, pitch, yaw, x, y, z] = moved.by_extrinsic.into();
        [
            moved.by_time_m_s * time,
            moved.by_time_m_s * (after_ns as f64 / 1e9) * sweep,
            roll * angle,
            pitch * angle,
            yaw * angle,
            x * length,
            y * length,
            z * length,
        ]
    }
}
