//! The caster in each of its modes, on a small scene.

use super::*;
use crate::bench::cast::exact::Agreement;
use crate::bench::cast::files::Files;
use crate::bench::cast::records::{Record, write_numbers, write_records};

/// A wall of discs 10 m to the north of the rays, over four tiles.
fn work(folder: &std::path::Path) -> Work {
    const FAR_M: f32 = 65536.0;
    let steps = |from: i32, to: i32| (from..to).map(|k| k as f32 * 0.25);
    let surfels: Vec<Record> = steps(-160, 160)
        .flat_map(|x| steps(0, 16).map(move |z| [FAR_M + x, 10.0, z, 0.0, -1.0, 0.0, 0.25]))
        .collect();
    let rays: Vec<Record> = (-1000..1000)
        .map(|k| {
            let angle = f64::from(k) * 1e-3;
            let range_m = 10.0 / angle.cos() + if k % 2 == 0 { 0.3 } else { -7.0 };
            [FAR_M, 0.0, 0.9, angle.sin() as f32, angle.cos() as f32, 0.0, range_m as f32]
        })
        .collect();
    let path = |name: &str| folder.join(name);
    let files = Files {
        name: String::new(),
        surfels: path("s"),
        rays: path("r"),
        segments: Some([path("t"), path("e")]),
    };
    write_records(&files.surfels, surfels.iter()).unwrap();
    write_records(&files.rays, rays.iter()).unwrap();
    // Every other disc was seen in segment 9 alone, the others in 1.
    let support = (0..surfels.len()).flat_map(|k| [if k % 2 == 0 { 9i32 } else { 1 }; 2]);
    write_numbers(&path("t"), support.map(i32::to_le_bytes)).unwrap();
    write_numbers(&path("e"), rays.iter().map(|_| 9i32.to_le_bytes())).unwrap();
    Work::read(&files).unwrap()
}

/// By the definitions, over all discs: first, nearest, first independent.
fn by_definition(work: &Work, bound_m: f64) -> [Vec<f64>; 3] {
    let mut ranges = [(); 3].map(|()| Vec::new());
    let surfels: Vec<_> = work.world_surfels([0.0; 3]).collect();
    for query in work.queries([0.0; 3]) {
        let mut best = [f64::NAN; 3];
        for surfel in &surfels {
            let dot = |a: [f64; 3]| -> f64 { (0..3).map(|k| a[k] * f64::from(surfel.normal[k])).sum() };
            let to = |k: usize| surfel.centre_in_world_m[k] - query.origin_in_world_m[k];
            let cos = dot(query.direction_in_world);
            let range_m = dot([to(0), to(1), to(2)]) / cos;
            let off = |k: usize| range_m * query.direction_in_world[k] - to(k);
            let is_in = (0..3).map(|k| off(k) * off(k)).sum::<f64>() <= work.radius_m() * work.radius_m();
            if cos.abs() < 0.01 || !is_in || range_m < 0.0 || range_m > query.measured_m + bound_m {
                continue;
            }
            best[0] = best[0].min(range_m);
            if (range_m - query.measured_m).abs() <= 5.0 {
                best[1] = range_m;
            }
            if surfel.third_lowest < 8 {
                best[2] = best[2].min(range_m);
            }
        }
        ranges.iter_mut().zip(best).for_each(|(all, one)| all.push(one));
    }
    ranges
}

#[test]
fn every_mode_finds_what_the_definitions_say() {
    let folder = tempfile::tempdir().unwrap();
    let work = work(folder.path());
    let [all, bounded] = [f64::INFINITY, BOUND_M].map(|bound_m| by_definition(&work, bound_m));
    assert!(all[1].iter().any(|range| range.is_nan()) && bounded[0].iter().any(|range| range.is_nan()));
    let mut own = Own::new(work).unwrap();
    for path in Path::all() {
        for rest in ["single", "packets", "single-one-tree", "packets-bounded", "single-twice"] {
            for three in ["", "-three"] {
                let name = format!("{}-{rest}", path.name());
                let at = name.find("-bounded").or(name.find("-one")).or(name.find("-twice"));
                let (front, back) = name.split_at(at.unwrap_or(name.len()));
                let name = format!("{front}{three}{back}");
                let expected = if rest.ends_with("bounded") { &bounded } else { &all };
                let ranges = own.ranges(name.parse().unwrap()).unwrap();
                for k in if three.is_empty() { 0..1 } else { 0..3 } {
                    let agreement = Agreement::of(&ranges[k], &expected[k]);
                    assert!(agreement.is_exact(), "{name} z{k}: {agreement:?}");
                }
                assert!(own.cast_s(name.parse().unwrap()).unwrap() > 0.0);
            }
        }
    }
}

#[test]
fn all_trees_are_built_and_weighed() {
    let folder = tempfile::tempdir().unwrap();
    let mut own = Own::new(work(folder.path())).unwrap();
    assert!(own.tiles() >= 3 && own.build_s().unwrap() > 0.0);
    // At least the numbers themselves.
    assert!(own.tile_bytes() >= own.surfels() * 24, "{}", own.tile_bytes());
}

#[test]
fn modes_have_names() {
    let mode: Mode = "portable-packets-three-bounded-twice".parse().unwrap();
    assert_eq!((mode.path.name(), mode.grouping, mode.twice), ("portable", Grouping::Auto, true));
    assert_eq!(mode.kind, CasterKind { three: true, bounded: true, one_tree: false });
    let mode: Mode = "portable-single-one-tree".parse().unwrap();
    assert_eq!(mode.kind, CasterKind { three: false, bounded: false, one_tree: true });
    for wrong in ["", "single", "portable-", "portable-many", "portable-single-fast", "mmx-single"] {
        assert!(wrong.parse::<Mode>().is_err(), "{wrong}");
    }
}
