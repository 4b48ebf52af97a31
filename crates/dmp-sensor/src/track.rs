//! Where the sensor was at any instant.

use crate::Trajectory;
use crate::trajectory::{PlaceInTime, Span};
use nalgebra::Isometry3;

/// A trajectory as the sensor rides it: the extrinsic applied, gaps refused.
#[derive(Debug, Clone, Copy)]
pub struct Track<'a> {
    trajectory: &'a Trajectory,
    body_from_sensor: Isometry3<f64>,
    max_gap_ns: i64,
}

impl<'a> Track<'a> {
    /// The sensor at `body_from_sensor` on a body that follows `trajectory`; poses further apart than
    /// `max_gap_ns` are not interpolated between.
    pub fn new(trajectory: &'a Trajectory, body_from_sensor: Isometry3<f64>, max_gap_ns: i64) -> Self {
        Self { trajectory, body_from_sensor, max_gap_ns }
    }

    /// The trajectory behind it.
    pub fn trajectory(&self) -> &'a Trajectory {
        self.trajectory
    }

    /// The sensor's pose at an instant; `None` where [`Trajectory::world_from_body_at`] has none.
    pub fn world_from_sensor_at(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        Some(self.trajectory.world_from_body_at(stamp_ns, self.max_gap_ns)? * self.body_from_sensor)
    }

    /// The sensor's pose in the trajectory's line `index`; `None` beyond the last.
    pub fn world_from_sensor_of_line(&self, index: usize) -> Option<Isometry3<f64>> {
        Some(self.trajectory.poses().get(index)? * self.body_from_sensor)
    }

    /// A cursor that remembers the last answer, as the beams of one firing share their instant, and the two poses that it lay
    /// between, as the firings of a scan do.
    pub fn cursor(&self) -> TrackCursor<'a> {
        TrackCursor { track: *self, last: None, span: None }
    }
}

/// A [`Track`] with a memory of one instant and its two poses.
#[derive(Debug, Clone)]
pub struct TrackCursor<'a> {
    track: Track<'a>,
    last: Option<(i64, Option<Isometry3<f64>>)>,
    span: Option<Span>,
}

impl TrackCursor<'_> {
    /// As [`Track::world_from_sensor_at`].
    #[inline]
    pub fn world_from_sensor_at(&mut self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        match self.last {
            Some((last_ns, pose)) if last_ns == stamp_ns => pose,
            _ => {
                let pose = self.find(stamp_ns);
                self.last = Some((stamp_ns, pose));
                pose
            }
        }
    }

    fn find(&mut self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        let Track { trajectory, body_from_sensor, max_gap_ns } = self.track;
        let world_from_body = match self.span.filter(|span| span.holds(stamp_ns)) {
            Some(span) => span.world_from_body_at(stamp_ns),
            None => match trajectory.place_of(stamp_ns, max_gap_ns)? {
                PlaceInTime::Pose(pose) => pose,
                PlaceInTime::Within(span) => self.span.insert(span).world_from_body_at(stamp_ns),
            },
        };
        Some(world_from_body * body_from_sensor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(x: f64) -> Isometry3<f64> {
        Isometry3::translation(x, 0.0, 0.0)
    }

    #[test]
    fn a_cursor_answers_as_the_track_does() {
        let run =
            Trajectory::stamped(vec![(100, Isometry3::identity()), (200, pose(1.0))]).unwrap().trajectory;
        let track = Track::new(&run, pose(0.5), 1000);
        let mut cursor = track.cursor();
        for stamp_ns in [150, 150, 99, 99, 180, 100, 101, 200, 199, 201, 160] {
            assert_eq!(cursor.world_from_sensor_at(stamp_ns), track.world_from_sensor_at(stamp_ns));
        }
    }
}
