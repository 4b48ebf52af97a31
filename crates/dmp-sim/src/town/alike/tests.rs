//! Streets that are alike are the same after every period, as rays see them.

use std::f64::consts::TAU;

use crate::SimError;
use crate::town::{Scenery, Town, TownOptions};
use nalgebra::Vector3;

fn town(period_m: f64) -> Town {
    Town::new(TownOptions::of(Scenery::Alike { period_m }).unwrap()).unwrap()
}

/// The ranges of a sensor's turn, none where nothing is met within 100 m.
fn turn_m(town: &Town, origin: Vector3<f64>) -> Vec<Option<f64>> {
    let beams = (0..16).flat_map(|beam| (0..450).map(move |firing| (beam, firing)));
    let ranges = beams.map(|(beam, firing)| {
        let (sin_up, cos_up) = libm::sincos((f64::from(beam) - 7.5) * 0.035);
        let (sin, cos) = libm::sincos(TAU * f64::from(firing) / 450.0);
        let hit = town.cast(origin, Vector3::new(cos_up * cos, cos_up * sin, sin_up), 0.0);
        hit.map(|hit| hit.range_m).filter(|&range_m| range_m < 100.0)
    });
    ranges.collect()
}

/// The share of the beams that differ.
fn differing(a: &[Option<f64>], b: &[Option<f64>]) -> f64 {
    let differ = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() > 1e-6,
        (a, b) => a.is_some() != b.is_some(),
    };
    a.iter().zip(b).filter(|&pair| differ(pair)).count() as f64 / a.len() as f64
}

#[test]
fn a_street_shifted_by_a_period_is_the_same_and_by_less_it_is_not() {
    for period_m in [8.0, 11.3] {
        let town = town(period_m);
        let [east_m, north_m] = town.options().block_m;
        for (middle, ahead) in [
            (Vector3::new(1.5 * east_m + 1.3, north_m - 1.7, 1.9), Vector3::x()),
            (Vector3::new(east_m + 1.7, 1.5 * north_m + 0.4, 1.9), Vector3::y()),
        ] {
            let here = turn_m(&town, middle);
            for periods in [-1.0, 1.0] {
                let there = turn_m(&town, middle + ahead * (periods * period_m));
                let share = differing(&here, &there);
                let most = if ahead.x == 1.0 { 0.015 } else { 0.06 };
                assert!(share < most, "{period_m} m, along {ahead:?}: {share} of the beams differ");
            }
            let between = turn_m(&town, middle + ahead * (0.5 * period_m));
            let share = differing(&here, &between);
            assert!(share > 0.3, "{period_m} m: after half of it {share} of the beams differ");
        }
    }
}

#[test]
fn what_would_not_be_alike_is_refused() {
    let alike = TownOptions::of(Scenery::Alike { period_m: 8.0 }).unwrap();
    for options in [
        TownOptions { relief_m: 1.0, ..alike.clone() },
        TownOptions { block_m: [100.0, 48.0], ..alike.clone() },
        TownOptions { scenery: Scenery::Alike { period_m: 2.0 }, ..alike.clone() },
        TownOptions { scenery: Scenery::Alike { period_m: f64::NAN }, ..alike },
    ] {
        assert!(matches!(Town::new(options), Err(SimError::OutOfRange { .. })));
    }
    assert!(TownOptions::of(Scenery::Alike { period_m: 0.0 }).is_err());
}
