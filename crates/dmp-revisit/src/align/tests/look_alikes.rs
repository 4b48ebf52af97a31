//! Streets that look the same some metres on.

use dmp_sensor::Isometry3;

use super::visits::{moved, off, pyramid, turned, visits};
use crate::align::{Refusal, align};

/// Between points of a surface, metres.
const STEP_M: f64 = 0.12;

/// `from_m`, and on in steps, so far as it is before `to_m`.
fn steps(from_m: f64, to_m: f64, phase: f64) -> impl Iterator<Item = f64> + Clone {
    let count = ((to_m - from_m) / STEP_M) as i32;
    (0..count).map(move |k| from_m + (f64::from(k) + phase) * STEP_M)
}

/// An upright wall over a line.
fn wall([[ax, ay], [bx, by]]: [[f64; 2]; 2], height_m: f64, phase: f64) -> impl Iterator<Item = [f64; 3]> {
    let length_m = ((bx - ax) * (bx - ax) + (by - ay) * (by - ay)).sqrt();
    let along = move |d: f64| [ax + (bx - ax) * d / length_m, ay + (by - ay) * d / length_m];
    steps(0.0, length_m, phase).flat_map(move |d| {
        let [x, y] = along(d);
        steps(0.0, height_m, phase).map(move |z| [x, y, z])
    })
}

/// A street along x, within 40 m, the same every `period_m`: on either side fronts with a bay and a square pillar.
fn periodic(period_m: f64, bay_m: f64, phase: f64) -> Vec<[f64; 3]> {
    let ground = steps(-40.0, 40.0, phase).flat_map(|x| steps(-8.0, 8.0, phase).map(move |y| [x, y, 0.0]));
    let mut points: Vec<[f64; 3]> = ground.collect();
    for k in -10..10 {
        let x = f64::from(k) * period_m;
        for side in [-1.0, 1.0] {
            let front = [[0.0, 8.0], [0.0, 8.0 - bay_m], [2.0, 8.0 - bay_m], [2.0, 8.0], [period_m, 8.0]];
            let pillar = [[3.7, 5.3], [3.7, 4.7], [4.3, 4.7], [4.3, 5.3], [3.7, 5.3]];
            for corners in [front, pillar] {
                let corners = corners.map(|[along, across]| [x + along, side * across]);
                points.extend(corners.windows(2).flat_map(|ends| wall([ends[0], ends[1]], 6.0, phase)));
            }
        }
    }
    points.retain(|[x, y, z]| x * x + y * y + z * z < 1600.0);
    points
}

/// A square of guesses about the identity.
fn square(each_way: i32, apart_m: f64) -> Vec<Isometry3<f64>> {
    let steps = move || (-each_way..=each_way).map(move |k| f64::from(k) * apart_m);
    steps().flat_map(|x| steps().map(move |y| turned(0.0, [x, y, 0.0]))).collect()
}

#[test]
fn a_street_that_repeats_itself_is_ambiguous() {
    for (period_m, bay_m) in [(6.0, 0.5), (8.0, 1.0), (10.0, 1.0)] {
        let target = pyramid(periodic(period_m, bay_m, 0.1));
        for off_m in [0.0, 1.0, 0.5 * period_m] {
            let by = turned(0.02, [off_m, 0.3, -0.1]);
            let source = pyramid(moved(&by, &periodic(period_m, bay_m, 0.6)));
            let along = (-6..=6).map(|k| turned(0.0, [2.0 * f64::from(k), 0.0, 0.0]));
            let error = align(&target, &source, &along.collect::<Vec<_>>()).unwrap_err();
            println!("{period_m} m, {off_m} m off: {error}");
            let Refusal::Ambiguous { apart_m, turned_rad, share } = error else { panic!("{error}") };
            let periods = apart_m / period_m;
            assert!((periods - periods.round()).abs() < 0.02 && turned_rad < 1e-3, "{period_m} m: {error}");
            assert!(share > 0.7, "{period_m} m: {error}");
        }
    }
}

#[test]
fn a_street_that_does_not_is_none_from_many_guesses_either() {
    for seed in 1..=4 {
        let [first, second] = visits(seed);
        let by = turned(0.02, [1.0, 0.8, -0.3]);
        let (target, source) = (pyramid(first), pyramid(moved(&by, &second)));
        for guesses in [square(1, 4.0), square(1, 8.0), square(2, 4.0), square(2, 8.0)] {
            let found = align(&target, &source, &guesses).unwrap();
            let (off_m, _) = off(&found, &by.inverse());
            assert!(off_m < 0.01, "seed {seed}, {} guesses: {off_m} m", guesses.len());
        }
    }
}

/// Pieces of 4 m of the second visit are moved by some centimetres, each other one the other way: no motion brings all of them onto
/// the first.
#[test]
fn surfaces_that_stay_apart_are_rejected() {
    for (off_m, is_refused) in [(0.002, false), (0.06, true)] {
        let [first, second] = visits(3);
        let bent: Vec<[f64; 3]> = second
            .iter()
            .map(|&[x, y, z]| {
                let piece = (x / 4.0).floor() as i64 + (y / 4.0).floor() as i64;
                let by_m = if piece % 2 == 0 { off_m } else { -off_m };
                [x, y + by_m, z + by_m]
            })
            .collect();
        let found = align(&pyramid(first), &pyramid(bent), &[]);
        println!("{off_m}: {found:?}");
        assert_eq!(matches!(found, Err(Refusal::NotAlike { .. })), is_refused, "{off_m}: {found:?}");
        assert_eq!(found.is_ok(), !is_refused, "{off_m}: {found:?}");
    }
}
