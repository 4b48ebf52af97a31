//! Places whose surfaces do not hold everything.

use dmp_sensor::{Isometry3, Vector3};

use super::visits::{VOXEL_M, moved, pyramid, turned};
use crate::align::{Alignment, Refusal, align};

fn steps(count: i32, step_m: f64, phase_m: f64) -> impl Iterator<Item = f64> + Clone {
    (0..count).map(move |k| f64::from(k) * step_m + phase_m)
}

/// Points of a floor and two walls along x, with nothing that holds x, nor the corners, where surfels lie askew by how a voxel
/// halves them.
fn corridor(phase_m: f64) -> Vec<[f64; 3]> {
    let along = steps(400, 0.1, phase_m).map(|x| x - 20.0);
    let floor = along.clone().flat_map(|x| steps(30, 0.1, phase_m).map(move |y| [x, y - 1.5, 0.01]));
    let walls = along.flat_map(|x| steps(30, 0.1, phase_m).map(move |z| [x, z + 0.6]));
    let walls = walls.flat_map(|[x, z]| [[x, -2.01, z], [x, 2.01, z]]);
    floor.chain(walls).collect()
}

/// Points of a round tunnel along x.
fn tunnel(phase_m: f64) -> Vec<[f64; 3]> {
    let round = (0..160).map(move |k| {
        let angle = (f64::from(k) + 10.0 * phase_m) / 160.0 * std::f64::consts::TAU;
        [3.0 * angle.cos(), 3.0 * angle.sin()]
    });
    steps(400, 0.1, phase_m).flat_map(|x| round.clone().map(move |[y, z]| [x - 20.0, y, z])).collect()
}

fn off_by(found: &Alignment, by: &Isometry3<f64>) -> (Vector3<f64>, f64) {
    let between = found.target_from_source * by;
    (between.translation.vector, between.rotation.angle())
}

#[test]
fn a_bare_corridor_holds_all_but_the_place_along_it() {
    let target = pyramid(corridor(0.013));
    for by in [
        Isometry3::identity(),
        turned(0.0, [0.0, 0.2, 0.0]),
        turned(0.0, [0.0, -0.3, 0.25]),
        turned(0.02, [0.0, 0.4, -0.1]),
        turned(-0.03, [1.5, -0.2, 0.1]),
    ] {
        let source = pyramid(moved(&by, &corridor(0.051)));
        for guess in [0.0, 0.7] {
            let guess = turned(0.0, [guess, 0.0, 0.0]);
            let found = align(&target, &source, &[guess]).unwrap();
            let unheld = found.unheld.unwrap();
            assert!(found.held < 1e-3 && unheld.x.abs() > 0.9999, "{} along {unheld}", found.held);
            let (off_m, off_rad) = off_by(&found, &by);
            assert!(off_m.y.abs() < 0.002 && off_m.z.abs() < 0.002 && off_rad < 2e-4, "{off_m} {off_rad}");
            let variance_m2 = |along: Vector3<f64>| {
                let covariance_m2 = found.covariance.fixed_view::<3, 3>(3, 3) * along;
                covariance_m2.dot(&along)
            };
            assert!(variance_m2(unheld) >= (100.0 * VOXEL_M) * (100.0 * VOXEL_M));
            assert!(variance_m2(unheld.cross(&Vector3::z()).normalize()) < 0.03 * 0.03);
            // Along it, the middle is where the guess has it.
            let middle = moved(&by, &[[0.0, 0.0, 1.0]]);
            let kept_m = moved(&found.target_from_source, &middle)[0][0] - moved(&guess, &middle)[0][0];
            assert!(kept_m.abs() < 0.03, "{kept_m} m along");
        }
    }
}

/// Every place off by up to 3 cm along each axis, by a sequence of numbers of its own.
fn noisy(points: &[[f64; 3]], seed: u64) -> Vec<[f64; 3]> {
    let mut state = seed;
    let mut off_m = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.06 * ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
    };
    points.iter().map(|point| point.map(|n| n + off_m())).collect()
}

#[test]
fn noise_on_bare_walls_holds_nothing_along_them() {
    let middle = [[0.0, 0.0, 1.5]];
    for seed in 1..=6 {
        let by = turned(0.01, [0.0, 0.2, 0.1]);
        let target = pyramid(noisy(&corridor(0.013), seed));
        let source = pyramid(noisy(&moved(&by, &corridor(0.051)), seed + 100));
        let guess = turned(0.0, [0.3, 0.0, 0.0]);
        let found = align(&target, &source, &[guess]).unwrap();
        let (off_m, off_rad) = off_by(&found, &by);
        assert!(found.unheld.is_some_and(|along| along.x.abs() > 0.999), "{:?}", found.held);
        assert!(off_m.y.abs() < 0.005 && off_m.z.abs() < 0.005 && off_rad < 2e-3, "{off_m} {off_rad}");
        let kept_m = moved(&found.target_from_source, &middle)[0][0] - moved(&guess, &middle)[0][0];
        assert!(kept_m.abs() < 0.03, "{kept_m} m along");
    }
}

#[test]
fn what_holds_too_little_is_refused() {
    let ground = |phase_m: f64| {
        steps(400, 0.1, phase_m)
            .flat_map(move |x| steps(400, 0.1, phase_m).map(move |y| [x - 20.0, y - 20.0, 0.01]))
    };
    let error = align(&pyramid(ground(0.013)), &pyramid(ground(0.051)), &[]).unwrap_err();
    let Refusal::NotHeld { held, along } = error else { panic!("{error}") };
    assert!(held < 1e-3 && along[2].abs() < 0.01, "{held} {along:?}");
    // Along a round tunnel and about it.
    let error = align(&pyramid(tunnel(0.013)), &pyramid(tunnel(0.051)), &[]).unwrap_err();
    let Refusal::NotHeld { held, along } = error else { panic!("{error}") };
    assert!(held < 1e-3 && along[0].abs() > 0.99, "{held} {along:?}");
}
