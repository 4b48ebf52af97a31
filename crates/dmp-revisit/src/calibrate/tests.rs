//! A hall with flat walls, a vehicle that drives in it, and errors that are made.

use dmp_reduce::Confidence;
use dmp_sensor::{Isometry3, Scan, Trajectory, UnitQuaternion, Vector3};

use crate::calibrate::axis::{AXES, Vector};
use crate::calibrate::mount::Trial;
use crate::calibrate::{
    Axis, Block, Calibration, Mount, Order, calibrate, instant, scans_of_block, together,
};

const SCANS: usize = 240;
const PERIOD_NS: i64 = 100_000_000;
/// Half the extent of the hall along x and y, its floor and its roof, metres from the sensor's path.
const WALLS_M: [f64; 3] = [30.0, 20.0, 4.0];

/// A wavy path with pitch and roll; or straight on, evenly and level.
fn pose(ns: i64, wavy: bool) -> Isometry3<f64> {
    let s = ns as f64 / 1e9;
    if !wavy {
        return Isometry3::translation(-12.0 + s, 0.0, 0.0);
    }
    let turn = UnitQuaternion::from_euler_angles(
        0.1 * (1.3 * s).sin(),
        0.08 * (1.7 * s).cos(),
        0.9 * (0.7 * s).sin(),
    );
    let place = Vector3::new(10.0 * (0.4 * s).sin(), 6.0 * (0.6 * s).cos(), 0.3 * s.sin());
    Isometry3::from_parts(place.into(), turn)
}

/// Where a ray meets the hall.
fn range_m(from: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    (0..3).map(|k| (WALLS_M[k].copysign(along[k]) - from[k]) / along[k]).fold(f64::INFINITY, f64::min)
}

/// A scan of 16 beams turning, each return at its own time, with a little noise that is the same every time.
fn scan(number: usize, wavy: bool) -> Scan {
    let stamp_ns = number as i64 * PERIOD_NS;
    let mut scan = Scan { stamp_ns: Some(stamp_ns), ..Scan::default() };
    for step in 0..250_i64 {
        let after_ns = step * PERIOD_NS / 250;
        let world_from_sensor = pose(stamp_ns + after_ns, wavy);
        let azimuth = step as f64 / 250.0 * std::f64::consts::TAU + 0.37 * number as f64;
        for beam in 0..16 {
            let elevation = (f64::from(beam) - 7.5) * 0.04;
            let direction = Vector3::new(
                azimuth.cos() * elevation.cos(),
                azimuth.sin() * elevation.cos(),
                elevation.sin(),
            );
            let noise_m =
                0.02 * (12.9898 * (step as f64 + 250.0 * f64::from(beam)) + 78.233 * number as f64).sin();
            let range_m =
                range_m(&world_from_sensor.translation.vector, &(world_from_sensor.rotation * direction))
                    + noise_m;
            scan.points_in_sensor_m.push((direction * range_m).map(|c| c as f32).into());
            scan.time_offsets_ns.push(after_ns);
        }
    }
    scan
}

fn blocks(wavy: bool) -> Vec<Block> {
    let block = |k: usize| {
        let mut block = Block::default();
        for number in scans_of_block(k * 15, 15, SCANS, 6) {
            let scan = scan(number, wavy);
            block.add(number, scan.stamp_ns, &scan, 4000, |_| true);
        }
        block
    };
    (0..SCANS / 15).map(block).collect()
}

fn truth(wavy: bool) -> Trajectory {
    let stamps = (-50..SCANS as i64 * 10 + 50).map(|k| k * PERIOD_NS / 10);
    let poses = stamps.map(|ns| (ns, pose(ns, wavy))).collect();
    Trajectory::stamped(poses).unwrap().trajectory
}

fn found(blocks: &[Block], trajectory: &Trajectory, body_from_sensor: Isometry3<f64>) -> Calibration {
    let mount = Mount { trajectory, body_from_sensor, max_gap_ns: i64::MAX, later_than_lines_ns: 0 };
    let calibration = calibrate(blocks, &mount, 1.0, true, Confidence::P99);
    calibration.unwrap()
}

