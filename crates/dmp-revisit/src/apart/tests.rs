use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};

use dmp_sensor::along_m;

use super::*;

const RULER: f64 = 66.0;

/// Returns around the sensor, 20 m away.
fn returns() -> Moments {
    let around = (0..360).map(|k| {
        let turn = f32::to_radians(k as f32);
        [20.0 * turn.cos(), 20.0 * turn.sin(), 0.5 - (k % 3) as f32]
    });
    Moments::of(around)
}

fn ruler() -> Ruler {
    Ruler::of(dmp_reduce::Scales::Drive, false, returns())
}

/// Two and a half laps of 200 m, one scan each metre.
fn laps() -> Vec<Isometry3<f64>> {
    let radius_m = 100.0 / std::f64::consts::PI;
    let pose = |k: i32| {
        let turn = f64::from(k) / radius_m;
        let place = Vector3::new(radius_m * libm::cos(turn), radius_m * libm::sin(turn), 3.0);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_euler_angles(0.0, 0.0, turn + 1.57))
    };
    (0..500).map(pose).collect()
}

fn both(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> Vec<ScanInBoth> {
    let scan = |k: usize| ScanInBoth { scan: k as u64, run_from_sensor: [a[k], b[k]] };
    (0..a.len()).map(scan).collect()
}

fn apart(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> Apart {
    Apart::of(&both(a, b), 0, &ruler()).unwrap()
}

struct Random(u64);

impl Random {
    fn normal(&mut self) -> f64 {
        let mut unit = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        let (u, v) = (unit(), unit());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
    }
}

fn noisy(poses: &[Isometry3<f64>], sigma_m: f64, seed: u64) -> Vec<Isometry3<f64>> {
    let mut random = Random(seed);
    let mut moved =
        |pose: &Isometry3<f64>| Translation3::from(Vector3::from_fn(|_, _| sigma_m * random.normal())) * pose;
    poses.iter().map(&mut moved).collect()
}

/// The definition once more: every pair of scans, every return.
fn directly(scans: &[ScanInBoth], points: &[[f64; 3]]) -> [Vec<f64>; 2] {
    let of_run = |run: usize| {
        let places: Vec<_> =
            scans.iter().map(|scan| Some(scan.run_from_sensor[run].translation.vector)).collect();
        along_m(&places, 1.0)
    };
    let [a_m, b_m] = [0, 1].map(of_run);
    let along_m: Vec<f64> = a_m.iter().zip(&b_m).map(|(a_m, b_m)| 0.5 * (a_m + b_m)).collect();
    let distance = |i: usize, j: usize| {
        let put = |run: usize, p: &[f64; 3]| {
            let [i, j] = [i, j].map(|k| scans[k].run_from_sensor[run]);
            i.inverse() * (j * nalgebra::Point3::from(*p))
        };
        let square = points.iter().map(|p| (put(0, p) - put(1, p)).norm_squared()).sum::<f64>();
        (square / points.len() as f64).sqrt()
    };
    let (mut within, mut between) = (Vec::new(), Vec::new());
    for j in 0..scans.len() {
        for i in 0..j {
            if (j - i).is_power_of_two() && along_m[j] - along_m[i] <= 20.0 {
                within.push(distance(i, j));
            }
        }
        // The nearest of every earlier lap, in either run.
        let mut found: Vec<usize> = Vec::new();
        for run in 0..2 {
            let place = |k: usize| scans[k].run_from_sensor[run].translation.vector;
            let mut last: Option<usize> = None;
            let mut best: Vec<(usize, f64)> = Vec::new();
            for i in (0..j).filter(|&i| along_m[j] - along_m[i] >= RULER) {
                let apart_m = (place(i) - place(j)).norm();
                if apart_m <= 5.0 {
                    if last.is_some_and(|last| along_m[i] - along_m[last] < RULER) {
                        let best = best.last_mut().unwrap();
                        *best = if apart_m < best.1 { (i, apart_m) } else { *best };
                    } else {
                        best.push((i, apart_m));
                    }
                    last = Some(i);
                }
            }
            found.extend(best.into_iter().map(|(i, _)| i));
        }
        found.sort_unstable();
        found.dedup();
        between.extend(found.into_iter().map(|i| distance(i, j)));
    }
    [within, between]
}

#[test]
fn it_is_what_every_return_of_every_pair_of_scans_gives() {
    let truth = laps();
    let bent: Vec<Isometry3<f64>> = noisy(&truth, 0.02, 3)
        .iter()
        .enumerate()
        .map(|(k, pose)| Isometry3::rotation(Vector3::z() * 1e-4 * k as f64) * pose)
        .collect();
    let scans = both(&truth, &bent);
    let points: Vec<[f64; 3]> = (0..360)
        .map(|k| {
            let turn = f32::to_radians(k as f32);
            [20.0 * turn.cos(), 20.0 * turn.sin(), 0.5 - (k % 3) as f32].map(f64::from)
        })
        .collect();
    let found = Apart::of(&scans, 0, &ruler()).unwrap();
    let between = found.between.unwrap();
    for (spread, mut distances) in [found.within, between].into_iter().zip(directly(&scans, &points)) {
        distances.sort_by(f64::total_cmp);
        assert_eq!(spread.pairs, distances.len() as u64);
        let at = |share: f64| distances[(share * distances.len() as f64).ceil() as usize - 1];
        assert!((spread.median_m / at(0.5) - 1.0).abs() < 1e-5, "{spread:?} {}", at(0.5));
        assert!((spread.most_m / at(0.95) - 1.0).abs() < 1e-5, "{spread:?} {}", at(0.95));
    }
    assert!(between.worst_m > found.within.worst_m && between.worst_scans[0] >= 400, "{between:?}");
}

#[test]
fn a_rigid_copy_is_nowhere_apart() {
    let truth = laps();
    let to = Isometry3::from_parts(
        Translation3::new(431_000.0, 5_400_000.0, 90.0),
        UnitQuaternion::from_euler_angles(0.3, 1.0, -2.0),
    );
    let copy: Vec<Isometry3<f64>> = truth.iter().map(|pose| to * pose).collect();
    let found = apart(&truth, &copy);
    assert!(found.worst().0 < 1e-7 && found.is_same(Basis::CrossValidated, 1e-6), "{found:?}");
}

#[test]
fn white_noise_is_the_same_up_to_half_a_centimetre() {
    let truth = laps();
    // Two draws: 95 % of the distances are below √7.81 standard deviations of the four poses that take part.
    for (sigma_m, expected_m, is_same) in [(0.005, 0.028, true), (0.01, 0.056, false)] {
        let found = apart(&noisy(&truth, sigma_m, 1), &noisy(&truth, sigma_m, 2));
        assert!((found.within.most_m / expected_m - 1.0).abs() < 0.05, "{found:?}");
        assert_eq!(found.is_same(Basis::CrossValidated, 0.04), is_same, "{found:?}");
    }
}

#[test]
fn scale_bending_and_steps_are_never_the_same() {
    let truth = laps();
    let scaled = truth
        .iter()
        .map(|pose| Isometry3::from_parts((pose.translation.vector * 1.01).into(), pose.rotation));
    let mut turned = vec![truth[0]];
    for pair in truth.windows(2) {
        let yaw = Isometry3::rotation(Vector3::z() * 0.02_f64.to_radians());
        turned.push(turned[turned.len() - 1] * pair[0].inv_mul(&pair[1]) * yaw);
    }
    let step = truth
        .iter()
        .enumerate()
        .map(|(k, pose)| Translation3::new(if k >= 250 { 0.05 } else { 0.0 }, 0.0, 0.0) * pose);
    for wrong in [scaled.collect(), turned, step.collect::<Vec<_>>()] {
        let found = apart(&truth, &wrong);
        assert!(!found.is_same(Basis::CrossValidated, 0.04), "{found:?}");
    }
    // Where the step is, and no elsewhere.
    let step: Vec<Isometry3<f64>> = truth
        .iter()
        .enumerate()
        .map(|(k, p)| Translation3::new(if k >= 250 { 0.05 } else { 0.0 }, 0.0, 0.0) * p)
        .collect();
    let found = apart(&truth, &step);
    let [first, last] = found.within.worst_scans;
    assert!(first <= 250 && last >= 250 && last - first < 40, "{found:?}");
    assert!(found.within.median_m < 1e-9 && (found.within.worst_m - 0.05).abs() < 1e-6, "{found:?}");
}

#[test]
fn half_a_run_is_not_the_same_as_a_whole_one() {
    let truth = laps();
    let scans = both(&truth, &truth);
    assert!(Apart::of(&scans, 40, &ruler()).unwrap().is_same(Basis::CrossValidated, 0.04));
    assert!(!Apart::of(&scans, 60, &ruler()).unwrap().is_same(Basis::CrossValidated, 0.04));
    assert!(Apart::of(&scans[..1], 0, &ruler()).is_none());
}

#[test]
fn a_camera_that_looks_elsewhere_saw_no_other_visit() {
    let truth = laps();
    let back: Vec<Isometry3<f64>> = truth
        .iter()
        .enumerate()
        .map(|(k, pose)| pose * Isometry3::rotation(Vector3::z() * if k < 190 { 0.0 } else { 3.0 }))
        .collect();
    let scans = both(&back[..380], &back[..380]);
    let camera = Ruler { is_camera: true, ..ruler() };
    assert!(Apart::of(&scans, 0, &camera).unwrap().between.is_none());
    assert!(Apart::of(&scans, 0, &ruler()).unwrap().between.is_some());
}

#[test]
fn no_pose_is_too_far_away_to_be_looked_at() {
    let mut far = laps();
    for (k, pose) in far.iter_mut().enumerate().skip(100) {
        pose.translation.vector *= [1e18, -1e30, 1e300][k % 3];
    }
    // Numbers of a file may be any: what comes of these has no meaning, and does not stop the program.
    let _ = Apart::of(&both(&laps(), &far), 0, &ruler());
    let _ = Apart::of(&both(&far, &far), 0, &ruler());
}

/// The same by looking at every pair.
fn share_back_slowly(poses: &[Isometry3<f64>]) -> f64 {
    let places: Vec<_> = poses.iter().map(|pose| Some(pose.translation.vector)).collect();
    let along_m = along_m(&places, 1.0);
    let mut keys: Vec<usize> = Vec::new();
    for k in 0..poses.len() {
        if keys.last().is_none_or(|&last| along_m[k] - along_m[last] >= 0.5) {
            keys.push(k);
        }
    }
    let near =
        |a: usize, b: usize| (poses[a].translation.vector - poses[b].translation.vector).norm() <= 20.0;
    let is_back =
        |&&k: &&usize| keys.iter().any(|&j| j < k && along_m[k] - along_m[j] >= RULER && near(j, k));
    keys.iter().filter(is_back).count() as f64 / keys.len() as f64
}

#[test]
fn a_run_comes_back_where_its_own_path_does() {
    let laps = laps();
    let straight: Vec<_> = (0..300).map(|k| Isometry3::translation(f64::from(k), 0.0, 0.0)).collect();
    // The second lap lies 12 m, or 30 m, above the first.
    let raised = |m: f64| -> Vec<Isometry3<f64>> {
        let lift = |(k, pose): (usize, &Isometry3<f64>)| {
            Translation3::new(0.0, 0.0, m * (k as f64 / 200.0).floor()) * pose
        };
        laps.iter().enumerate().map(lift).collect()
    };
    let share = |poses: &[Isometry3<f64>]| share_back(poses.iter().copied(), &ruler());
    for poses in [&laps, &straight, &noisy(&laps, 0.3, 5), &raised(12.0), &raised(30.0)] {
        assert_eq!(share(poses), share_back_slowly(poses));
    }
    assert!((0.6..0.68).contains(&share(&laps)), "{}", share(&laps));
    assert!(share(&raised(12.0)) > 0.55 && share(&raised(30.0)) < 0.1, "{}", share(&raised(30.0)));
    assert_eq!((share(&straight), share(&[])), (0.0, 0.0));
}
