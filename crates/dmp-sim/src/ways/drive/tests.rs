//! Drives and walks are smooth, and keep to their lines.

use super::*;
use dmp_sensor::Vector3;

fn town(route: Route, options: &DriveOptions) -> Town {
    let town = TownOptions::default();
    Town::new(TownOptions { blocks: route.blocks(options.travel_m(&town), town.block_m), ..town }).unwrap()
}

#[test]
fn the_motion_is_smooth_and_twenty_poses_a_second_give_it_to_millimetres() {
    // Upper bounds: errors of interpolation (m, rad), acceleration (m/s²), speed (m/s).
    let car = [1e-3, 3e-4, 4.0, 7.0];
    let walker = [3e-3, 2e-3, 8.0, 1.7];
    let cars = [Route::Loop, Route::OutAndBack, Route::Straight, Route::OneWay].map(|route| (route, car));
    for (route, most) in cars.into_iter().chain([(Route::Campus, walker)]) {
        let is_car = route != Route::Campus;
        let options = if is_car { DriveOptions { route, ..DriveOptions::default() } } else { walk(280.0) };
        let town = if is_car { town(route, &options) } else { Town::campus(3) };
        let drive = Drive::new(&town, options.clone()).unwrap();
        let run = drive.trajectory(20.0).unwrap();
        let place = |k: i64| drive.world_from_body_at(options.start_ns + k * 20_000_000);
        let mut travel_m = 0.0;
        for k in 0..(options.duration_s * 50.0) as i64 - 10 {
            let between = run.world_from_body_at(options.start_ns + k * 20_000_000, i64::MAX).unwrap();
            let off = between.inv_mul(&place(k));
            let [a, b, c] = [place(k), place(k + 1), place(k + 2)];
            let step = b.translation.vector - a.translation.vector;
            let acceleration = (c.translation.vector - b.translation.vector - step) / (0.02 * 0.02);
            let off = [off.translation.vector.norm(), off.rotation.angle()];
            let found = [off[0], off[1], acceleration.norm(), step.norm() / 0.02];
            assert!(found.iter().zip(most).all(|(found, most)| *found < most), "{route:?} {k}: {found:?}");
            if is_car {
                // It looks where it goes, and lies on the slope.
                let ahead = a.rotation.inverse() * step.normalize();
                assert!(
                    a.rotation.angle_to(&b.rotation) / 0.02 < 1.6 && ahead.x > 0.99,
                    "{route:?} {k}: {ahead:?}"
                );
            }
            travel_m += step.norm();
        }
        let nominal_m = if is_car { options.travel_m(town.options()) } else { 315.0 };
        assert!((0.9..1.1).contains(&(travel_m / nominal_m)), "{route:?}: {travel_m} m of {nominal_m}");
    }
}

#[test]
fn impossible_drives_are_refused() {
    let town = Town::new(TownOptions::default()).unwrap();
    let options = DriveOptions { speed_m_s: 0.0, ..DriveOptions::default() };
    assert!(Drive::new(&town, options).is_err());
    let drive = Drive::new(&town, DriveOptions::default()).unwrap();
    assert!(drive.trajectory(0.0).is_err());
}

fn walk(seconds: f64) -> DriveOptions {
    DriveOptions {
        route: Route::Campus,
        speed_m_s: 1.3,
        duration_s: seconds,
        height_m: 1.2,
        ..DriveOptions::default()
    }
}

#[test]
fn a_walker_keeps_above_what_is_walked_on_and_clear_of_walls() {
    let campus = Town::campus(3);
    let options = walk(300.0);
    let drive = Drive::new(&campus, options.clone()).unwrap();
    let (mut ups_m, mut downs_m, mut lowest, mut highest) = (0.0, 0.0, f64::MAX, f64::MIN);
    let mut before_m = None;
    for k in 0..6000 {
        let time_s = f64::from(k) * 0.05;
        let at = drive.world_from_body_at(options.start_ns + k as i64 * 50_000_000).translation.vector;
        let below = campus.cast(at, -Vector3::z(), time_s).unwrap();
        // Half a tread of smoothing, one riser, and the heave.
        assert!((below.range_m - 1.2).abs() < 0.28, "after {time_s} s: {} m above the floor", below.range_m);
        (lowest, highest) = (f64::min(lowest, below.range_m), f64::max(highest, below.range_m));
        for n in 0..16 {
            let (sin, cos) = libm::sincos(f64::from(n) * std::f64::consts::TAU / 16.0);
            let wall = campus.cast(at, Vector3::new(cos, sin, 0.0), time_s);
            let gap_m = wall.map_or(f64::MAX, |hit| hit.range_m);
            assert!(gap_m > 0.4, "after {time_s} s: {gap_m} m from a wall at {at:?}");
        }
        let rise_m = at.z - before_m.unwrap_or(at.z);
        before_m = Some(at.z);
        if rise_m.abs() > 0.01 {
            *(if rise_m > 0.0 { &mut ups_m } else { &mut downs_m }) += rise_m;
        }
    }
    assert!(ups_m > 7.0 && downs_m < -7.0, "{ups_m} {downs_m}: twice up and down 4 m of stairs");
    assert!(lowest < 1.12 && highest > 1.28, "{lowest} {highest}: the gait and the treads show");
}

#[test]
fn cars_keep_to_streets_and_walkers_to_the_campus() {
    let town = Town::new(TownOptions::default()).unwrap();
    assert_eq!(Drive::new(&town, walk(10.0)).err(), Some(SimError::OtherPlace { route: Route::Campus }));
    let campus = Town::campus(1);
    let driven = Drive::new(&campus, DriveOptions::default());
    assert_eq!(driven.err(), Some(SimError::OtherPlace { route: Route::Loop }));
}
