//! The caster against every ray tested with every disc, in `f64`.
//!
//! Rounding may decide differently only for a ray that grazes a disc's rim, runs along its plane or ends
//! at the horizon. So the oracle answers twice: with discs a little smaller ("surely hit") and a little
//! larger ("perhaps hit"), and the caster's answer must lie between the two, for every ray.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Grouping, Hit, HitDisc, Path, Query, Wanted};
use dmp_map::{Durability, FuseBuffers, Independence, Lattice, LooseSurfels, MapFuser, Store, WorldSurfel};
use dmp_sensor::Ray;
use proptest::prelude::*;

const TOLERANCE_M: f64 = 1e-3;

struct Disc {
    centre: [f64; 3],
    normal: [f64; 3],
    third_lowest: i32,
    third_highest: i32,
}

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// A map of discs strewn over several tiles in all orientations, seen from random segments.
fn random_map(random: &mut Random, offset: [f64; 3], voxels: usize) -> Store {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(0.5).unwrap(), usize::MAX, folder.path()).unwrap();
    let mut buffers = FuseBuffers::default();
    for _ in 0..voxels {
        let corner = [random.between(-40.0, 70.0), random.between(-40.0, 70.0), random.between(-6.0, 6.0)];
        let corner: [f64; 3] = std::array::from_fn(|k| ((corner[k] + offset[k]) / 0.5).floor() * 0.5);
        let first = random.between(0.0, 30.0) as i32;
        for visit in 0..=(random.unit() * 3.0) as i32 {
            let points: Vec<[f64; 3]> =
                (0..5).map(|_| corner.map(|c| c + random.between(0.01, 0.49))).collect();
            fuser.add(&points, Some((first + visit * 6).min(30)), &mut buffers).unwrap();
        }
    }
    let path = folder.path().join("map");
    fuser.finish(&path, &dmp_map::Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    Store::open(&path).unwrap()
}

fn discs_of(store: &Store) -> Vec<Disc> {
    let mut discs = Vec::new();
    for entry in store.entries() {
        let tile = store.load(entry.tile).unwrap().unwrap();
        discs.extend(tile.surfels[..tile.own].iter().map(|s| Disc {
            centre: std::array::from_fn(|k| tile.origin_in_world_m[k] + f64::from(s.centre_in_tile_m[k])),
            normal: s.normal.map(f64::from),
            third_lowest: s.third_lowest,
            third_highest: s.third_highest,
        }));
    }
    discs
}

