//! A plane, a box and a cylinder, densely sampled: what the caster predicts against the closed form.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Query};
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Store};
use dmp_sensor::Ray;

type Point = [f64; 3];

const OFFSETS: [Point; 2] = [[0.0; 3], [500_000.0, 4_000_000.0, 90.0]];

fn map_of(points: impl Iterator<Item = Point>, offset: Point) -> Store {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(0.1).unwrap(), usize::MAX, folder.path()).unwrap();
    let points: Vec<Point> = points.map(|p| std::array::from_fn(|k| p[k] + offset[k])).collect();
    // All seen in segment 0: every surfel is independent of segment 10.
    fuser.add(&points, Some(0), &mut FuseBuffers::default()).unwrap();
    let path = folder.path().join("map");
    fuser.finish(&path, &dmp_map::Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    Store::open(&path).unwrap()
}

/// Casts towards `targets` and compares all three answers with `range_of` (closed form from the origin).
fn check(store: Store, offset: Point, origin: Point, targets: impl Iterator<Item = Point>) {
    let queries: Vec<Query> = targets
        .map(|target| {
            let to: Point = std::array::from_fn(|k| target[k] - origin[k]);
            let range = to.iter().map(|c| c * c).sum::<f64>().sqrt();
            Query {
                ray: Ray {
                    origin_in_world: std::array::from_fn(|k| origin[k] + offset[k]),
                    direction_in_world: to.map(|c| c / range),
                    range_m: range,
                },
                segment: Some(10),
            }
        })
        .collect();
    assert!(queries.len() > 500);
    let caster = Caster::new(store, CastSettings::default(), usize::MAX);
    let mut answers = Vec::new();
    caster.cast(&queries, &mut answers, &mut CastBuffers::default()).unwrap();
    for (query, answer) in queries.iter().zip(&answers) {
        for predicted in [answer.first_m, answer.nearest_m, answer.independent_m] {
            let error = predicted.map(|z| (z - query.ray.range_m).abs());
            assert!(error.is_some_and(|e| e < 1e-3), "{query:?} {answer:?} {error:?}");
        }
        assert!(answer.revisited);
    }
}

fn grid(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> + Clone {
    let count = ((high - low) / step).round() as usize;
    (0..=count).map(move |i| low + (high - low) * i as f64 / count as f64)
}

#[test]
fn a_tilted_plane() {
    let at = |y: f64, z: f64| [20.0 + 0.3 * y - 0.2 * z, y, z];
    for offset in OFFSETS {
        let points = grid(-40.0, 40.0, 0.025).flat_map(|y| grid(-4.0, 4.0, 0.025).map(move |z| at(y, z)));
        let store = map_of(points, offset);
        assert!(store.entries().count() > 2, "the plane lies in several tiles");
        let targets = grid(-39.0, 39.0, 0.49).flat_map(|y| grid(-3.0, 3.0, 0.47).map(move |z| at(y, z)));
        check(store, offset, [0.0, 0.0, 1.0], targets);
    }
}

#[test]
fn a_box_from_inside() {
    let half = [9.0, 7.0, 3.0];
    let faces = |inset: f64, step: f64| {
        (0..3).flat_map(move |k| {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            [-half[k], half[k]].into_iter().flat_map(move |face| {
                grid(inset - half[a], half[a] - inset, step).flat_map(move |u| {
                    grid(inset - half[b], half[b] - inset, step).map(move |v| {
                        let mut p = [0.0; 3];
                        (p[k], p[a], p[b]) = (face, u, v);
                        p
                    })
                })
            })
        })
    };
    for offset in OFFSETS {
        let store = map_of(faces(0.0, 0.03), offset);
        // Away from the edges, where a voxel sees two faces and a disc stands for both.
        check(store, offset, [1.0, -2.0, 0.5], faces(0.35, 0.53));
    }
}

#[test]
fn a_cylinder_from_outside() {
    // A disc of 8 cm, with the normal of its 20 cm cell, leaves this cylinder by under 0.5 mm at its rim.
    let radius = 25.0;
    let at = |angle: f64, z: f64| [40.0 + radius * angle.cos(), 3.0 + radius * angle.sin(), z];
    for offset in OFFSETS {
        let side = grid(2.5, 4.1, 0.0006);
        let points = side.flat_map(|a| grid(-3.0, 3.0, 0.012).map(move |z| at(a, z)));
        let store = map_of(points, offset);
        // The side that faces the origin, not too obliquely.
        let targets = grid(2.7, 3.9, 0.02).flat_map(|a| grid(-2.0, 2.0, 0.25).map(move |z| at(a, z)));
        check(store, offset, [0.0, 0.0, 0.3], targets);
    }
}

#[test]
fn a_stray_point_far_below_spoils_nothing() {
    let at = |x: f64, y: f64| [x, y, -1.5];
    let mut points: Vec<Point> =
        grid(1.0, 15.0, 0.025).flat_map(|x| grid(1.0, 12.0, 0.025).map(move |y| at(x, y))).collect();
    points.push([6.0, 6.0, -1e6]);
    let store = map_of(points.into_iter(), [0.0; 3]);
    let targets = grid(2.0, 9.0, 0.27).flat_map(|x| grid(2.0, 9.0, 0.29).map(move |y| at(x, y)));
    check(store, [0.0; 3], [1.0, 1.0, 1.0], targets);
}

#[test]
fn of_two_crossings_equally_near_the_nearer_to_the_sensor_is_told() {
    // Two walls with a tile's border between them, the measured range midway.
    let wall = |x: f64| {
        grid(0.0, 4.0, 0.025).flat_map(move |y| grid(-1.0, 1.0, 0.025).map(move |z| [x, y + 1.0, z]))
    };
    let store = map_of(wall(30.0).chain(wall(34.0)), [0.0; 3]);
    assert!(store.entries().count() == 2);
    let origin_in_world_m = [20.0, 3.0, 0.0];
    let direction_in_world = [1.0, 0.0, 0.0];
    let query = |measured_m| Query {
        ray: Ray { origin_in_world: origin_in_world_m, direction_in_world, range_m: measured_m },
        segment: Some(10),
    };
    let caster = Caster::new(store, CastSettings::default(), usize::MAX);
    let mut answers = Vec::new();
    let mut cast = |measured_m| {
        caster.cast(&[query(measured_m)], &mut answers, &mut CastBuffers::default()).unwrap();
        answers[0].nearest_m.unwrap()
    };
    // Where the two really are, then exactly between them.
    let (near, far) = (cast(10.0), cast(14.0));
    assert!(far - near > 3.9);
    assert_eq!(cast(f64::midpoint(near, far)), near);
}

#[test]
fn an_empty_map_answers_every_ray_with_a_miss() {
    let store = map_of(std::iter::empty(), OFFSETS[0]);
    let query = Query {
        ray: Ray { origin_in_world: [1.0, 2.0, 3.0], direction_in_world: [0.6, 0.0, 0.8], range_m: 7.0 },
        segment: Some(10),
    };
    // Whatever the list held before.
    let mut answers = vec![Answer { first_m: Some(1.0), ..Answer::default() }; 12];
    let caster = Caster::new(store, CastSettings::default(), 0);
    caster.cast(&[query; 9], &mut answers, &mut CastBuffers::default()).unwrap();
    assert_eq!(answers, [Answer::default(); 9]);
}
