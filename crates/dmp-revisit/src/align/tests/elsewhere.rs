//! What speaks against a claim, and what does not.

use dmp_sensor::Vector3;

use super::visits::{moved, pyramid, turned, visits};
use crate::align::side::Side;
use crate::align::{Refusal, align};

const GUESSES_M: [[f64; 3]; 5] =
    [[0.0; 3], [3.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, -3.0, 0.0]];

fn refusal(first: &[[f64; 3]], second: &[[f64; 3]]) -> Option<Refusal> {
    let guesses = GUESSES_M.map(|shift_m| turned(0.0, shift_m));
    align(&pyramid(first.to_vec()), &pyramid(second.to_vec()), &guesses).err()
}

/// Pieces of 4 m are moved by some centimetres, each other one the other way.
fn bent(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let by_m =
        |x: f64, y: f64| if ((x / 4.0).floor() + (y / 4.0).floor()) % 2.0 == 0.0 { 0.06 } else { -0.06 };
    points.iter().map(|&[x, y, z]| [x, y + by_m(x, y), z + by_m(x, y)]).collect()
}

#[test]
fn another_street_is_elsewhere_and_a_bent_visit_is_not() {
    let streets: Vec<_> = (1..=6).map(visits).collect();
    let mut elsewhere_m = Vec::new();
    for (k, [first, _]) in streets.iter().enumerate() {
        for [_, second] in &streets[..k] {
            elsewhere_m.extend(refusal(first, second).and_then(|why| why.elsewhere_m()));
        }
        let why = refusal(first, &bent(&streets[k][1])).unwrap();
        assert!(matches!(why, Refusal::NotAlike { .. }) && why.elsewhere_m().is_none(), "{why:?}");
    }
    println!("{elsewhere_m:?}");
    assert!(elsewhere_m.len() >= 3 && elsewhere_m.iter().all(|&m| m > 1.0), "{elsewhere_m:?}");
}

#[test]
fn a_bent_visit_that_is_off_is_not_said_to_be_further_off() {
    let mut parts = Vec::new();
    for seed in 1..=6 {
        let [first, second] = visits(seed);
        for shift_m in [[4.0, 0.5, 0.0], [0.5, 4.0, 0.0], [3.0, -3.0, 0.0]] {
            let why = refusal(&first, &bent(&moved(&turned(0.0, shift_m), &second)));
            let elsewhere_m = why.and_then(|why| why.elsewhere_m());
            parts.extend(elsewhere_m.map(|m| m / Vector3::from(shift_m).norm()));
        }
    }
    assert!(parts.len() >= 6 && parts.iter().all(|&part| part < 1.05), "{parts:?}");
}

#[test]
fn nothing_speaks_against_a_claim_where_only_a_part_is_in_view() {
    let in_view = |points: &[[f64; 3]]| -> Vec<[f64; 3]> {
        points.iter().copied().filter(|[x, y, _]| *x > y.abs()).collect()
    };
    let streets: Vec<_> = (1..=6).map(|seed| visits(seed).map(|points| in_view(&points))).collect();
    for (k, [first, _]) in streets.iter().enumerate() {
        for [_, second] in &streets[..k] {
            let why = refusal(first, second);
            assert_eq!(why.and_then(|why| why.elsewhere_m()), None, "{why:?}");
        }
    }
}

/// The floor and the walls of a tunnel along x.
fn tunnel(phase_m: f64) -> Vec<[f64; 3]> {
    let steps = |count: i32, from_m: f64| (0..count).map(move |k| from_m + 0.1 * f64::from(k) + phase_m);
    let floor = steps(400, -20.0).flat_map(|x| steps(96, -4.8).map(move |y| [x, y, -1.63]));
    let walls = steps(400, -20.0).flat_map(|x| steps(40, -1.2).map(move |z| [x, z]));
    floor.chain(walls.flat_map(|[x, z]| [[x, -5.13, z], [x, 5.13, z]])).collect()
}

/// How far from the identity a match from `start_m` is said to be, across x and across y.
fn elsewhere_m(first: &[[f64; 3]], second: &[[f64; 3]], start_m: [f64; 3]) -> [Option<f64>; 2] {
    let (target, source) = (pyramid(first.to_vec()), pyramid(second.to_vec()));
    let side = Side { target: &target, source: &source };
    let (claimed, start) = (turned(0.0, [0.0; 3]), turned(0.0, start_m));
    let best = side.refined(&start, &start);
    [Vector3::x(), Vector3::y()].map(|least_held| side.elsewhere_m(&best, &claimed, &least_held))
}

#[test]
fn a_bent_visit_that_slides_along_a_tunnel_is_not_elsewhere() {
    let [across_x, across_y] = elsewhere_m(&tunnel(0.013), &bent(&tunnel(0.051)), [3.0, 0.0, 0.0]);
    assert!(
        across_x.is_none() && across_y.is_some_and(|m| (m - 3.0).abs() < 0.5),
        "{across_x:?} {across_y:?}"
    );
}

#[test]
fn a_claim_that_fits_is_not_contradicted_by_another_match() {
    let [first, second] = visits(1);
    assert_eq!(elsewhere_m(&first, &second, [8.0, 8.0, 0.0]), [None; 2]);
    let against = elsewhere_m(&first, &bent(&second), [8.0, 8.0, 0.0]);
    assert!(against.iter().all(|m| m.is_some_and(|m| m > 1.0)), "{against:?}");
}
