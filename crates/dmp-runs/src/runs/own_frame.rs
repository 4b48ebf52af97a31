//! Computes the canonical frame in which a run is scored: it depends only on the sensor's path in the log's
//! scans, not on the run's own frame.
//!
//! A map is a grid of voxels, and the position of a surface within its voxels affects the predictions. SLAM
//! systems place their world differently: at the first pose, along gravity, to the north. So every run is
//! first moved rigidly, by its own path, to a frame that any other run of the same path would get. Two runs
//! that differ by a rigid motion then have one map. From here on `world` is that frame, and `own` that of the
//! run's trajectory, in which users get their results.
//!
//! In the frame found so, the path lies level and along an axis, and so does what is built along streets. A
//! flat ground would lie at one height in its voxels everywhere: good or bad luck for the whole map. So the
//! frame is tilted by a few degrees about each axis. Every surface then crosses its voxels at all heights
//! within a few metres, and the luck averages out.

use dmp_map::{Store, smallest_eigenvector};
use dmp_sensor::{Isometry3, Matrix3, Quaternion, Rotation3, Trajectory, UnitQuaternion, Vector3};

use crate::asked::{EvaluateError, Frame, Run, Settings};
use crate::runs::clock::on_log_clock;
use crate::runs::frame::PlannedFrame;
use crate::runs::heads::Heads;
use crate::runs::path::RunPath;
use crate::runs::posed_run::PosedRun;
use crate::runs::run_poses::RunPoses;

/// Range of the sensor for the extent of what it saw: to all sides, metres of a drive, and along its own z
/// axis. Applied at every sensor position.
const REACH_M: f64 = 20.0;
const REACH_ALONG_Z_M: f64 = 3.0;
/// Weights over time that distinguish the path from its reverse: Legendre polynomials up to this degree.
const HARMONICS: usize = 8;
/// Rotation about x, y and z, in this order, by 5, 4 and 7 degrees: the slopes of level and upright planes in
/// the frame lie between 0.06 and 0.13. As (x, y, z, w).
const TILT: [f64; 4] = [0.045_640_04, 0.032_139_97, 0.062_472_74, 0.996_484_4];

/// The rotation from the level frame of a path to the one in which it is scored.
pub fn tilt() -> UnitQuaternion<f64> {
    let [i, j, k, w] = TILT;
    UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
}

/// Moves `runs` into their canonical frames, or into the frame of the store if the map is one, and finds their paths
/// through the scans in use. `stores` are those of the runs, in their order. Each run is placed by itself.
///
/// # Errors
/// When a run and the log do not belong together.
pub fn place<'a>(
    heads: Heads<'_>,
    frames: &[PlannedFrame],
    runs: &'a [Run],
    stores: Vec<Option<Store>>,
    settings: &Settings,
) -> Result<Vec<PosedRun<'a, Option<Store>>>, EvaluateError> {
    let placed = |run: &Run, trajectory: Trajectory| {
        on_log_clock(heads, run, trajectory, settings).map(|at| RunPoses::new(run, at, settings))
    };
    let place = |(number, store): (usize, Option<Store>)| {
        let run = &runs[number];
        let poses = placed(run, run.trajectory.from_its_start())?;
        let path = RunPath::new(heads, frames, (run, &poses), settings)?;
        let own_from_start = run.trajectory.poses()[0];
        if let Some(own_from_world) = store.as_ref().map(|store| *store.own_from_world()) {
            let poses = placed(run, run.trajectory.moved(&own_from_world.inverse()))?;
            return Ok(PosedRun { own_from_world, ..PosedRun::new(runs, number, (poses, path), store) });
        }
        let of_the_way = || {
            let seen = seen(frames, (&poses, &path), heads.summary().middle_ns);
            frame_of(&seen, settings.metre_m())
        };
        let world_from_start = match settings.frame {
            Frame::OfTheWay => of_the_way(),
            Frame::Moved(new_from_world) => new_from_world * of_the_way(),
            Frame::Fixed(world_from_own) => world_from_own * own_from_start,
        };
        let own_from_world = own_from_start * world_from_start.inverse();
        let poses = poses.moved(&world_from_start);
        Ok(PosedRun { own_from_world, ..PosedRun::new(runs, number, (poses, path), store) })
    };
    stores.into_iter().enumerate().map(place).collect()
}

