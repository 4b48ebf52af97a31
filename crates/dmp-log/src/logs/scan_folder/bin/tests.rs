//! Every known layout, found from files made after it.

use super::layout::KNOWN;
use super::layout_of;
use super::sound::parsed;
use crate::file::ReadCount;

/// Numbers from 0 to 1, the same each time.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A street as a turning LiDAR of 32 beams sees it, in the order of firing, of rings, or shuffled.
fn street(random: &mut Random, order: usize) -> Vec<([f64; 3], f64, f64)> {
    let (half_m, ahead_m) = (5.0 + 10.0 * random.uniform(), 20.0 + 60.0 * random.uniform());
    let mut points = Vec::new();
    for step in 0..400 {
        for ring in 0..32 {
            let azimuth = f64::from(step) / 400.0 * std::f64::consts::TAU;
            let elevation = (f64::from(ring) - 22.0) * 0.023;
            let direction =
                [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
            let to = |height_m: f64, along: f64| {
                if along.abs() < 1e-9 { f64::INFINITY } else { (height_m / along).max(0.0) }
            };
            let walls_m = to(half_m * direction[1].signum(), direction[1])
                .min(to(ahead_m * direction[0].signum(), direction[0]));
            let ground_m = if direction[2] < 0.0 { to(-1.8, direction[2]) } else { f64::INFINITY };
            let range_m = walls_m.min(ground_m) + 0.02 * random.normal();
            if range_m > 1.0 && range_m < 120.0 {
                points.push((direction.map(|c| c * range_m), f64::from(ring), f64::from(step) / 4000.0));
            }
        }
    }
    match order {
        0 => (),
        1 => points.sort_by(|a, b| a.1.total_cmp(&b.1)),
        _ => {
            for k in (1..points.len()).rev() {
                points.swap(k, (random.uniform() * (k + 1) as f64) as usize);
            }
        }
    }
    points
}

fn bytes_of(text: &str, points: &[([f64; 3], f64, f64)], random: &mut Random) -> Vec<u8> {
    let has_shares = random.uniform() < 0.5;
    let mut bytes = Vec::new();
    for (place_m, ring, time_s) in points {
        for part in text.split(',') {
            let (name, kind) = part.split_once(':').unwrap();
            let grey = (255.0 * random.uniform()).floor();
            let value = match name {
                "x" => place_m[0],
                "y" => place_m[1],
                "z" => place_m[2],
                "ring" => *ring,
                "t" if kind.starts_with('f') => *time_s,
                "t" | "offset_time" | "time_offset_ns" => 1e9 * time_s,
                "velocity" => 3.0 * random.normal(),
                "range" => 1e3 * place_m.iter().map(|c| c * c).sum::<f64>().sqrt(),
                "intensity" if has_shares && kind == "f4" => grey / 255.0,
                "tag" => 16.0,
                _ => grey,
            };
            match kind {
                "f4" => bytes.extend((value as f32).to_le_bytes()),
                "f8" => bytes.extend(value.to_le_bytes()),
                "u1" => bytes.push(value as u8),
                "u2" => bytes.extend((value as u16).to_le_bytes()),
                "u4" => bytes.extend((value as u32).to_le_bytes()),
                "i4" => bytes.extend((value as i32).to_le_bytes()),
                _ => unreachable!("{kind}"),
            }
        }
    }
    bytes
}

#[test]
fn every_known_layout_is_found_from_the_values_of_one_file() {
    each_is_found(6);
}

#[test]
#[ignore = "nightly: a hundred files of each layout"]
fn every_known_layout_is_found_a_hundred_times() {
    each_is_found(100);
}

fn each_is_found(files: u64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.bin");
    for (whose, text) in KNOWN {
        for number in 0..files {
            let mut random = Random(1 + number);
            let points = street(&mut random, number as usize % 3);
            std::fs::write(&path, bytes_of(text, &points, &mut random)).unwrap();
            let (found, note) =
                layout_of(folder.path(), std::slice::from_ref(&path), None, &ReadCount::default()).unwrap();
            assert_eq!(found, parsed(text), "{whose} {number}: {note:?}");
            assert_eq!(note.is_none(), whose == "KITTI");
        }
    }
}

#[test]
fn what_fits_no_layout_is_refused_with_its_length() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.bin");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        layout_of(folder.path(), std::slice::from_ref(&path), None, &ReadCount::default())
            .unwrap_err()
            .to_string()
    };
    let mut random = Random(5);
    let points = street(&mut random, 0);
    let strange = refused(&bytes_of("x:f4,y:f4,z:f4,a:u2,b:u2,c:u2,d:u1", &points, &mut random));
    assert!(
        strange.contains("points have 19 bytes by their values") && strange.contains("--bin-layout"),
        "{strange}"
    );
    let nclt: Vec<u8> = points
        .iter()
        .flat_map(|(place_m, ring, _)| {
            let steps = place_m.map(|c| (((c + 100.0) / 0.005) as u16).to_le_bytes());
            [steps.as_flattened(), &[40, *ring as u8]].concat()
        })
        .collect();
    assert!(
        refused(&nclt)
            .contains("points have 8 bytes by their values, which fit no layout known here: NCLT's")
    );
    let noise: Vec<u8> = (0..100_000).map(|_| (256.0 * random.uniform()) as u8).collect();
    assert!(refused(&noise).contains("their bytes repeat at no length of a point"));
}