#[test]
fn a_right_run_is_right_and_errors_are_found_and_undone() {
    let (blocks, right) = (blocks(true), truth(true));
    let plain = found(&blocks, &right, Isometry3::identity());
    assert_eq!(plain.off().count(), 0, "{plain:?}");
    assert!(plain.estimates.iter().all(|one| one.is_seen), "{plain:?}");
    // The poses hold 30 ms later than their stamps say, and the sensor sits otherwise.
    let late = right.clone().later_by(-30_000_000).unwrap();
    let wrong = Isometry3::new(Vector3::new(0.1, -0.06, 0.05), Vector3::new(0.01, -0.008, 0.02));
    let one = found(&blocks, &late, wrong);
    assert!((one.of(Axis::Time).value + 0.03).abs() < one.of(Axis::Time).half.max(3e-4), "{one:?}");
    let [roll, pitch, yaw, x, y, z] = std::array::from_fn(|k| one.estimates[k + 2].value);
    let found = Isometry3::new(Vector3::new(x, y, z), Vector3::new(roll, pitch, yaw));
    let left = wrong * found;
    // What pays is estimated without the rest, which then weighs on it.
    assert!(left.translation.vector.norm() < 0.01 && left.rotation.angle() < 2e-3, "{left} {one:?}");
    // What is fixed is what the surfaces need: time and turns here, and not every centimetre.
    assert!([Axis::Time, Axis::Roll, Axis::Yaw].iter().all(|&axis| one.of(axis).pays), "{one:?}");
    assert!(one.after_m < 0.6 * one.before_m && (one.after_m - plain.before_m).abs() < 1e-3, "{one:?}");
}

