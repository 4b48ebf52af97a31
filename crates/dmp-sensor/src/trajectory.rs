//! Where the body was.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use crate::between::{Between, pose_between};

/// Where the body was in the world: poses `world_from_body`, with stamps in nanoseconds or, for formats
/// without any, in the order of the scans.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Trajectory {
    stamps_ns: Option<Vec<i64>>,
    world_from_body: Vec<Isometry3<f64>>,
}

/// What had to be fixed in a stamped trajectory before it could be used.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRepairs {
    /// The trajectory in order of time, one pose an instant.
    pub trajectory: Trajectory,
    /// Poses whose stamp was smaller than the one before them.
    pub out_of_order: usize,
    /// Repeated poses (same stamp, same pose) that were left out.
    pub repeated: usize,
}

/// What makes a list of poses unusable.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// There is no pose at all.
    #[error("the trajectory has no poses")]
    Empty,
    /// One instant, two places: probably two runs in one file.
    #[error(
        "two different poses have the same stamp {}.{:09} s ({apart_m:.3} m apart): does the file hold two runs, or does its \
         clock jump back?",
        .stamp_ns.div_euclid(1_000_000_000),
        .stamp_ns.rem_euclid(1_000_000_000)
    )]
    Contradiction {
        /// The stamp that occurs twice.
        stamp_ns: i64,
        /// Distance between the two places, metres.
        apart_m: f64,
    },
}

impl Trajectory {
    /// A trajectory with stamps. Unsorted poses are sorted and exact repetitions left out; both are
    /// counted in the answer.
    ///
    /// # Errors
    /// When there is no pose, or when one stamp has two poses more than 1 mm or 1 mrad apart.
    pub fn stamped(mut poses: Vec<(i64, Isometry3<f64>)>) -> Result<TrajectoryRepairs, TrajectoryError> {
        if poses.is_empty() {
            return Err(TrajectoryError::Empty);
        }
        let out_of_order = poses.windows(2).filter(|pair| pair[1].0 < pair[0].0).count();
        poses.sort_by_key(|pose| pose.0);
        for pair in poses.windows(2) {
            if pair[0].0 == pair[1].0 {
                let apart_m = (pair[0].1.translation.vector - pair[1].1.translation.vector).norm();
                if apart_m > 1e-3 || pair[0].1.rotation.angle_to(&pair[1].1.rotation) > 1e-3 {
                    return Err(TrajectoryError::Contradiction { stamp_ns: pair[0].0, apart_m });
                }
            }
        }
        let before = poses.len();
        poses.dedup_by_key(|pose| pose.0);
        let repeated = before - poses.len();
        let (stamps_ns, world_from_body) = poses.into_iter().unzip();
        let trajectory = Self { stamps_ns: Some(stamps_ns), world_from_body };
        Ok(TrajectoryRepairs { trajectory, out_of_order, repeated })
    }

    /// A trajectory without stamps: the n-th pose belongs to the n-th scan.
    ///
    /// # Errors
    /// When there is no pose.
    pub fn unstamped(world_from_body: Vec<Isometry3<f64>>) -> Result<Self, TrajectoryError> {
        if world_from_body.is_empty() {
            return Err(TrajectoryError::Empty);
        }
        Ok(Self { stamps_ns: None, world_from_body })
    }

    /// The same poses seen from the first of them.
    ///
    /// A trajectory that was moved as a whole gives the same answer, to the last bit where the motion was exact: a
    /// translation that rounded nothing, or half a turn about an axis.
    #[must_use]
    pub fn from_its_start(&self) -> Self {
        let start = self.world_from_body[0];
        let world_from_body = self.world_from_body.iter().map(|pose| seen_from(&start, pose)).collect();
        Self { stamps_ns: self.stamps_ns.clone(), world_from_body }
    }

    /// The same poses with a motion behind them: `new_from_world` takes places of the world into the new one.
    #[must_use]
    pub fn moved(&self, new_from_world: &Isometry3<f64>) -> Self {
        let world_from_body = self.world_from_body.iter().map(|pose| new_from_world * pose).collect();
        Self { stamps_ns: self.stamps_ns.clone(), world_from_body }
    }