/// What other data sets have in `.bin` files, and what is never to be read as points of metres.
#[test]
fn layouts_of_other_data_sets_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.bin");
    let points = street(&mut Random(9), 0);
    let grey = |k: usize| (k * 7 % 256) as f32;
    let each = |point: &dyn Fn(usize, [f64; 3]) -> Vec<u8>| -> Vec<u8> {
        points.iter().enumerate().flat_map(|(k, (place_m, ..))| point(k, *place_m)).collect()
    };
    let range_m = |place_m: [f64; 3]| place_m.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Oxford RobotCar: all x, then all y, all z, all intensities.
    let mut columns: Vec<f32> =
        (0..3).flat_map(|axis| points.iter().map(move |point| point.0[axis] as f32)).collect();
    columns.extend((0..points.len()).map(grey));
    for (whose, bytes) in [
        ("RobotCar", columns.iter().flat_map(|value| value.to_le_bytes()).collect()),
        (
            "KAIST's SICK",
            each(&|k, place_m| {
                [range_m(place_m) as f32, grey(k)].map(f32::to_le_bytes).as_flattened().to_vec()
            }),
        ),
        (
            "big-endian",
            each(&|k, [x, y, z]| {
                [x as f32, y as f32, z as f32, grey(k)].map(f32::to_be_bytes).as_flattened().to_vec()
            }),
        ),
        (
            "whole millimetres",
            each(&|k, place_m| {
                let [x, y, z] = place_m.map(|c| (1e3 * c) as i32);
                [x, y, z, grey(k) as i32].map(i32::to_le_bytes).as_flattened().to_vec()
            }),
        ),
        (
            "centimetres of 16 bits",
            each(&|k, place_m| {
                let [x, y, z] = place_m.map(|c| (1e2 * c) as i16);
                [x, y, z, grey(k) as i16].map(i16::to_le_bytes).as_flattened().to_vec()
            }),
        ),
        (
            "angles and ranges",
            each(&|k, place_m| {
                let [x, y, z] = place_m;
                let range = range_m(place_m);
                let polar = [y.atan2(x).to_degrees(), (z / range).asin().to_degrees(), 1e3 * range];
                let [a, e, r] = polar.map(|value| value as f32);
                [a, e, r, grey(k)].map(f32::to_le_bytes).as_flattened().to_vec()
            }),
        ),
    ] {
        std::fs::write(&path, &bytes).unwrap();
        let found = layout_of(folder.path(), std::slice::from_ref(&path), None, &ReadCount::default());
        assert!(found.is_err(), "{whose}: {found:?}");
    }
}

#[test]
fn a_few_points_are_taken_as_usual() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.bin");
    std::fs::write(&path, [1.0f32, 2.0, 3.0, 0.5].map(f32::to_le_bytes).as_flattened()).unwrap();
    assert_eq!(
        layout_of(folder.path(), &[path], None, &ReadCount::default()).unwrap(),
        (parsed(KNOWN[0].1), None)
    );
}
