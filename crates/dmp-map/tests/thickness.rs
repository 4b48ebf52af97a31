//! How thick a map is: against a slow, obvious fit of planes, against walls of known noise, and with second layers at
//! known distances.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::collections::BTreeMap;

use dmp_map::{
    Durability, FuseBuffers, Lattice, Layers, MapFuser, Origin, SampledCells, Thickness, UNITS_PER_M,
};
use nalgebra::{Matrix3, Vector3};

type Point = [f64; 3];

/// Numbers from 0 to 1, the same each time.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A standard normal number, nearly: the sum of twelve uniform ones.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Scans of a tilted square of 40 m with noise across it, and the segment of each. The second of two visits sees it
/// `apart_m` higher.
fn square(noise_m: f64, apart_m: f64) -> Vec<(i32, Vec<Point>)> {
    let mut random = Random(7);
    let (a, b, n) = ([0.96, 0.0, 0.28], [-0.168, 0.8, 0.576], [-0.224, -0.6, 0.768]);
    let mut scan = |visit: i32| {
        let mut point = || {
            let [along_a, along_b] = [random.uniform(), random.uniform()].map(|u| 40.0 * u);
            let across = noise_m * random.normal() + apart_m * f64::from(visit);
            std::array::from_fn(|k| 5.3 + along_a * a[k] + along_b * b[k] + across * n[k])
        };
        (20 * visit, (0..3000).map(|_| point()).collect())
    };
    (0..120).map(|number| scan(number / 60)).collect()
}

fn lattice() -> Lattice {
    Lattice::new(0.5).unwrap()
}

fn sampled(scans: &[(i32, Vec<Point>)], order: impl Iterator<Item = usize>) -> SampledCells {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(lattice(), 64 << 20, folder.path()).unwrap();
    let mut buffers = FuseBuffers::default();
    for k in order {
        let (segment, points) = &scans[k];
        fuser.add(points, Some(*segment), &mut buffers).unwrap();
    }
    let origin = Origin::of("a square");
    fuser.finish(&folder.path().join("m"), &origin, Durability::Temporary, &|_, _| ()).unwrap().cells
}

fn measured(scans: &[(i32, Vec<Point>)]) -> Thickness {
    sampled(scans, 0..scans.len()).thickness(&lattice(), 5).unwrap()
}

/// As a cloud: no point has a segment.
fn layers_of_cloud(scans: &[(i32, Vec<Point>)]) -> Layers {
    let cloud: Vec<_> = scans.iter().map(|(_, points)| (0, points.clone())).collect();
    let mut search = sampled(&cloud, 0..cloud.len()).search_layers(&lattice());
    cloud.iter().for_each(|(_, points)| search.add(points).unwrap());
    search.found()
}

#[track_caller]
fn near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} is not {expected}");
}

#[test]
fn noise_across_a_surface_is_its_thickness() {
    for noise_m in [0.01, 0.02, 0.04] {
        let found = measured(&square(noise_m, 0.0));
        near(found.median_m, noise_m, 0.03);
        near(found.within_median_m, noise_m, 0.03);
        near(found.sensor_median_m.unwrap(), noise_m, 0.08);
        near(found.points_per_m2, 225.0, 0.05);
        assert!(found.layers.cells > 500 && found.layers.doubled == 0, "{:?}", found.layers);
    }
}

#[test]
fn the_order_of_points_changes_nothing() {
    let scans = square(0.02, 0.1);
    let forwards = sampled(&scans, 0..scans.len());
    assert_eq!(forwards, sampled(&scans, (0..scans.len()).rev()));
    assert_eq!(forwards, sampled(&scans, (0..scans.len()).map(|k| k * 7 % scans.len())));
}

/// Fits planes to the points of all cells, not of a sample, by the textbook.
#[test]
fn it_is_that_of_planes_fitted_one_by_one() {
    let scans = square(0.02, 0.0);
    let edge = f64::from((0.5 * UNITS_PER_M) as u32) / UNITS_PER_M * 2.0;
    let mut cells: BTreeMap<[i64; 3], Vec<Vector3<f64>>> = BTreeMap::new();
    for point in scans.iter().flat_map(|(_, points)| points) {
        cells.entry(point.map(|c| (c / edge).floor() as i64)).or_default().push(Vector3::from(*point));
    }
    let mut thick: Vec<f64> = Vec::new();
    for points in cells.values().filter(|points| points.len() >= 100) {
        let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let scatter: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
        thick.push((scatter.symmetric_eigenvalues().min() / (points.len() as f64 - 3.0)).sqrt());
    }
    thick.sort_by(f64::total_cmp);
    near(measured(&scans).median_m, thick[thick.len() / 2], 0.02);
}

#[test]
fn a_second_layer_is_found_with_its_distance() {
    for (noise_m, apart_m) in
        [0.01, 0.02, 0.04].into_iter().flat_map(|n| [0.05, 0.1, 0.2, 0.4].map(|d| (n, d)))
    {
        let scans = square(noise_m, apart_m);
        let found = measured(&scans);
        let Layers { cells, doubled, median_m, ref places } = found.layers;
        let expected = if apart_m > 2.2 * noise_m { 0.95..=1.0 } else { 0.0..=0.05 };
        assert!(
            cells > 450 && expected.contains(&share(&found.layers)),
            "{noise_m} {apart_m}: {doubled} of {cells}"
        );
        near(found.within_median_m, noise_m, 0.05);
        if apart_m > 2.2 * noise_m {
            near(median_m.unwrap(), apart_m, 0.1);
            assert_eq!(places.len(), 5);
        }
        if apart_m <= 0.1 {
            near(found.median_m, noise_m.hypot(apart_m / 2.0), 0.05);
        }
        // Without visits, layers that melt into one are one.
        let of_cloud = layers_of_cloud(&scans);
        let expected = if apart_m > 4.5 * noise_m { 0.85..=1.0 } else { 0.0..=0.01 };
        assert!(
            of_cloud.cells > 150 && expected.contains(&share(&of_cloud)),
            "{noise_m} {apart_m} {of_cloud:?}"
        );
    }
    assert_eq!(layers_of_cloud(&square(0.02, 0.0)).doubled, 0);
}

fn share(layers: &Layers) -> f64 {
    layers.doubled as f64 / layers.cells as f64
}