/// The mean of two noisy poses is better than either: whatever is shifted, surfaces become thinner, and nothing is off.
#[test]
fn noise_is_no_error_of_clock_or_mounting() {
    let blocks = blocks(true);
    for (draw, pose_period_ns) in [(0, 20_000_000), (1, 100_000_000), (2, 200_000_000), (3, 100_000_000)] {
        let scatter = |k: i64, of: u64| {
            let mut mixed = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (of + 10 * draw) << 17;
            for shift in [31, 29, 32] {
                mixed = (mixed ^ mixed >> shift).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            }
            (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let noisy = |k: i64| {
            let ns = k * pose_period_ns;
            let off = Vector3::from_fn(|axis, _| 0.05 * scatter(k, axis as u64));
            let turned = Vector3::from_fn(|axis, _| 0.003 * scatter(k, 3 + axis as u64));
            (ns, pose(ns, true) * Isometry3::new(off, turned))
        };
        let last = SCANS as i64 * PERIOD_NS / pose_period_ns;
        let run = Trajectory::stamped((-5..last + 5).map(noisy).collect()).unwrap().trajectory;
        for sweeps in [true, false] {
            let mount = Mount {
                trajectory: &run,
                body_from_sensor: Isometry3::identity(),
                max_gap_ns: i64::MAX,
                later_than_lines_ns: 0,
            };
            let one = calibrate(&blocks, &mount, 1.0, sweeps, Confidence::P99).unwrap();
            assert_eq!(one.paying().count(), 0, "{draw} {sweeps}: {one:?}");
            assert_eq!(instant(&blocks, &mount, 1.0, &[-0.05, -0.1], Confidence::P99), None, "{draw}");
        }
    }
    // Of a run that is wrong by half a scan it is found, with noise or without.
    let right = truth(true);
    let late = right.later_by(-50_000_000).unwrap();
    let mount = Mount {
        trajectory: &late,
        body_from_sensor: Isometry3::identity(),
        max_gap_ns: i64::MAX,
        later_than_lines_ns: 0,
    };
    assert_eq!(instant(&blocks, &mount, 1.0, &[-0.1, -0.05], Confidence::P99), Some(1));
}

#[test]
fn what_the_way_does_not_show_is_not_seen() {
    // Straight on at even speed and level: any time, any place of the sensor on the body, gives the same map.
    let one = found(&blocks(false), &truth(false), Isometry3::identity());
    let seen = |axis: Axis| one.of(axis).is_seen;
    assert_eq!([Axis::Time, Axis::X, Axis::Y, Axis::Z].map(seen), [false; 4], "{one:?}");
    assert!(seen(Axis::Yaw), "{one:?}");
    assert_eq!(one.off().count(), 0);
}

#[test]
fn points_at_one_instant_already_are_found_by_their_times() {
    let corrected = |number: usize| {
        let raw = scan(number, true);
        let stamp_ns = raw.stamp_ns.unwrap_or(0);
        let start = pose(stamp_ns, true).inverse();
        let correct = |(point, after_ns): (&[f32; 3], &i64)| {
            let point = dmp_sensor::Point3::from(point.map(f64::from));
            (start * (pose(stamp_ns + after_ns, true) * point)).coords.map(|c| c as f32).into()
        };
        let points_in_sensor_m =
            raw.points_in_sensor_m.iter().zip(&raw.time_offsets_ns).map(correct).collect();
        Scan { points_in_sensor_m, ..raw }
    };
    let block = |k: usize| {
        let mut block = Block::default();
        for number in scans_of_block(k * 15, 15, SCANS, 6) {
            block.add(number, Some(number as i64 * PERIOD_NS), &corrected(number), 4000, |_| true);
        }
        block
    };
    let blocks: Vec<Block> = (0..SCANS / 15).map(block).collect();
    let sweep = found(&blocks, &truth(true), Isometry3::identity()).of(Axis::Sweep);
    assert!(sweep.is_off && sweep.value.abs() < sweep.half.max(0.02), "{sweep:?}");
}

#[test]
fn a_return_moves_as_its_gradient_says() {
    let right = truth(true);
    let mount = Mount {
        trajectory: &right,
        body_from_sensor: Isometry3::translation(0.3, -0.2, 1.0),
        max_gap_ns: i64::MAX,
        later_than_lines_ns: 0,
    };
    let (point, normal) = (Vector3::new(7.0, -3.0, 1.0), Vector3::new(0.6, 0.0, 0.8));
    let (stamp_ns, after_ns) = (5 * PERIOD_NS, PERIOD_NS / 2);
    let along = |steps: &Vector| {
        let trial = Trial::new(&mount, steps, 1.0);
        let moment = trial.at(&mut trial.cursors(), stamp_ns, after_ns).unwrap();
        (normal.dot(&moment.place(&point)), moment.gradient(&point, after_ns, &normal, 1.0))
    };
    let gradient = along(&Vector::zeros()).1;
    for k in 0..AXES {
        let mut steps = Vector::zeros();
        steps[k] = 0.5;
        let change = along(&steps).0 - along(&-steps).0;
        assert!(
            (change - gradient[k]).abs() < 1e-4 + 0.01 * gradient[k].abs(),
            "{k}: {change} {}",
            gradient[k]
        );
    }
}

#[test]
fn scans_meet_at_their_own_poses_and_not_at_those_of_others() {
    let (blocks, right) = (blocks(true), truth(true));
    let mount = Mount {
        trajectory: &right,
        body_from_sensor: Isometry3::identity(),
        max_gap_ns: i64::MAX,
        later_than_lines_ns: 0,
    };
    let share = |order: Order| together(&blocks, &mount, order, 1.0, 1).share();
    assert!(
        share(Order::Own) > 1.2 * share(Order::Reversed),
        "{} {}",
        share(Order::Own),
        share(Order::Reversed)
    );
}

#[test]
fn blocks_have_scans_near_and_far() {
    assert_eq!(scans_of_block(100, 22, 1000, 6), [100, 101, 103, 107, 115]);
    assert_eq!(scans_of_block(100, 2000, 1000, 6), [100, 101, 103, 107, 115, 131]);
    assert_eq!(scans_of_block(98, 22, 100, 6), [98, 99]);
    assert_eq!(scans_of_block(5, 0, 100, 6), [5, 6]);
}