/// All crossings of a ray, with the discs' radius and the limits made larger by `slack` (or smaller).
fn crossings<'a>(
    discs: &'a [Disc],
    query: &'a Query,
    settings: &'a CastSettings,
    radius_m: f64,
    slack: f64,
) -> impl Iterator<Item = (f64, &'a Disc)> {
    let (o, d) = (query.ray.origin_in_world, query.ray.direction_in_world);
    discs.iter().filter_map(move |disc| {
        let to: [f64; 3] = std::array::from_fn(|k| disc.centre[k] - o[k]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let cos = dot(disc.normal, d);
        let t = dot(disc.normal, to) / cos;
        let off: [f64; 3] = std::array::from_fn(|k| t * d[k] - to[k]);
        let hit = cos.abs() >= 0.01 * (1.0 - slack)
            && dot(off, off).sqrt() <= radius_m + slack
            && t >= -slack
            && t <= settings.horizon_m + slack;
        hit.then_some((t, disc))
    })
}

/// The definition, word for word.
fn brute_force(discs: &[Disc], query: &Query, settings: &CastSettings, radius_m: f64, slack: f64) -> Answer {
    let mut answer = Answer::default();
    let smaller = |a: Option<f64>, t: f64| Some(a.map_or(t, |a| a.min(t)));
    let independent = |disc: &Disc, reach: i32| {
        let independence = query.segment.map(|s| Independence::of(s, reach));
        independence.is_some_and(|i| i.holds(disc.third_lowest, disc.third_highest))
    };
    for (t, disc) in crossings(discs, query, settings, radius_m, slack) {
        answer.first_m = smaller(answer.first_m, t);
        let gap = (t - query.ray.range_m).abs();
        if gap < settings.window_m + slack
            && answer.nearest_m.is_none_or(|nearest| gap < (nearest - query.ray.range_m).abs())
        {
            answer.nearest_m = Some(t);
        }
        if independent(disc, settings.reach) {
            answer.independent_m = smaller(answer.independent_m, t);
        }
        let at_place = t <= query.ray.range_m + settings.return_m + slack;
        answer.revisited |= at_place && independent(disc, settings.revisit_reach);
    }
    answer
}

/// Whether a value to be made small lies between what is surely and what is perhaps reached.
fn between(perhaps: Option<f64>, found: Option<f64>, surely: Option<f64>) -> bool {
    let infinite = |v: Option<f64>| v.unwrap_or(f64::INFINITY);
    infinite(found) >= infinite(perhaps) - TOLERANCE_M && infinite(found) <= infinite(surely) + TOLERANCE_M
}

/// The disc is one that the ray crosses at that answer, its normal turned to where the ray comes from.
fn check_disc(
    discs: &[Disc],
    query: &Query,
    settings: &CastSettings,
    radius_m: f64,
    (hit, answer): (Hit, &Answer),
    found: Option<HitDisc>,
) {
    let at_m = answer.range_m(hit);
    assert_eq!(at_m.is_some(), found.is_some(), "{query:?} {hit:?}");
    let (Some(at_m), Some(found)) = (at_m, found) else { return };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let normal = found.normal_in_world.map(f64::from);
    assert!(dot(normal, query.ray.direction_in_world) <= 0.0, "{query:?} {normal:?}");
    let is_found = |disc: &Disc| {
        let off: [f64; 3] = std::array::from_fn(|k| disc.centre[k] - found.centre_in_world_m[k]);
        dot(off, off) < 1e-8 && dot(disc.normal, normal).abs() > 1.0 - 1e-6
    };
    let independence = query.segment.map(|s| Independence::of(s, settings.reach));
    let fits = |disc: &Disc| {
        hit != Hit::Independent
            || independence.is_some_and(|i| i.holds(disc.third_lowest, disc.third_highest))
    };
    let mut there = crossings(discs, query, settings, radius_m, 1e-4);
    let there = there.any(|(t, disc)| (t - at_m).abs() <= TOLERANCE_M && is_found(disc) && fits(disc));
    assert!(there, "{query:?} {hit:?} {found:?}");
}

fn check(store: Store, queries: &[Query], settings: CastSettings, budget_bytes: usize) -> [usize; 3] {
    let discs = discs_of(&store);
    let radius_m = store.lattice().disc_radius_m();
    let mut caster = Caster::new(store, settings, budget_bytes);
    let mut answers = Vec::new();
    caster.cast(queries, &mut answers, &mut CastBuffers::default()).unwrap();
    let kinds = [Hit::First, Hit::Nearest, Hit::Independent];
    let with_discs = |caster: &Caster, hit: Hit| {
        let (mut answers, mut discs) = (Vec::new(), Vec::new());
        let buffers = &mut CastBuffers::default();
        caster.cast_with_discs(queries, &mut answers, (hit, &mut discs), buffers).unwrap();
        (answers, discs)
    };
    let hit_discs = kinds.map(|hit| with_discs(&caster, hit).1);
    // The same bits on every path, however rays are grouped.
    for path in Path::all() {
        for grouping in [Grouping::Auto, Grouping::Single, Grouping::Packets] {
            caster = caster.with(path, grouping);
            let mut again = Vec::new();
            caster.cast(queries, &mut again, &mut CastBuffers::default()).unwrap();
            for (hit, discs) in kinds.into_iter().zip(&hit_discs) {
                let same = with_discs(&caster, hit);
                assert!(again == same.0 && *discs == same.1, "{} {grouping:?} {hit:?}", path.name());
            }
            let differ = answers.iter().zip(&again).position(|(a, b)| a != b);
            assert!(
                differ.is_none(),
                "{} {grouping:?}: {:?}",
                path.name(),
                differ.map(|k| (answers[k], again[k]))
            );
        }
    }
    let mut hits = [0; 3];
    for (k, (query, found)) in queries.iter().zip(&answers).enumerate() {
        for (hit, hit_discs) in kinds.into_iter().zip(&hit_discs) {
            check_disc(&discs, query, &settings, radius_m, (hit, found), hit_discs[k]);
        }
        let surely = brute_force(&discs, query, &settings, radius_m, -1e-4);
        let perhaps = brute_force(&discs, query, &settings, radius_m, 1e-4);
        let gap = |a: &Answer| a.nearest_m.map(|t| (t - query.ray.range_m).abs());
        let fine = between(perhaps.first_m, found.first_m, surely.first_m)
            && between(perhaps.independent_m, found.independent_m, surely.independent_m)
            && between(gap(&perhaps), gap(found), gap(&surely))
            && (found.revisited || !surely.revisited)
            && (!found.revisited || perhaps.revisited);
        assert!(fine, "{query:?}\nfound   {found:?}\nsurely  {surely:?}\nperhaps {perhaps:?}");
        hits[0] += usize::from(found.first_m.is_some());
        hits[1] += usize::from(found.nearest_m.is_some());
        hits[2] += usize::from(found.independent_m.is_some());
    }
    hits
}

fn random_queries(random: &mut Random, offset: [f64; 3], count: usize) -> Vec<Query> {
    (0..count)
        .map(|i| {
            let heading = random.between(0.0, 6.3);
            let up = random.between(-0.15, 0.15);
            let mut d = [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()];
            // Every tenth ray runs along an axis, where the walk and the boxes divide by zero.
            if i % 10 == 0 {
                d = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]][i / 10 % 4];
            }
            let origin =
                [random.between(-45.0, 75.0), random.between(-45.0, 75.0), random.between(-3.0, 3.0)];
            Query {
                ray: Ray {
                    origin_in_world: std::array::from_fn(|k| origin[k] + offset[k]),
                    direction_in_world: d,
                    range_m: random.between(1.5, 60.0),
                },
                segment: Some(random.between(0.0, 31.0) as i32),
            }
        })
        .collect()
}

