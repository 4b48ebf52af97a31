use dmp_sensor::{Isometry3, UnitQuaternion};

use super::*;
use proptest::prelude::*;

const NEAR_M: f64 = 15.0;

/// Consecutive visits at these places.
fn at(places_m: &[[f64; 2]]) -> Visits {
    let along_m: Vec<f64> = std::iter::once(0.0)
        .chain(places_m.windows(2).scan(0.0, |along_m, pair| {
            *along_m += (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            Some(*along_m)
        }))
        .collect();
    let poses = places_m.iter().map(|&[x, y]| Isometry3::translation(x, y, 0.0)).collect();
    Visits { poses, along_m }
}

fn found(places_m: &[[f64; 2]]) -> Vec<(usize, usize)> {
    let visits = at(places_m);
    let pairs = visits.pairs(NEAR_M, false);
    assert_eq!(pairs.is_empty(), !visits.have_another(NEAR_M, false).contains(&true));
    pairs.into_iter().map(|pair| (pair.first, pair.second)).collect()
}

#[test]
fn a_way_out_and_back_is_paired_place_by_place() {
    let out = (0..20).map(|k| [12.0 * f64::from(k), 0.0]);
    let back = (0..20).rev().map(|k| [12.0 * f64::from(k) + 2.0, 4.0]);
    let way: Vec<[f64; 2]> = out.chain(back).collect();
    // Those next to the turn are too few segments apart.
    let expected: Vec<(usize, usize)> = (0..18).map(|k| (k, 39 - k)).collect();
    assert_eq!(found(&way), expected);
}

#[test]
fn laps_are_paired_each_with_each() {
    let lap = |radius_m: f64| {
        (0..20).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 20.0;
            [radius_m * angle.cos(), radius_m * angle.sin()]
        })
    };
    let way: Vec<[f64; 2]> = lap(38.0).chain(lap(38.5)).chain(lap(39.0)).collect();
    let mut expected: Vec<(usize, usize)> =
        (0..60).flat_map(|a| [20, 40].map(|lap| (a, a + lap))).filter(|(_, b)| *b < 60).collect();
    // The end of the last lap reaches the start of the first.
    expected.push((0, 59));
    expected.sort_unstable();
    assert_eq!(found(&way), expected);
}

#[test]
fn neighbours_on_one_way_are_no_revisits() {
    let straight: Vec<[f64; 2]> = (0..40).map(|k| [2.0 * f64::from(k), 0.0]).collect();
    assert_eq!(found(&straight), []);
    // Slow curves neither, though they are within 15 m of their position 10 segments before.
    let curve: Vec<[f64; 2]> = (0..40)
        .map(|k| {
            let angle = 0.05 * f64::from(k);
            [20.0 * angle.cos(), 20.0 * angle.sin()]
        })
        .collect();
    assert_eq!(found(&curve), []);
}

#[test]
fn cameras_that_look_elsewhere_are_not_paired() {
    let out = (0..10).map(|k| [f64::from(k), 0.0]);
    let way: Vec<[f64; 2]> = out.clone().chain(out.rev()).collect();
    let mut visits = at(&way);
    assert!(!visits.pairs(1.5, true).is_empty());
    for pose in &mut visits.poses[10..] {
        pose.rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::PI);
    }
    assert_eq!(visits.pairs(1.5, true), []);
    assert!(!visits.have_another(1.5, true).contains(&true));
    assert!(!visits.pairs(1.5, false).is_empty());
}

proptest! {
    /// The slow reference: every visit compared with every other.
    #[test]
    fn pairs_are_those_of_all_comparisons(
        steps in prop::collection::vec((-14.0..14.0_f64, -14.0..14.0_f64), 5..60),
    ) {
        let mut way: Vec<[f64; 2]> = vec![[0.0, 0.0]];
        for (x, y) in steps {
            let last = way[way.len() - 1];
            way.push([last[0] + x, last[1] + y]);
        }
        let Visits { along_m, .. } = at(&way);
        let apart = |a: usize, b: usize| (way[a][0] - way[b][0]).hypot(way[a][1] - way[b][1]);
        let near = |a: usize, b: usize| {
            b < way.len() && a.abs_diff(b) >= LAG && apart(a, b) <= NEAR_M
                && WAY_PER_DISTANCE * apart(a, b) <= (along_m[a] - along_m[b]).abs()
        };
        // Nearest of the row of neighbours that `b` is in: the first of equal ones.
        let is_nearest = |a: usize, b: usize| {
            let behind = (b + 1..way.len()).take_while(|&c| near(a, c)).all(|c| apart(a, c) >= apart(a, b));
            let before = (0..b).rev().take_while(|&c| near(a, c)).all(|c| apart(a, c) > apart(a, b));
            near(a, b) && behind && before
        };
        let mut expected = Vec::new();
        for a in 0..way.len() {
            expected.extend((a + 1..way.len()).filter(|&b| is_nearest(a, b) && is_nearest(b, a)).map(|b| (a, b)));
        }
        prop_assert_eq!(found(&way), expected);
    }
}