/// The poses in the middle of the scans, whether stamps mark a scan's start or end. Those at the stamps, if the run has
/// none in any middle.
fn seen(
    frames: &[PlannedFrame],
    (poses, path): (&RunPoses, &RunPath),
    middle_ns: i64,
) -> Vec<Isometry3<f64>> {
    let after = |after_ns| {
        let posed = frames.iter().enumerate().filter(|(ordinal, _)| path.has(*ordinal));
        posed.filter_map(|(_, frame)| poses.of_frame_after(frame, after_ns)).collect::<Vec<_>>()
    };
    match after(middle_ns) {
        none if none.is_empty() => after(0),
        poses => poses,
    }
}

/// The frame of a sensor path, relative to the frame of its poses, with the tilt. Its origin is the mean
/// position. z is the direction of least extent of what was seen. x is the direction in which the path,
/// weighted over time, leads farthest.
fn frame_of(poses: &[Isometry3<f64>], metre_m: f64) -> Isometry3<f64> {
    let count = poses.len().max(1) as f64;
    let mean = poses.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() / count;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()]
        .map(|axis| poses.iter().map(|pose| pose.rotation * axis).sum::<Vector3<f64>>() / count);

    let (across, along) = (REACH_M * metre_m, REACH_ALONG_Z_M * metre_m);
    let mut extent = Matrix3::identity() * (across * across);
    for pose in poses {
        let (place, up) = (pose.translation.vector - mean, pose.rotation * Vector3::z());
        extent +=
            (place * place.transpose() - up * up.transpose() * (across * across - along * along)) / count;
    }
    let upper = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| extent[at]);
    let z = Vector3::from(smallest_eigenvector(upper).0);
    // Up follows the sensor: the axis of it that is most parallel to z.
    let leaning = longest(axes.into_iter().map(|axis| z * axis.dot(&z)));
    let z = if leaning.dot(&z) < 0.0 { -z } else { z };

    let level = |leads: Vector3<f64>| leads - z * leads.dot(&z);
    let mut moments = [Vector3::zeros(); HARMONICS];
    for (index, pose) in poses.iter().enumerate() {
        let weights = legendre((2 * index + 1) as f64 / count - 1.0);
        for (moment, weight) in moments.iter_mut().zip(weights) {
            *moment += (pose.translation.vector - mean) * (weight / count);
        }
    }
    // If the sensor barely moves, the directions of its axes determine x.
    let leads = longest(moments.into_iter().chain(axes.map(|axis| axis * metre_m)).map(level));
    let any = longest([Vector3::x(), Vector3::y()].into_iter().map(level));
    let x = leads.try_normalize(0.0).unwrap_or_else(|| any.normalize());
    let level_from_start = Matrix3::from_rows(&[x.transpose(), z.cross(&x).transpose(), z.transpose()]);
    let level_from_start =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(level_from_start));
    let rotation = tilt() * level_from_start;
    Isometry3::from_parts((-(rotation * mean)).into(), rotation)
}

/// The longest of some vectors, the first of equal ones; zero without any.
fn longest(vectors: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    vectors.fold(Vector3::zeros(), |longest, vector| {
        if vector.norm_squared() > longest.norm_squared() { vector } else { longest }
    })
}

