//! How rays meet surfels, counted by the walk through the tiles and ray by ray, in `f64`.
//!
//! Rounding may decide differently only at a disc's rim or at the 0.5 m that part passing from ending. So the
//! oracle counts twice, with limits a little tighter and a little wider, and every count must lie between.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::ops::RangeInclusive;

use dmp_cast::{CountBuffers, CrossingCounter, Query};
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Met, Store, Tally, TileEntry, TileId, thin_map};
use dmp_sensor::Ray;

struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Discs strewn over several tiles in all orientations, seen in random segments.
fn strewn(random: &mut Random, voxels: usize) -> Store {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(0.5).unwrap(), usize::MAX, folder.path()).unwrap();
    for _ in 0..voxels {
        let corner = [random.between(-40.0, 40.0), random.between(-40.0, 40.0), random.between(-4.0, 4.0)];
        let points: Vec<[f64; 3]> =
            (0..5).map(|_| corner.map(|c| (c * 2.0).floor() / 2.0 + random.between(0.01, 0.49))).collect();
        let segment = random.between(0.0, 30.0) as i32;
        fuser.add(&points, Some(segment), &mut FuseBuffers::default()).unwrap();
    }
    let path = folder.path().join("map");
    fuser.finish(&path, &dmp_map::Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    Store::open(&path).unwrap()
}

fn queries(random: &mut Random, count: usize) -> Vec<Query> {
    let query = |_| {
        let (heading, up) = (random.between(0.0, 6.3), random.between(-0.1, 0.1));
        Query {
            ray: Ray {
                origin_in_world: [
                    random.between(-45.0, 45.0),
                    random.between(-45.0, 45.0),
                    random.between(-2.0, 2.0),
                ],
                direction_in_world: [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()],
                range_m: random.between(1.5, 60.0),
            },
            segment: None,
        }
    };
    (0..count).map(query).collect()
}

/// The tolerance, metres, and segments that count.
const ON_M: f64 = 0.5;
const PASS: RangeInclusive<i32> = 4..=20;

/// How all rays meet the surfels of a map, in the order of tiles and of surfels in them, with the centres.
fn direct(store: &Store, queries: &[Query], slack: f64) -> Vec<([f64; 3], Met)> {
    let mut tiles: Vec<TileId> = store.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let edge_m = store.lattice().tile_edge_m();
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let mut all = Vec::new();
    for tile in tiles {
        let (tile, id) = (store.load(tile).unwrap().unwrap(), tile);
        let corner_m = [f64::from(id.x) * edge_m, f64::from(id.y) * edge_m];
        for surfel in &tile.surfels[..tile.own] {
            let centre: [f64; 3] =
                std::array::from_fn(|k| tile.origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k]));
            let normal = surfel.normal.map(f64::from);
            let mut met = Met::default();
            let (low, high) = (surfel.third_lowest, surfel.third_highest);
            let is_of_pass = low.max(high) >= *PASS.start() && low.min(high) <= *PASS.end();
            for query in queries.iter().filter(|_| is_of_pass) {
                let (o, d) = (query.ray.origin_in_world, query.ray.direction_in_world);
                let to: [f64; 3] = std::array::from_fn(|k| centre[k] - o[k]);
                let cos = dot(normal, d);
                let t = dot(normal, to) / cos;
                let off: [f64; 3] = std::array::from_fn(|k| t * d[k] - to[k]);
                if cos.abs() < 0.01 * (1.0 - slack)
                    || dot(off, off).sqrt() > store.lattice().disc_radius_m() + slack
                    || t < -slack
                    || (0..2).any(|k| {
                        let at_m = o[k] + t * d[k] - corner_m[k];
                        !(-slack..edge_m + slack).contains(&at_m)
                    })
                {
                    continue;
                }
                let beyond_m = query.ray.range_m - t;
                met.on += u32::from(beyond_m.abs() <= ON_M + slack);
                met.through += u32::from(beyond_m * cos.abs() > ON_M - slack && beyond_m > ON_M - slack);
            }
            all.push((centre, met));
        }
    }
    all
}