/// Rays of a spinning sensor on its way, ring by ring or column by column, in segment 12.
fn scan_queries(
    random: &mut Random,
    offset: [f64; 3],
    rings: usize,
    steps: usize,
    by_column: bool,
) -> Vec<Query> {
    let (x, y) = (random.between(-20.0, 40.0), random.between(-20.0, 40.0));
    let ray = |ring: usize, step: usize, random: &mut Random| {
        let share = step as f64 / steps as f64;
        let (heading, up) = (share * std::f64::consts::TAU, (ring as f64 / rings as f64 - 0.6) * 0.4);
        Query {
            ray: Ray {
                origin_in_world: [offset[0] + x + 0.8 * share, offset[1] + y - 0.3 * share, offset[2] + 1.5],
                direction_in_world: [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()],
                range_m: random.between(4.0, 6.0) * 1.5f64.powi((step / 40 % 5) as i32),
            },
            segment: Some(12),
        }
    };
    if by_column {
        (0..steps).flat_map(|s| (0..rings).map(move |r| (r, s))).map(|(r, s)| ray(r, s, random)).collect()
    } else {
        (0..rings).flat_map(|r| (0..steps).map(move |s| (r, s))).map(|(r, s)| ray(r, s, random)).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn so_they_are_for_the_rays_of_a_scan(seed in any::<u64>(), far in any::<bool>(), by_column in any::<bool>()) {
        let offset = if far { [500_000.0, 4_000_000.0, 250.0] } else { [0.0; 3] };
        let mut random = Random(seed);
        let store = random_map(&mut random, offset, 3000);
        let queries = scan_queries(&mut random, offset, 12, 200, by_column);
        let hits = check(store, &queries, CastSettings { horizon_m: 60.0, ..CastSettings::default() }, usize::MAX);
        prop_assert!(hits.iter().all(|&hits| hits > 20), "{hits:?}");
    }
}

#[test]
fn a_bound_behind_the_return_leaves_out_what_lies_beyond_and_nothing_else() {
    let mut random = Random(21);
    let queries = scan_queries(&mut random, [0.0; 3], 16, 400, true);
    let answers_of = |settings: CastSettings| {
        let caster = Caster::new(random_map(&mut Random(22), [0.0; 3], 8000), settings, usize::MAX);
        let mut answers = Vec::new();
        caster.cast(&queries, &mut answers, &mut CastBuffers::default()).unwrap();
        answers
    };
    let all = answers_of(CastSettings::default());
    let mut left_out = 0;
    for beyond_m in [0.2, 3.0] {
        let bounded = answers_of(CastSettings { beyond_m, ..CastSettings::default() });
        for ((query, all), bounded) in queries.iter().zip(&all).zip(&bounded) {
            let near = |range_m: Option<f64>| range_m.filter(|&t| t <= query.ray.range_m + beyond_m);
            // A bound is rounded as ranges are: to the bit only off its very edge.
            let on_the_edge =
                |t: Option<f64>| t.is_some_and(|t| (t - query.ray.range_m - beyond_m).abs() < 1e-4);
            for (all, bounded) in [(all.first_m, bounded.first_m), (all.independent_m, bounded.independent_m)]
            {
                assert!(near(all) == bounded || on_the_edge(all), "{all:?} {bounded:?}");
                left_out += usize::from(bounded.is_none() && all.is_some());
            }
        }
    }
    assert!(left_out > 500, "{left_out}");
}

#[test]
fn the_first_alone_is_the_first_of_three() {
    let mut random = Random(31);
    let mut queries = scan_queries(&mut random, [0.0; 3], 16, 300, false);
    queries.extend(random_queries(&mut random, [0.0; 3], 2000));
    let answers_of = |wanted| {
        let settings = CastSettings { wanted, ..CastSettings::default() };
        let caster = Caster::new(random_map(&mut Random(32), [0.0; 3], 8000), settings, usize::MAX);
        let mut answers = Vec::new();
        caster.cast(&queries, &mut answers, &mut CastBuffers::default()).unwrap();
        answers
    };
    for (three, first) in answers_of(Wanted::Three).iter().zip(&answers_of(Wanted::First)) {
        assert_eq!(*first, Answer { first_m: three.first_m, ..Answer::default() });
    }
}

#[test]
fn rays_that_are_none_find_nothing_and_spoil_no_packet() {
    let endless = CastSettings { horizon_m: f64::INFINITY, ..CastSettings::default() };
    let mut caster = Caster::new(random_map(&mut Random(41), [0.0; 3], 4000), endless, usize::MAX);
    let whole = scan_queries(&mut Random(42), [0.0; 3], 16, 320, false);
    let (mut answers, mut expected, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
    caster.cast(&whole, &mut expected, &mut buffers).unwrap();
    let axes: [&[usize]; 7] = [&[0], &[1], &[2], &[0, 1], &[0, 2], &[1, 2], &[0, 1, 2]];
    let values = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 4e38];
    // One ray of every packet or so is none.
    let mut queries = whole.clone();
    for (n, query) in queries.iter_mut().step_by(11).enumerate() {
        let (bad, axes) = (values[n / 7 % 5], axes[n % 7]);
        let of =
            if n / 35 % 2 == 0 { &mut query.ray.origin_in_world } else { &mut query.ray.direction_in_world };
        axes.iter().for_each(|&k| of[k] = bad);
        if n % 50 == 49 {
            query.ray.direction_in_world = [0.0; 3];
        }
    }
    for path in Path::all() {
        for grouping in [Grouping::Auto, Grouping::Single, Grouping::Packets] {
            caster = caster.with(path, grouping);
            caster.cast(&queries, &mut answers, &mut buffers).unwrap();
            for (k, (answer, expected)) in answers.iter().zip(&expected).enumerate() {
                let expected = if k % 11 == 0 { &Answer::default() } else { expected };
                assert_eq!(answer, expected, "{} {grouping:?} {k}: {:?}", path.name(), queries[k]);
            }
        }
    }
}

#[test]
fn scans_of_several_segments_and_a_sensor_on_its_side_are_cast_as_any() {
    let mut random = Random(51);
    let store = random_map(&mut random, [0.0; 3], 6000);
    let mut queries = scan_queries(&mut random, [0.0; 3], 12, 200, true);
    queries.iter_mut().enumerate().for_each(|(k, query)| query.segment = Some(10 + (k / 7 % 3) as i32));
    // The same turned over, so that rays go straight up and down.
    let turned: Vec<Query> = queries
        .iter()
        .map(|query| {
            let [x, y, z] = query.ray.direction_in_world;
            Query { ray: Ray { direction_in_world: [z, y, -x], ..query.ray }, segment: Some(12) }
        })
        .collect();
    queries.extend(turned);
    check(store, &queries, CastSettings::default(), usize::MAX);
}

#[test]
fn one_tile_of_half_a_kilometre_is_cast_the_same_in_packets_and_alone() {
    let mut random = Random(61);
    let surfels = (0..20_000).map(|_| {
        let to = [random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0)];
        let length = to.iter().map(|c| c * c).sum::<f64>().sqrt();
        WorldSurfel {
            centre_in_world_m: [
                random.between(0.0, 500.0),
                random.between(0.0, 500.0),
                random.between(0.0, 6.0),
            ],
            normal: to.map(|c| (c / length) as f32),
            third_lowest: random.between(0.0, 30.0) as i32,
            third_highest: random.between(0.0, 30.0) as i32,
        }
    });
    let map = LooseSurfels::new(500.0, 0.4, surfels).unwrap();
    let mut queries = scan_queries(&mut Random(62), [230.0, 240.0, 0.0], 32, 600, true);
    queries.iter_mut().for_each(|query| query.ray.range_m *= 8.0);
    let (mut alone, mut together) = (Vec::new(), Vec::new());
    for (grouping, answers) in [(Grouping::Single, &mut alone), (Grouping::Packets, &mut together)] {
        let caster = Caster::new(&map, CastSettings::default(), usize::MAX).with(Path::best(), grouping);
        caster.cast(&queries, answers, &mut CastBuffers::default()).unwrap();
    }
    assert!(alone == together);
    assert!(alone.iter().filter(|answer| answer.first_m.is_some()).count() > 300);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn all_three_answers_are_those_of_brute_force(seed in any::<u64>(), far in any::<bool>(), voxels in 50usize..3000) {
        let offset = if far { [500_000.0, 4_000_000.0, 250.0] } else { [0.0; 3] };
        let mut random = Random(seed);
        let store = random_map(&mut random, offset, voxels);
        let queries = random_queries(&mut random, offset, 600);
        let settings = CastSettings { horizon_m: 60.0, ..CastSettings::default() };
        check(store, &queries, settings, usize::MAX);
    }
}

