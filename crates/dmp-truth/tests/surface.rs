//! The surface distance against all pairs, known surfaces, and itself under other settings.

use dmp_sensor::{Isometry3, Translation3, UnitQuaternion};
use dmp_truth::surface::{
    Distances, EvaluatedPoints, SurfaceError, SurfaceReport, SurfaceSettings, Triangle,
};

type Point = [f64; 3];

/// A linear congruential generator: any scatter will do.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self, low: Point, size: Point) -> Point {
        std::array::from_fn(|k| low[k] + size[k] * self.next())
    }
}

fn settings() -> SurfaceSettings {
    SurfaceSettings { work_folder: std::env::temp_dir(), threads: 2, ..SurfaceSettings::default() }
}

fn measure(
    settings: &SurfaceSettings,
    map: &[Point],
    points: &[Point],
    triangles: &[Triangle],
) -> Result<SurfaceReport, SurfaceError> {
    let mut evaluated = EvaluatedPoints::new(settings, Isometry3::identity())?;
    map.chunks(777).try_for_each(|batch| evaluated.add(batch))?;
    let mut reference = evaluated.against_reference()?;
    points.chunks(555).try_for_each(|batch| reference.add_points(batch))?;
    triangles.chunks(99).try_for_each(|batch| reference.add_triangles(batch))?;
    reference.measure(&())
}