    /// The same poses `shift_ns` later; `None` where that is beyond all times.
    #[must_use]
    pub fn later_by(mut self, shift_ns: i64) -> Option<Self> {
        for stamp_ns in self.stamps_ns.iter_mut().flatten() {
            *stamp_ns = stamp_ns.checked_add(shift_ns)?;
        }
        Some(self)
    }

    /// Stamps in nanoseconds, strictly increasing; `None` where the format has none.
    pub fn stamps_ns(&self) -> Option<&[i64]> {
        self.stamps_ns.as_deref()
    }

    /// The poses, `world_from_body`, in order.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.world_from_body
    }

    /// Number of poses; at least one.
    #[expect(clippy::len_without_is_empty, reason = "a trajectory is never empty")]
    pub fn len(&self) -> usize {
        self.world_from_body.len()
    }

    /// The longest gap between poses that is interpolated over where nothing else is said, nanoseconds: a
    /// second, or three times the median interval where that is longer.
    pub fn usual_gap_ns(&self) -> i64 {
        const SECOND_NS: i64 = 1_000_000_000;
        self.usual_step_ns().saturating_mul(3).max(SECOND_NS)
    }

    /// How far poses are off from the path between their neighbours: root of the mean square, metres; a rotation counts at
    /// this distance. 0 without stamps.
    pub fn jitter_m(&self, reach_m: f64) -> f64 {
        let stamps_ns = self.stamps_ns().unwrap_or_default();
        let (mut squares_m2, mut count) = (0.0, 0.0);
        for (three, at_ns) in self.poses().windows(3).zip(stamps_ns.windows(3)) {
            let share = (at_ns[1] - at_ns[0]) as f64 / (at_ns[2] - at_ns[0]) as f64;
            let between = pose_between(&three[0], &three[2], share);
            let off_m = (three[1].translation.vector - between.translation.vector).norm()
                + reach_m * between.rotation.angle_to(&three[1].rotation);
            squares_m2 += off_m * off_m;
            count += 1.0;
        }
        if count > 0.0 { f64::sqrt(squares_m2 / count) } else { 0.0 }
    }

    /// The median time from pose to pose, nanoseconds; 0 without stamps.
    pub fn usual_step_ns(&self) -> i64 {
        let stamps = self.stamps_ns().unwrap_or_default();
        let mut steps: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied().unwrap_or(0)
    }

    /// The body's pose at `stamp_ns`, between its neighbours: the rotation by spherical, the place by
    /// linear interpolation (the geodesics of SO(3) × R³). `O(log n)`.
    ///
    /// `None` outside the first and last stamp, inside a gap longer than `max_gap_ns`, and where the
    /// trajectory has no stamps. On a stamp it is that pose, whatever the gaps beside it.
    ///
    /// ```
    /// use dmp_sensor::{Isometry3, Trajectory};
    ///
    /// let poses = vec![(0, Isometry3::identity()), (1_000_000_000, Isometry3::translation(10.0, 0.0, 0.0))];
    /// let run = Trajectory::stamped(poses)?.trajectory;
    /// let max_gap_ns = run.usual_gap_ns();
    /// let quarter = run.world_from_body_at(250_000_000, max_gap_ns).expect("between two poses");
    /// assert_eq!(quarter.translation.vector.x, 2.5);
    /// assert_eq!(run.world_from_body_at(1_000_000_001, max_gap_ns), None);
    /// # Ok::<(), dmp_sensor::TrajectoryError>(())
    /// ```
    pub fn world_from_body_at(&self, stamp_ns: i64, max_gap_ns: i64) -> Option<Isometry3<f64>> {
        Some(match self.place_of(stamp_ns, max_gap_ns)? {
            PlaceInTime::Pose(pose) => pose,
            PlaceInTime::Within(span) => span.world_from_body_at(stamp_ns),
        })
    }

    /// Where among the poses an instant lies; `None` as [`Self::world_from_body_at`].
    pub(crate) fn place_of(&self, stamp_ns: i64, max_gap_ns: i64) -> Option<PlaceInTime> {
        let stamps = self.stamps_ns.as_deref()?;
        let after = stamps.partition_point(|&s| s <= stamp_ns);
        let before = after.checked_sub(1)?;
        if stamps[before] == stamp_ns {
            return Some(PlaceInTime::Pose(self.world_from_body[before]));
        }
        let (from_ns, to_ns) = (stamps[before], *stamps.get(after)?);
        if to_ns.checked_sub(from_ns)? > max_gap_ns {
            return None;
        }
        let between = Between::new(&self.world_from_body[before], &self.world_from_body[after]);
        Some(PlaceInTime::Within(Span { from_ns, to_ns, between }))
    }
}