/// What was counted, in the same order, and the centres of the surfels that no more rays pass through than end on.
fn counted(store: Store, queries: &[Query], budget_bytes: usize, block: usize) -> (Vec<Met>, Vec<[f64; 3]>) {
    let folder = tempfile::tempdir().unwrap();
    let tally = Tally::new(budget_bytes, folder.path()).unwrap();
    let counter = CrossingCounter::new(store, ON_M, budget_bytes);
    let mut buffers = CountBuffers::default();
    for block in queries.chunks(block) {
        counter.count(block, PASS, &tally, &mut buffers).unwrap();
    }
    let mut tiles: Vec<_> = counter.store().entries().collect();
    tiles.sort_unstable_by_key(|entry| entry.tile);
    let of_tile = |entry: &&TileEntry| tally.of_tile(entry.tile, entry.own.surfels as usize).unwrap();
    let met = tiles.iter().flat_map(of_tile).collect();
    let path = folder.path().join("thinned");
    let is_free = |met: Met| met.through > met.on;
    let map = (counter.store(), &tally);
    // A tile keeps all where more than the share of the rays that end in it end on what would be left out.
    let left = |share: f64| -> usize {
        let of_tile = |entry: &&TileEntry| {
            let met = of_tile(entry);
            let (out, rest): (Vec<Met>, Vec<Met>) = met.iter().partition(|&&met| is_free(met));
            let on = |met: &[Met]| met.iter().map(|met| f64::from(met.on)).sum::<f64>();
            if on(&out) > share * (on(&out) + on(&rest)) { met.len() } else { rest.len() }
        };
        tiles.iter().map(of_tile).sum()
    };
    for share in [0.0, 0.2, 0.35] {
        thin_map(map, |_| true, (is_free, share), (&path, Durability::Temporary), &|_, _| ()).unwrap();
        assert_eq!(Store::open(&path).unwrap().surfels() as usize, left(share), "{share}");
    }
    thin_map(map, |_| true, (is_free, 1.0), (&path, Durability::Temporary), &|_, _| ()).unwrap();
    let rest = direct(&Store::open(&path).unwrap(), &[], 0.0);
    (met, rest.into_iter().map(|(centre, _)| centre).collect())
}

#[test]
fn every_count_is_that_of_all_rays_and_all_discs() {
    let store = strewn(&mut Random(3), 6000);
    let copies: u32 = store.entries().map(|entry| entry.borders.surfels).sum();
    assert!(store.entries().count() >= 9 && copies > 100, "{copies} copies over borders");
    let queries = queries(&mut Random(4), 6000);
    let (surely, perhaps) = (direct(&store, &queries, -1e-4), direct(&store, &queries, 1e-4));
    let (found, rest) = counted(store, &queries, usize::MAX, 500);
    assert_eq!(found.len(), surely.len());
    let (mut sure, mut through) = (0, 0);
    for ((found, (_, surely)), (_, perhaps)) in found.iter().zip(&surely).zip(&perhaps) {
        assert!(
            surely.through <= found.through && found.through <= perhaps.through,
            "{surely:?} {found:?} {perhaps:?}"
        );
        assert!(surely.on <= found.on && found.on <= perhaps.on, "{surely:?} {found:?} {perhaps:?}");
        sure += usize::from(surely == perhaps);
        through += found.through;
    }
    assert!(sure * 10 > found.len() * 9 && through > 1000, "{sure} of {}, {through}", found.len());
    // The thinned map has the others, unchanged and in the same order.
    let others = surely.iter().zip(&found).filter(|(_, met)| met.through <= met.on);
    assert!(rest.len() < found.len() && others.map(|(disc, _)| disc.0).eq(rest));
}

#[test]
fn blocks_and_budget_change_no_count() {
    let queries = queries(&mut Random(4), 800);
    let of = |budget_bytes, block| counted(strewn(&mut Random(3), 3000), &queries, budget_bytes, block).0;
    let whole = of(usize::MAX, 800);
    assert!(whole.iter().any(|met| met.through > 0) && whole.iter().any(|met| met.on > 0));
    for (budget_bytes, block) in [(0, 800), (20_000, 7), (usize::MAX, 1)] {
        assert!(of(budget_bytes, block) == whole, "{budget_bytes} bytes, blocks of {block}");
    }
}