/// Closest point of a triangle by its Voronoi regions (Ericson, Real-Time Collision Detection, 5.1.5):
/// another way than the one under test.
fn closest(p: Point, [a, b, c]: &Triangle) -> Point {
    let sub = |a: &Point, b: &Point| -> Point { std::array::from_fn(|k| a[k] - b[k]) };
    let dot = |a: &Point, b: &Point| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let go = |from: &Point, along: &Point, share: f64| -> Point {
        std::array::from_fn(|k| from[k] + share * along[k])
    };
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(&p, a));
    // On a line, where c is between a and b: the segment, without the rounding.
    if c != b && dot(&ab, &ab) * dot(&ac, &ac) - dot(&ab, &ac).powi(2) < 1e-9 * dot(&ab, &ab).powi(2) {
        return closest(p, &[*a, *b, *b]);
    }
    let (d1, d2) = (dot(&ab, &ap), dot(&ac, &ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = sub(&p, b);
    let (d3, d4) = (dot(&ab, &bp), dot(&ac, &bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return go(a, &ab, d1 / (d1 - d3));
    }
    let cp = sub(&p, c);
    let (d5, d6) = (dot(&ab, &cp), dot(&ac, &cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return go(a, &ac, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return go(b, &sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    go(&go(a, &ab, vb / sum), &ac, vc / sum)
}

fn distance(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// All pairs.
fn brute_force(from: &[Point], points: &[Point], triangles: &[Triangle]) -> Vec<f64> {
    let nearest = |&p: &Point| {
        let to_points = points.iter().map(|&q| distance(p, q));
        let to_triangles = triangles.iter().map(|t| distance(p, closest(p, t)));
        to_points.chain(to_triangles).fold(f64::INFINITY, f64::min)
    };
    from.iter().map(nearest).collect()
}

/// The report's distances must be those of a plain list, capped.
fn assert_agrees(report: &Distances, distances_m: &[f64], settings: &SurfaceSettings) {
    // Half a unit of rounding, and as much for the two ways to the same distance; 16 units at a cap of 5 m.
    let width = 2.2e-6 * settings.cap_m.max(1.0);
    let near = |a: f64, b: f64, what: &str| assert!((a - b).abs() < width, "{what}: {a} and {b}");
    let mut capped: Vec<f64> = distances_m.iter().map(|d| d.min(settings.cap_m)).collect();
    capped.sort_by(f64::total_cmp);
    let n = capped.len() as f64;
    let mean = capped.iter().sum::<f64>() / n;
    let quantile = |share: f64| capped[((share * n).ceil() as usize).max(1) - 1];
    assert_eq!(report.count, capped.len() as u64);
    assert_eq!(report.beyond_cap, distances_m.iter().filter(|&&d| d > settings.cap_m).count() as u64);
    near(report.mean_m, mean, "mean");
    near(report.rmse_m, (capped.iter().map(|d| d * d).sum::<f64>() / n).sqrt(), "rmse");
    near(report.std_m, (capped.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt(), "std");
    near(report.median_m, quantile(0.5), "median");
    near(report.p90_m, quantile(0.9), "p90");
    near(report.p95_m, quantile(0.95), "p95");
    near(report.max_m, capped[capped.len() - 1], "max");
    for (index, &t) in settings.thresholds_m.iter().enumerate() {
        let within: Vec<f64> = distances_m.iter().copied().filter(|&d| d <= t).collect();
        assert_eq!(report.within[index], within.len() as u64, "within {t}");
        let squares: f64 = within.iter().map(|d| d * d).sum();
        match report.within_rmse_m[index] {
            Some(rmse) => near(rmse, (squares / within.len() as f64).sqrt(), "inliers"),
            None => assert!(within.is_empty()),
        }
    }
}

/// Triangles of all sizes, some over many tiles, some without area.
fn random_mesh(random: &mut Random, low: Point) -> Vec<Triangle> {
    let triangle = |k: usize| {
        let corner = random.point(low, [60.0, 60.0, 6.0]);
        let size = [0.3, 3.0, 40.0][k % 3];
        let mut near = || -> Point {
            let step = random.point([-size, -size, -0.1 * size], [2.0 * size, 2.0 * size, 0.2 * size]);
            std::array::from_fn(|axis| corner[axis] + step[axis])
        };
        let (b, c) = (near(), near());
        match k % 10 {
            0 => [corner, b, std::array::from_fn(|axis| 0.5 * (corner[axis] + b[axis]))],
            1 => [corner; 3],
            _ => [corner, b, c],
        }
    };
    (0..150).map(triangle).collect()
}

#[test]
fn meshes_and_clouds_agree_with_all_pairs() {
    let mut random = Random(5);
    for low in [[-30.0, -30.0, -3.0], [458_000.25, 5_421_000.5, 100.0]] {
        for (cap_m, tile_edge_m) in [(1.0, 8.0), (0.3, 32.0), (5.0, 10.0)] {
            let thresholds_m = vec![0.05, 0.1, 0.3];
            let settings = SurfaceSettings { cap_m, tile_edge_m, thresholds_m, spacing_m: 0.8, ..settings() };
            let mesh = random_mesh(&mut random, low);
            let cloud: Vec<Point> = (0..3000).map(|_| random.point(low, [60.0, 60.0, 6.0])).collect();
            let map: Vec<Point> = (0..3000).map(|_| random.point(low, [60.0, 60.0, 6.0])).collect();

            let report = measure(&settings, &map, &[], &mesh).unwrap();
            assert_agrees(&report.accuracy, &brute_force(&map, &[], &mesh), &settings);
            assert_eq!(report.completeness.unwrap().count, report.reference.samples);

            let report = measure(&settings, &map, &cloud, &[]).unwrap();
            assert_agrees(&report.accuracy, &brute_force(&map, &cloud, &[]), &settings);
            let back = report.completeness.as_ref().unwrap();
            assert_agrees(back, &brute_force(&cloud, &map, &[]), &settings);
            assert_eq!(report.chamfer_m, Some(0.5 * (report.accuracy.mean_m + back.mean_m)));
            for (index, at) in report.thresholds.iter().enumerate() {
                let (precision, recall) = (report.accuracy.share_within(index), back.share_within(index));
                assert_eq!((at.precision, at.recall), (precision, Some(recall)));
                let f = 2.0 * precision * recall / (precision + recall);
                assert_eq!(at.f_score, Some(if precision + recall > 0.0 { f } else { 0.0 }));
            }

            let report = measure(&settings, &map, &cloud, &mesh).unwrap();
            assert_agrees(&report.accuracy, &brute_force(&map, &cloud, &mesh), &settings);
        }
    }
}

#[test]
fn threads_memory_and_tiles_change_no_bit() {
    let mut random = Random(11);
    let low = [458_000.25, 5_421_000.5, 100.0];
    let mesh = random_mesh(&mut random, low);
    let map: Vec<Point> = (0..15_000).map(|_| random.point(low, [50.0, 50.0, 6.0])).collect();
    let cloud: Vec<Point> = (0..8000).map(|_| random.point(low, [60.0, 50.0, 6.0])).collect();
    for thin_m in [None, Some(0.7)] {
        let base = SurfaceSettings { thin_m, cap_m: 0.8, crop: true, ..settings() };
        let expected = measure(&base, &map, &cloud, &mesh).unwrap();
        assert_eq!(expected.scratch_bytes, 0);
        match thin_m {
            Some(_) => assert!(expected.accuracy.count < 13_000),
            None => assert_eq!(expected.accuracy.count, 15_000),
        }
        for (threads, memory_bytes, tile_edge_m) in
            [(1, 2 << 30, 32.0), (3, 2 << 30, 7.0), (2, 4 << 20, 32.0), (4, 5 << 20, 100.0), (1, 0, 9.5)]
        {
            let other = SurfaceSettings { threads, memory_bytes, tile_edge_m, ..base.clone() };
            let mut report = measure(&other, &map, &cloud, &mesh).unwrap();
            assert!(memory_bytes > 1 << 30 || report.scratch_bytes > 50_000);
            report.scratch_bytes = 0;
            assert_eq!(report, expected, "{threads} threads, {memory_bytes} bytes, {tile_edge_m} m");
        }
        let backwards: Vec<Point> = map.iter().rev().copied().collect();
        assert_eq!(measure(&base, &backwards, &cloud, &mesh).unwrap(), expected);
    }
}

fn plane(z: f64) -> Vec<Triangle> {
    let corner = |x: f64, y: f64| [x, y, z];
    vec![
        [corner(-60.0, -60.0), corner(60.0, -60.0), corner(60.0, 60.0)],
        [corner(-60.0, -60.0), corner(60.0, 60.0), corner(-60.0, 60.0)],
    ]
}

#[test]
fn a_plane_displaced_by_seven_centimetres_is_that_far() {
    let map: Vec<Point> =
        (0..10_000).map(|k| [f64::from(k % 100) - 50.0, f64::from(k / 100) - 50.0, 0.07]).collect();
    let report = measure(&settings(), &map, &[], &plane(0.0)).unwrap();
    let accuracy = &report.accuracy;
    for value in [accuracy.mean_m, accuracy.median_m, accuracy.rmse_m, accuracy.p95_m, accuracy.max_m] {
        assert!((value - 0.07).abs() < 1e-6, "{value}");
    }
    assert!(accuracy.std_m < 1e-9 && accuracy.beyond_cap == 0);
    let precision: Vec<f64> = report.thresholds.iter().map(|at| at.precision).collect();
    assert_eq!(precision, [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(report.reference.area_m2, 120.0 * 120.0);
    assert_eq!(report.reference.samples, 1_440_000);
    // Within 50 cm of a net of 1 m lies a disc around each of its points.
    let recall = report.thresholds[3].recall.unwrap();
    let disc = std::f64::consts::PI * (0.25 - 0.07 * 0.07) * 10_000.0 / 14_400.0;
    assert!((recall - disc).abs() < 2e-3, "{recall} {disc}");
}

#[test]
fn points_are_moved_before_they_are_measured() {
    let turn = UnitQuaternion::from_euler_angles(0.2, 0.1, 1.0);
    let moved = Isometry3::from_parts(Translation3::new(500_000.0, -20.0, 7.0), turn);
    let back = moved.inverse();
    let mut evaluated = EvaluatedPoints::new(&settings(), moved).unwrap();
    for k in 0..100 {
        let there = dmp_sensor::Point3::new(f64::from(k) / 2.0 - 20.0, 3.0, 0.03);
        evaluated.add(&[(back * there).coords.into()]).unwrap();
    }
    let mut reference = evaluated.against_reference().unwrap();
    reference.add_triangles(&plane(0.0)).unwrap();
    assert!((reference.measure(&()).unwrap().accuracy.max_m - 0.03).abs() < 1e-6);
}

#[test]
fn thinning_counts_every_voxel_once() {
    // A thousand points in one place and one in another: density must not weigh.
    let mut map = vec![[0.01, 0.01, 0.05]; 1000];
    map.push([10.01, 10.01, 0.25]);
    let thinned = SurfaceSettings { thin_m: Some(0.5), ..settings() };
    let report = measure(&thinned, &map, &[], &plane(0.0)).unwrap();
    assert_eq!((report.accuracy.count, report.evaluated.points), (2, 1001));
    assert!((report.accuracy.mean_m - 0.15).abs() < 1e-6);
    let report = measure(&settings(), &map, &[], &plane(0.0)).unwrap();
    assert_eq!(report.accuracy.count, 1001);
}

#[test]
fn a_crop_leaves_the_unseen_out() {
    let map: Vec<Point> = (0..400).map(|k| [f64::from(k % 20), f64::from(k / 20), 0.0]).collect();
    let cloud: Vec<Point> = (0..4000).map(|k| [f64::from(k % 20), f64::from(k / 20), 0.0]).collect();
    let whole = measure(&settings(), &map, &cloud, &[]).unwrap();
    assert_eq!(whole.thresholds[0].recall, Some(0.1));
    let cropped = measure(&SurfaceSettings { crop: true, ..settings() }, &map, &cloud, &[]).unwrap();
    // One row more is within the cap of the map's box, and 1 m away.
    assert_eq!(cropped.completeness.as_ref().unwrap().count, 420);
    assert_eq!(cropped.thresholds[0].recall, Some(400.0 / 420.0));
    assert_eq!(whole.accuracy, cropped.accuracy);
}

#[test]
fn what_cannot_be_measured_is_said() {
    let nowhere = [f64::NAN, 0.0, 0.0];
    let error =
        |map: &[Point], points: &[Point]| measure(&settings(), map, points, &[]).unwrap_err().to_string();
    assert!(error(&[], &[[0.0; 3]]).contains("no points"));
    assert!(error(&[nowhere, [1e9, 0.0, 0.0]], &[[0.0; 3]]).contains("(2 are not finite"));
    assert!(error(&[[0.0; 3]], &[nowhere]).contains("neither points nor triangles"));
    let apart = error(&[[0.0; 3]], &[[1e6, 0.0, 0.0]]);
    assert!(apart.contains("same frame") && apart.contains("x 1000000.00 to"), "{apart}");

    let report = measure(&settings(), &[[0.0; 3], nowhere], &[[0.0; 3], nowhere, nowhere], &[]).unwrap();
    assert_eq!((report.evaluated.dropped, report.reference.dropped, report.accuracy.count), (1, 2, 1));

    let bad = [
        SurfaceSettings { cap_m: 0.0, ..settings() },
        SurfaceSettings { cap_m: f64::NAN, ..settings() },
        SurfaceSettings { thresholds_m: vec![0.2, 0.1], ..settings() },
        SurfaceSettings { thresholds_m: vec![2.0], ..settings() },
        SurfaceSettings { thin_m: Some(-1.0), ..settings() },
        SurfaceSettings { spacing_m: 0.0, ..settings() },
        SurfaceSettings { tile_edge_m: 0.0, ..settings() },
        SurfaceSettings { threads: 0, ..settings() },
    ];
    for settings in bad {
        let error = EvaluatedPoints::new(&settings, Isometry3::identity()).unwrap_err();
        assert!(error.is_usage(), "{error}");
    }
}
