//! The fused map against a slow, obvious one made from a sorted list, and against itself under other
//! orders, budgets and numbers of threads.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::collections::BTreeMap;
use std::path::Path;

use dmp_map::{Durability, FuseBuffers, Independence, Lattice, MapFuser, Store, UNITS_PER_M};

type Point = [f64; 3];

/// Scans of a wavy ground with walls, around `centre`: several tiles, some of them revisited.
fn scans(centre: Point) -> Vec<Vec<Point>> {
    let mut state = 7u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..40)
        .map(|s| {
            let along = f64::from(if s < 25 { s } else { 49 - s }) * 3.0;
            let mut points = Vec::new();
            for _ in 0..1500 {
                let (x, y) = (along + 20.0 * (random() - 0.5), 20.0 * (random() - 0.5));
                points.push([x, y, 0.3 * (x * 0.2).sin() + 0.02 * random()]);
            }
            for _ in 0..500 {
                points.push([along + 20.0 * (random() - 0.5), 6.0 + 0.02 * random(), 4.0 * random()]);
            }
            points.iter().map(|p| std::array::from_fn(|k| p[k] + centre[k])).collect()
        })
        .collect()
}

fn fuse(
    folder: &Path,
    scans: &[Vec<Point>],
    order: &[usize],
    budget_bytes: usize,
    threads: usize,
) -> Vec<u8> {
    let fuser = MapFuser::new(Lattice::new(0.2).unwrap(), budget_bytes, folder).unwrap();
    let parts: Vec<&[usize]> = order.chunks(order.len().div_ceil(threads)).collect();
    std::thread::scope(|scope| {
        for part in parts {
            let fuser = &fuser;
            scope.spawn(move || {
                let mut buffers = FuseBuffers::default();
                for &s in part {
                    fuser.add(&scans[s], Some(s as i32), &mut buffers).unwrap();
                }
            });
        }
    });
    assert_eq!(fuser.points(), scans.iter().map(|s| s.len() as u64).sum::<u64>());
    assert_eq!(budget_bytes < 1 << 30, fuser.scratch_bytes() > 0, "the small budget must be felt");
    let path = folder.join("map.dmpmap");
    fuser.finish(&path, &dmp_map::Origin::of("test"), Durability::Temporary, &|_, _| ()).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn order_budget_and_threads_leave_the_bytes_alone() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans([100.0, -50.0, 3.0]);
    let forward: Vec<usize> = (0..scans.len()).collect();
    let mut shuffled = forward.clone();
    shuffled.sort_by_key(|s| s * 7919 % 41);
    let whole = fuse(folder.path(), &scans, &forward, usize::MAX, 1);
    for (order, budget_bytes, threads) in
        [(&shuffled, usize::MAX, 1), (&forward, 1 << 20, 1), (&shuffled, 1 << 20, 4), (&forward, 1, 2)]
    {
        let other = fuse(folder.path(), &scans, order, budget_bytes, threads);
        assert!(whole == other, "budget {budget_bytes}, {threads} threads");
    }
}

/// One voxel as the definition says it, in f64, from the list of its points.
struct Expected {
    centre: Point,
    cell: Vec<Point>,
    segments: Vec<i32>,
}