/// Where among the poses of a trajectory an instant lies.
#[derive(Debug, Clone, Copy)]
pub(crate) enum PlaceInTime {
    /// At this one.
    Pose(Isometry3<f64>),
    /// Between two.
    Within(Span),
}

/// Two poses that follow each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    from_ns: i64,
    to_ns: i64,
    between: Between,
}

impl Span {
    /// Whether an instant lies between the two.
    #[inline]
    pub(crate) fn holds(&self, stamp_ns: i64) -> bool {
        self.from_ns < stamp_ns && stamp_ns < self.to_ns
    }

    /// The pose at an instant between them.
    pub(crate) fn world_from_body_at(&self, stamp_ns: i64) -> Isometry3<f64> {
        self.between.at((stamp_ns - self.from_ns) as f64 / (self.to_ns - self.from_ns) as f64)
    }
}

/// frame⁻¹ · pose. Sums are taken in pairs that half a turn of both about an axis maps onto each other: it swaps the
/// components of quaternions two by two, which differ only in their signs, which cancel.
fn seen_from(frame: &Isometry3<f64>, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let (f, p) = (frame.rotation.quaternion(), pose.rotation.quaternion());
    let from_frame = pose.translation.vector - frame.translation.vector;
    let (xx, yy, zz, ww) = (f.i * f.i, f.j * f.j, f.k * f.k, f.w * f.w);
    let product = |a: f64, b: f64| 2.0 * (a * b);
    // Columns of the frame's rotation: its axes.
    let axes = [
        [(xx + ww) - (yy + zz), product(f.i, f.j) + product(f.k, f.w), product(f.i, f.k) - product(f.j, f.w)],
        [product(f.i, f.j) - product(f.k, f.w), (yy + ww) - (xx + zz), product(f.j, f.k) + product(f.i, f.w)],
        [product(f.i, f.k) + product(f.j, f.w), product(f.j, f.k) - product(f.i, f.w), (zz + ww) - (xx + yy)],
    ];
    let place = axes.map(|axis| axis[0] * from_frame.x + axis[1] * from_frame.y + axis[2] * from_frame.z);
    let rotation = Quaternion::new(
        (f.w * p.w + f.i * p.i) + (f.j * p.j + f.k * p.k),
        (f.w * p.i - f.i * p.w) + (f.k * p.j - f.j * p.k),
        (f.w * p.j - f.j * p.w) + (f.i * p.k - f.k * p.i),
        (f.w * p.k - f.k * p.w) + (f.j * p.i - f.i * p.j),
    );
    Isometry3::from_parts(Vector3::from(place).into(), UnitQuaternion::new_unchecked(rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose(x: f64, yaw: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Vector3::new(x, 0.0, 0.0).into(),
            UnitQuaternion::from_euler_angles(0.0, 0.0, yaw),
        )
    }

    fn two() -> Trajectory {
        Trajectory::stamped(vec![(100, pose(0.0, 0.0)), (200, pose(1.0, 1.0))]).unwrap().trajectory
    }

    #[test]
    fn between_two_poses_both_parts_go_evenly() {
        let quarter = two().world_from_body_at(125, 1000).unwrap();
        assert!((quarter.translation.x - 0.25).abs() < 1e-15);
        assert!((quarter.rotation.euler_angles().2 - 0.25).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_extrapolated_and_gaps_are_refused() {
        let run = two();
        assert!(run.world_from_body_at(99, 1000).is_none());
        assert!(run.world_from_body_at(201, 1000).is_none());
        assert!(run.world_from_body_at(150, 99).is_none());
        assert_eq!(run.world_from_body_at(100, 0), Some(pose(0.0, 0.0)));
        assert_eq!(run.world_from_body_at(200, 0), Some(pose(1.0, 1.0)));
    }

    #[test]
    fn later_poses_are_the_same_at_later_times() {
        let later = two().later_by(-150).unwrap();
        assert_eq!(later.stamps_ns(), Some(&[-50, 50][..]));
        assert_eq!(later.world_from_body_at(-25, 1000), two().world_from_body_at(125, 1000));
        assert_eq!(two().later_by(i64::MAX), None);
        let unstamped = Trajectory::unstamped(vec![pose(0.0, 0.0)]).unwrap();
        assert_eq!(unstamped.clone().later_by(7), Some(unstamped));
    }

    #[test]
    fn the_extremes_of_time_do_not_overflow() {
        let run = Trajectory::stamped(vec![(i64::MIN, pose(0.0, 0.0)), (i64::MAX, pose(1.0, 0.0))]);
        assert!(run.unwrap().trajectory.world_from_body_at(0, i64::MAX).is_none());
    }

    #[test]
    fn disorder_is_counted_and_contradictions_are_refused() {
        let repaired =
            Trajectory::stamped(vec![(3, pose(3.0, 0.0)), (1, pose(1.0, 0.0)), (3, pose(3.0, 0.0))]).unwrap();
        assert_eq!((repaired.out_of_order, repaired.repeated), (1, 1));
        assert_eq!(repaired.trajectory.stamps_ns(), Some(&[1, 3][..]));
        let two_runs = Trajectory::stamped(vec![(3, pose(3.0, 0.0)), (3, pose(4.0, 0.0))]);
        assert_eq!(two_runs.unwrap_err(), TrajectoryError::Contradiction { stamp_ns: 3, apart_m: 1.0 });
        assert_eq!(Trajectory::stamped(vec![]).unwrap_err(), TrajectoryError::Empty);
        assert_eq!(Trajectory::unstamped(vec![]).unwrap_err(), TrajectoryError::Empty);
    }

    fn poses() -> impl Strategy<Value = Vec<Isometry3<f64>>> {
        let pose = (prop::array::uniform3(-500i32..500), prop::array::uniform4(-100i32..100));
        let pose =
            pose.prop_filter("a rotation", |(_, q)| q.iter().any(|&c| c != 0)).prop_map(|(place, q)| {
                let [x, y, z] = place.map(|c| f64::from(c) * 0.173);
                let [i, j, k, w] = q.map(f64::from);
                let norm = ((i * i + j * j) + (k * k + w * w)).sqrt();
                let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k) / norm);
                // On a grid that translations below leave it on.
                let place = [x, y, z].map(|c| (c * 1024.0).round() / 1024.0);
                Isometry3::from_parts(Vector3::from(place).into(), rotation)
            });
        prop::collection::vec(pose, 1..20)
    }

    proptest! {
        #[test]
        fn a_trajectory_seen_from_its_start_is_that_wherever_it_lies(poses in poses()) {
            let run = Trajectory::unstamped(poses).unwrap();
            let from_start = run.from_its_start();
            for (pose, seen) in run.poses().iter().zip(from_start.poses()) {
                let expected = run.poses()[0].inverse() * pose;
                prop_assert!((expected.translation.vector - seen.translation.vector).norm() < 1e-10);
                prop_assert!(expected.rotation.angle_to(&seen.rotation) < 1e-7);
            }
            for shift in [[0.5, -4096.0, 1.0 / 256.0], [500_000.0, 4_649_776.0, 128.0]] {
                let shifted = run.moved(&Isometry3::translation(shift[0], shift[1], shift[2]));
                prop_assert_eq!(shifted.from_its_start(), from_start.clone());
            }
            // Half a turn about each axis, as a file would have it: places and quaternions with swapped numbers.
            for axis in 0..3 {
                let turned = run.poses().iter().map(|pose| {
                    let keep = |k: usize, c: f64| if k == axis { c } else { -c };
                    let place = pose.translation.vector;
                    let place = Vector3::new(keep(0, place.x), keep(1, place.y), keep(2, place.z));
                    let [i, j, k, w]: [f64; 4] = pose.rotation.coords.into();
                    let [w, i, j, k] = match axis {
                        0 => [-i, w, -k, j],
                        1 => [-j, k, w, -i],
                        _ => [-k, -j, i, w],
                    };
                    Isometry3::from_parts(place.into(), UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)))
                });
                let turned = Trajectory::unstamped(turned.collect()).unwrap();
                prop_assert_eq!(turned.from_its_start(), from_start.clone(), "about {}", axis);
            }
        }
    }
}
