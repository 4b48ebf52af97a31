//! What speaks against a claim, and what does not.

use super::bare::corridor;
use super::visits::{moved, pyramid, turned, visits};
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
fn a_bent_visit_that_is_off_is_not_said_to_be_much_further_off() {
    let mut elsewhere_m = Vec::new();
    for seed in 1..=6 {
        let [first, second] = visits(seed);
        for shift_m in [[4.0, 0.5, 0.0], [0.5, 4.0, 0.0], [3.0, -3.0, 0.0]] {
            let why = refusal(&first, &bent(&moved(&turned(0.0, shift_m), &second)));
            elsewhere_m.extend(why.and_then(|why| why.elsewhere_m()));
        }
    }
    println!("{elsewhere_m:?}");
    assert!(
        elsewhere_m.len() >= 6 && elsewhere_m.iter().all(|&m| m < 1.3 * 18.0_f64.sqrt()),
        "{elsewhere_m:?}"
    );
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

#[test]
fn a_corridor_along_which_a_bent_visit_slides_is_not_elsewhere() {
    for along_m in [2.0, 3.0, 5.0] {
        let second = bent(&moved(&turned(0.0, [along_m, 0.0, 0.0]), &corridor(0.051)));
        let why = refusal(&corridor(0.013), &second);
        println!("{along_m}: {why:?}");
        assert_eq!(why.and_then(|why| why.elsewhere_m()), None, "{why:?}");
    }
}