fn expected(scans: &[Vec<Point>]) -> Vec<Expected> {
    let edge = (0.2 * UNITS_PER_M).round() as i64;
    let units = |p: &Point| p.map(|c| (c * UNITS_PER_M).round() as i64);
    let mut voxels: BTreeMap<[i64; 3], Vec<([i64; 3], i32)>> = BTreeMap::new();
    for (s, scan) in scans.iter().enumerate() {
        for point in scan {
            let u = units(point);
            voxels.entry(u.map(|u| u.div_euclid(edge))).or_default().push((u, s as i32));
        }
    }
    let metres = |u: &[i64; 3]| u.map(|u| u as f64 / UNITS_PER_M);
    let mut cells: BTreeMap<[i64; 3], Vec<Point>> = BTreeMap::new();
    for (voxel, points) in &voxels {
        let cell = voxel.map(|v| v.div_euclid(2));
        cells.entry(cell).or_default().extend(points.iter().map(|p| metres(&p.0)));
    }
    let mut all = Vec::new();
    for (voxel, points) in &voxels {
        let cell = &cells[&voxel.map(|v| v.div_euclid(2))];
        if points.len() >= 3 && cell.len() >= 5 {
            let mean = |k: usize| points.iter().map(|p| metres(&p.0)[k]).sum::<f64>() / points.len() as f64;
            let segments = points.iter().map(|p| p.1).collect();
            all.push(Expected { centre: std::array::from_fn(mean), cell: cell.clone(), segments });
        }
    }
    all
}

#[test]
fn it_is_the_map_of_the_definition() {
    for centre in [[0.0; 3], [500_000.0, 4_000_000.0, 120.0]] {
        let folder = tempfile::tempdir().unwrap();
        let scans = scans(centre);
        let order: Vec<usize> = (0..scans.len()).collect();
        fuse(folder.path(), &scans, &order, 1 << 20, 2);
        let store = Store::open(&folder.path().join("map.dmpmap")).unwrap();

        let mut found = Vec::new();
        for entry in store.entries() {
            let tile = store.load(entry.tile).unwrap().unwrap();
            for surfel in &tile.surfels[..tile.own] {
                let c: Point = std::array::from_fn(|k| {
                    tile.origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k])
                });
                found.push((c, *surfel));
            }
        }
        let expected = expected(&scans);
        assert_eq!(found.len(), expected.len());
        assert_eq!(store.surfels(), expected.len() as u64);
        // Voxels differ by more than rounding in at least one coordinate: nearest centre is the match.
        let key = |c: &Point| c.map(|c| (c / 3e-4).round() as i64);
        let mut by_place: BTreeMap<[i64; 3], &Expected> = BTreeMap::new();
        for e in &expected {
            for d in 0..27 {
                let k = key(&e.centre);
                by_place.insert([k[0] + d % 3 - 1, k[1] + d / 3 % 3 - 1, k[2] + d / 9 - 1], e);
            }
        }
        for (centre, surfel) in found {
            let e = by_place[&key(&centre)];
            // Rounded to a quarter of a unit within the disc's plane, to a 32nd out of it.
            let moved: Point = std::array::from_fn(|k| centre[k] - e.centre[k]);
            let off: f64 = (0..3).map(|k| moved[k] * f64::from(surfel.normal[k])).sum();
            assert!(moved.iter().all(|c| c.abs() * UNITS_PER_M <= 0.27), "{centre:?} {:?}", e.centre);
            assert!(off.abs() * UNITS_PER_M <= 1.02 / 64.0, "{off} {centre:?} {:?}", e.centre);
            // The normal minimises the spread: no other direction nearby has less.
            let n = e.cell.len() as f64;
            let mean: Point = std::array::from_fn(|k| e.cell.iter().map(|p| p[k]).sum::<f64>() / n);
            let covariance = nalgebra::Matrix3::from_fn(|i, j| {
                e.cell.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>() / n
            });
            let smallest = covariance.symmetric_eigenvalues().min();
            let normal = nalgebra::Vector3::from(surfel.normal.map(f64::from));
            let along = normal.dot(&(covariance * normal));
            assert!((along - smallest).abs() < 1e-7, "{along} {smallest}");
            for s in 0..scans.len() as i32 {
                let before = e.segments.iter().filter(|&&o| o < s - 1).count();
                let after = e.segments.iter().filter(|&&o| o > s + 1).count();
                let holds = Independence::of(s, 1).holds(surfel.third_lowest, surfel.third_highest);
                assert_eq!(holds, before >= 3 || after >= 3);
            }
        }
    }
}

