//! Rays meet what stands on the campus, and its stairs are met tread by tread.

use super::*;
use crate::town::Town;

/// Nearest entry among all solids, and the paving, without any grid.
fn brute(town: &Town, origin: Vector3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let solids = town.solids.iter().filter_map(|solid| solid.shape.entry(origin, direction));
    let paving = (direction.z < 0.0).then(|| -origin.z / direction.z);
    solids.map(|entry| entry.range_m).chain(paving).min_by(f64::total_cmp)
}

#[test]
fn rays_from_the_walk_meet_what_a_search_through_all_solids_finds() {
    let town = Town::campus(5);
    let mut random = Random::new(2, &[]);
    let mut stairs = 0;
    for n in 0..4000 {
        let [a, b] = [WALK[n % 19], WALK[n % 19 + 1]];
        let share = random.unit();
        let [x, y] = [0, 1].map(|k| a[k] + (b[k] - a[k]) * share);
        let origin = Vector3::new(x, y, walkable_m(x, y) + 1.2);
        let direction = Vector3::from_fn(|k, _| random.normal() * if k == 2 { 0.4 } else { 1.0 }).normalize();
        let hit = town.cast(origin, direction, 0.0).filter(|hit| hit.range_m < 200.0);
        let expected = brute(&town, origin, direction).filter(|&range_m| range_m < 200.0);
        match (hit, expected) {
            (None, None) => {}
            (Some(hit), Some(range_m)) => {
                assert!((hit.range_m - range_m).abs() < 1e-9, "{hit:?} {range_m}");
            }
            other => panic!("{origin:?} {direction:?}: {other:?}"),
        }
        stairs += usize::from(hit.is_some_and(|hit| hit.surface == Surface::Stairs));
    }
    assert!(stairs > 400, "{stairs}");
}

#[test]
fn stairs_are_met_tread_by_tread_and_walked_through_their_middle() {
    let town = Town::campus(1);
    for flight in &FLIGHTS {
        let [from, to] = flight.area[flight.axis];
        let riser_m = (flight.heights_m[1] - flight.heights_m[0]) / flight.risers as f64;
        let mut treads_m = Vec::new();
        for k in 0..200 {
            let mut at = flight.area.map(|[a, b]| f64::midpoint(a, b));
            at[flight.axis] = from + (to - from) * (f64::from(k) + 0.5) / 200.0;
            let hit = town.cast(Vector3::new(at[0], at[1], 20.0), -Vector3::z(), 0.0).unwrap();
            let tread_m = 20.0 - hit.range_m;
            let off_m = walkable_m(at[0], at[1]) - tread_m;
            assert!(off_m.abs() <= riser_m + 1e-9, "{at:?}: {off_m}");
            treads_m.push(tread_m);
        }
        treads_m.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        assert_eq!(treads_m.len(), flight.risers - 1);
        assert!(treads_m.windows(2).all(|pair| (pair[1] - pair[0] - riser_m).abs() < 1e-9));
    }
}