#[test]
fn a_dense_map_gives_all_kinds_of_answers() {
    let mut random = Random(11);
    let store = random_map(&mut random, [0.0; 3], 20_000);
    assert!(store.entries().count() >= 16);
    let queries = random_queries(&mut random, [0.0; 3], 3000);
    let hits = check(store, &queries, CastSettings::default(), usize::MAX);
    assert!(hits.iter().all(|&h| h > 400), "{hits:?}");
}

#[test]
fn blocks_and_budget_do_not_change_a_bit() {
    let mut random = Random(5);
    let queries = random_queries(&mut random, [0.0; 3], 500);
    let answers_of = |budget_bytes: usize, block: usize| {
        let store = random_map(&mut Random(6), [0.0; 3], 5000);
        let caster = Caster::new(store, CastSettings::default(), budget_bytes);
        let (mut all, mut answers, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
        for block in queries.chunks(block) {
            caster.cast(block, &mut answers, &mut buffers).unwrap();
            all.extend_from_slice(&answers);
        }
        (all, caster.tile_loads())
    };
    let (whole, loads) = answers_of(usize::MAX, 500);
    assert!(loads <= 16 + 9);
    for (budget_bytes, block) in [(usize::MAX, 1), (1, 500), (50_000, 7)] {
        assert!(answers_of(budget_bytes, block).0 == whole);
    }
}

#[test]
fn returns_that_another_trajectory_poses_are_cast_as_any() {
    let caster = Caster::new(random_map(&mut Random(6), [0.0; 3], 8000), CastSettings::default(), usize::MAX);
    let mut random = Random(51);
    let posed = scan_queries(&mut random, [0.0; 3], 16, 300, true);
    let (sin, cos) = 0.7_f64.sin_cos();
    let elsewhere = posed.iter().map(|query| {
        let ([x, y, z], [a, b, c]) = (query.ray.origin_in_world, query.ray.direction_in_world);
        let direction_in_world = [cos * a - sin * b, sin * a + cos * b, c];
        let origin_in_world = [x + 3.0, y - 2.0, z + 0.2];
        Query { ray: Ray { origin_in_world, direction_in_world, ..query.ray }, segment: query.segment }
    });
    let others = random_queries(&mut random, [0.0; 3], posed.len());
    let (mut expected, mut answers, mut buffers) = (Vec::new(), Vec::new(), CastBuffers::default());
    // As meant; returns that are others, or fewer, or more than were cast last; and none before.
    for queries in [elsewhere.collect(), others, posed[..777].to_vec(), posed.clone()] {
        caster.cast(&queries, &mut expected, &mut CastBuffers::default()).unwrap();
        for reposed in 0..3 {
            caster.cast_reposed(&queries, &mut answers, &mut buffers).unwrap();
            assert!(answers == expected, "{reposed}");
            caster.cast(&posed, &mut answers, &mut buffers).unwrap();
        }
        assert!(expected.iter().filter(|answer| answer.first_m.is_some()).count() > 100);
    }
}

#[test]
fn a_block_loads_a_tile_once_for_rays_from_one_place() {
    let store = random_map(&mut Random(6), [0.0; 3], 5000);
    let tiles = store.entries().count() as u64;
    let mut queries = random_queries(&mut Random(5), [0.0; 3], 500);
    queries.iter_mut().for_each(|q| (q.ray.origin_in_world, q.segment) = ([5.0, 6.0, 0.0], Some(7)));
    let caster = Caster::new(store, CastSettings::default(), 1);
    caster.cast(&queries, &mut Vec::new(), &mut CastBuffers::default()).unwrap();
    assert!(caster.tile_loads() <= tiles, "{} loads of {tiles} tiles", caster.tile_loads());
}