#[test]
fn every_disc_is_in_every_tile_it_reaches() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans([0.0; 3]);
    let order: Vec<usize> = (0..scans.len()).collect();
    fuse(folder.path(), &scans, &order, usize::MAX, 1);
    let store = Store::open(&folder.path().join("map.dmpmap")).unwrap();
    let edge = store.lattice().tile_edge_m();
    let radius = store.lattice().disc_radius_m() as f32;
    let tiles: Vec<_> = store.entries().map(|e| store.load(e.tile).unwrap().unwrap()).collect();
    assert!(tiles.len() >= 4);
    let mut copies = 0;
    for from in &tiles {
        for surfel in &from.surfels[..from.own] {
            for to in tiles.iter().filter(|t| t.id != from.id) {
                let local: [f64; 3] = std::array::from_fn(|k| {
                    f64::from(surfel.centre_in_tile_m[k]) + from.origin_in_world_m[k]
                        - to.origin_in_world_m[k]
                });
                let half = surfel.half_extents_m(radius);
                let reaches = (0..2)
                    .all(|k| local[k] + f64::from(half[k]) > 0.0 && local[k] - f64::from(half[k]) < edge);
                if reaches {
                    let there = to.surfels[to.own..]
                        .iter()
                        .any(|s| (0..3).all(|k| (f64::from(s.centre_in_tile_m[k]) - local[k]).abs() < 1e-4));
                    assert!(there, "{surfel:?} of {} is missing in {}", from.id, to.id);
                    copies += 1;
                }
            }
        }
    }
    assert!(copies > 50);
}

#[test]
fn a_map_put_down_and_taken_up_again_has_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scans = scans([100.0, -50.0, 3.0]);
    let forward: Vec<usize> = (0..scans.len()).collect();
    let whole = fuse(folder.path(), &scans, &forward, usize::MAX, 1);
    let (lattice, scratch) = (Lattice::new(0.2).unwrap(), folder.path().join("scratch"));
    let mut buffers = FuseBuffers::default();
    let mut fuser = MapFuser::with_scratch(lattice, 1 << 20, &scratch).unwrap();
    for (s, points) in scans.iter().enumerate() {
        fuser.add(points, Some(s as i32), &mut buffers).unwrap();
        if s % 13 == 5 {
            let state = fuser.put_down().unwrap();
            // What comes after is lost with the process, as in a kill.
            fuser.add(points, Some(s as i32), &mut buffers).unwrap();
            drop(fuser);
            fuser = MapFuser::resume(lattice, 1 << 20, &scratch, &state).unwrap();
        }
    }
    let path = folder.path().join("resumed.dmpmap");
    fuser.finish(&path, &dmp_map::Origin::of("test"), Durability::Temporary, &|_, _| ()).unwrap();
    assert!(std::fs::read(path).unwrap() == whole);
}

#[test]
fn a_scratch_file_that_lost_its_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (lattice, scratch) = (Lattice::new(0.2).unwrap(), folder.path().join("scratch"));
    let fuser = MapFuser::with_scratch(lattice, 1 << 20, &scratch).unwrap();
    fuser.add(&scans([0.0; 3])[0], Some(0), &mut FuseBuffers::default()).unwrap();
    let state = fuser.put_down().unwrap();
    let bytes = std::fs::read(&scratch).unwrap();
    std::fs::write(&scratch, &bytes[..bytes.len() - 1]).unwrap();
    let error = MapFuser::resume(lattice, 1 << 20, &scratch, &state).unwrap_err();
    assert!(error.to_string().contains("do not fit"), "{error}");
    std::fs::write(&scratch, bytes.iter().map(|b| b ^ 1).collect::<Vec<u8>>()).unwrap();
    let changed = MapFuser::resume(lattice, 1 << 20, &scratch, &state).unwrap();
    let path = folder.path().join("map.dmpmap");
    let error =
        changed.finish(&path, &dmp_map::Origin::of("test"), Durability::Temporary, &|_, _| ()).unwrap_err();
    assert!(error.to_string().contains("changed on disk"), "{error}");
}