/// P₁ to P₈ at `t`, −1 to 1: (n + 1) P₍ₙ₊₁₎ = (2 n + 1) t Pₙ − n P₍ₙ₋₁₎.
fn legendre(t: f64) -> [f64; HARMONICS] {
    let (mut before, mut last) = (1.0, t);
    std::array::from_fn(|k| {
        let (degree, now) = ((k + 1) as f64, last);
        (before, last) = (last, ((2.0 * degree + 1.0) * t * last - degree * before) / (degree + 1.0));
        now
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive round a block, level but for a hill, the sensor looking ahead; `noise` displaces every pose.
    fn drive(noise: impl Fn(usize) -> Vector3<f64>) -> Vec<Isometry3<f64>> {
        let pose = |k: usize| {
            let along = k as f64 / 100.0;
            let place = match along {
                a if a < 1.0 => Vector3::new(80.0 * a, 0.0, 0.0),
                a if a < 2.0 => Vector3::new(80.0, 60.0 * (a - 1.0), 3.0 * (a - 1.0)),
                a => Vector3::new(80.0 - 80.0 * (a - 2.0), 60.0, 3.0 - 3.0 * (a - 2.0)),
            };
            let yaw = along.floor() * std::f64::consts::FRAC_PI_2;
            let turn = UnitQuaternion::from_euler_angles(0.01 * noise(k).x, 0.01 * noise(k).y, yaw);
            Isometry3::from_parts((place + noise(k)).into(), turn)
        };
        (0..300).map(pose).collect()
    }

    fn still(_: usize) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
        ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation))
    }

    #[test]
    fn a_way_comes_to_lie_in_one_place_wherever_it_was() {
        let way = drive(still);
        let placed = frame_of(&way, 1.0) * way[17];
        for (shift, turn) in [
            ([500_000.0, 4_649_776.0, 100.0], [0.0, 0.0, 0.0]),
            ([3.0, -4.0, 5.0], [0.1, -0.2, 3.0]),
            ([0.0, 0.0, 0.0], [3.0, 0.4, -2.0]),
        ] {
            let motion = Isometry3::from_parts(
                dmp_sensor::Translation3::from(shift),
                UnitQuaternion::from_euler_angles(turn[0], turn[1], turn[2]),
            );
            let moved: Vec<_> = way.iter().map(|pose| motion * pose).collect();
            let again = frame_of(&moved, 1.0) * moved[17];
            let (metres, radians) = apart(&placed, &again);
            assert!(metres < 1e-6 && radians < 1e-8, "{shift:?} {turn:?}: {metres} m {radians} rad");
        }
    }

    #[test]
    fn ways_that_are_nearly_the_same_come_to_lie_nearly_so() {
        let noise = |size_m: f64, seed: f64| {
            move |k: usize| {
                Vector3::from([1.3, 2.7, 4.1].map(|f| size_m * (f * (k as f64 + seed) * 7.77).sin()))
            }
        };
        for size_m in [0.001, 0.03] {
            let (a, b) = (drive(noise(size_m, 1.0)), drive(noise(size_m, 5.0)));
            let by = frame_of(&a, 1.0) * frame_of(&b, 1.0).inverse();
            // Over hundreds of poses, the frames agree better than single poses do.
            let (metres, radians) = apart(&by, &Isometry3::identity());
            assert!(metres < size_m && 100.0 * radians < size_m, "{size_m}: {metres} m {radians} rad");
        }
    }

    #[test]
    fn level_ground_and_walls_along_the_way_cross_their_voxels() {
        let world_from_own = frame_of(&drive(still), 1.0);
        let up = world_from_own * Vector3::z();
        assert!(up.z > 0.99, "{up}");
        assert!(up.x.abs() > 0.02 && up.y.abs() > 0.02, "{up}");
        let [i, j, k, w] = TILT;
        let tilt = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)).to_rotation_matrix();
        for (k, l) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
            let slope = tilt[(k, l)].abs();
            assert!((0.05..0.13).contains(&slope), "{k} {l}: {slope}");
        }
        // A sensor that is mounted upside down has its map upside down; the same holds for a standing car.
        let turned = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
        let hung: Vec<_> = drive(still).iter().map(|pose| pose * turned).collect();
        assert!((frame_of(&hung, 1.0) * Vector3::z()).z < -0.99);
        let parked = vec![drive(still)[7]; 20];
        assert!((frame_of(&parked, 1.0) * Vector3::z()).z > 0.99);
        let alone = frame_of(&parked[..1], 1.0);
        assert!(apart(&frame_of(&parked, 1.0), &alone).0 < 1e-9);
    }

    #[test]
    fn the_polynomials_are_those_of_legendre() {
        let p = legendre(0.3);
        for (k, expected) in [(0, 0.3), (1, 0.5 * (3.0 * 0.09 - 1.0)), (2, 0.5 * (5.0 * 0.027 - 0.9))] {
            assert!((p[k] - expected).abs() < 1e-15);
        }
        assert!(legendre(1.0).iter().all(|p| (p - 1.0).abs() < 1e-14));
    }
}
