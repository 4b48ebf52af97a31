//! The whole pipeline against the formulas written down once more: `f64`, sorted maps, every ray tested
//! with every disc. Nothing here calls the crates that fuse, cast or reduce.

use std::collections::BTreeMap;

use dmp::{Config, Ego};
use dmp_sensor::{Scan, Track, Trajectory};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::common::{drift, noise, runs_of, score, small_town, write_mcap};

const VOXEL_M: f64 = 1.0;

struct Disc {
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    segments: Vec<i64>,
}

struct Ray {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    z: f64,
    segment: i64,
}

/// Every return of the log as a ray of one run.
fn rays(scans: &[Scan], run: &Trajectory, segment_of: &[i64]) -> Vec<Ray> {
    let track = Track::new(run, dmp_sensor::Isometry3::identity(), i64::MAX);
    let mut rays = Vec::new();
    for (scan, &segment) in scans.iter().zip(segment_of) {
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let point = Point3::from(point.map(f64::from));
            let z = point.coords.norm();
            if let Some(pose) = track.world_from_sensor_at(scan.stamp_ns.unwrap() + offset_ns)
                && (1.5..=100.0).contains(&z)
            {
                let end = (pose * point).coords;
                let origin = pose.translation.vector;
                rays.push(Ray { origin, direction: (end - origin) / z, z, segment });
            }
        }
    }
    rays
}

/// The surfel map of the definition, from sorted lists.
fn surfels(rays: &[Ray]) -> Vec<Disc> {
    let on_lattice = |c: f64| (c * 8192.0).round() as i64;
    let edge = (VOXEL_M * 8192.0) as i64;
    let mut voxels: BTreeMap<[i64; 3], Vec<([i64; 3], i64)>> = BTreeMap::new();
    let mut cells: BTreeMap<[i64; 3], Vec<Vector3<f64>>> = BTreeMap::new();
    for ray in rays {
        let end = ray.origin + ray.direction * ray.z;
        let p = [on_lattice(end.x), on_lattice(end.y), on_lattice(end.z)];
        voxels.entry(p.map(|c| c.div_euclid(edge))).or_default().push((p, ray.segment));
        cells
            .entry(p.map(|c| c.div_euclid(2 * edge)))
            .or_default()
            .push(Vector3::from(p.map(|c| c as f64 / 8192.0)));
    }
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut discs = Vec::new();
    for (voxel, members) in &voxels {
        let cell = &cells[&voxel.map(|v| v.div_euclid(2))];
        if members.len() >= 3 && cell.len() >= 5 {
            let middle = mean(cell);
            let spread: Matrix3<f64> = cell.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
            let eigen = spread.symmetric_eigen();
            let mut order = [0, 1, 2];
            order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
            // A line has no plane: the rule that leaves out what spreads in one direction only.
            if eigen.eigenvalues[order[1]] / cell.len() as f64 * 8192.0 * 8192.0 > 1.0 {
                let points: Vec<_> =
                    members.iter().map(|m| Vector3::from(m.0.map(|c| c as f64 / 8192.0))).collect();
                let normal = eigen.eigenvectors.column(order[0]).into_owned();
                discs.push(Disc {
                    centre: mean(&points),
                    normal,
                    segments: members.iter().map(|m| m.1).collect(),
                });
            }
        }
    }
    discs
}

/// The scores, directly: Σ (z − z1)², R_cv at 10 m over all returns, R_near at 0.5 m, coverage.
fn scores(rays: &[Ray], discs: &[Disc]) -> [f64; 4] {
    let radius = 0.8 * VOXEL_M;
    let (mut dmp, mut cv, mut near, mut covered, mut hits) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for ray in rays {
        let (mut z1, mut zc, mut gap) = (f64::INFINITY, f64::INFINITY, 5.0f64);
        for disc in discs {
            let cos = disc.normal.dot(&ray.direction);
            let t = disc.normal.dot(&(disc.centre - ray.origin)) / cos;
            let off = ray.origin + ray.direction * t - disc.centre;
            if cos.abs() >= 0.01 && off.norm() <= radius && (0.0..=200.0).contains(&t) {
                z1 = z1.min(t);
                gap = gap.min((t - ray.z).abs());
                let before = disc.segments.iter().filter(|&&s| s < ray.segment - 1).count();
                let after = disc.segments.iter().filter(|&&s| s > ray.segment + 1).count();
                if before >= 3 || after >= 3 {
                    zc = zc.min(t);
                }
            }
        }
        if z1.is_finite() {
            hits += 1.0;
            dmp += (ray.z - z1).powi(2);
            near += gap.powi(2).min(0.25);
        }
        covered += f64::from(zc.is_finite());
        cv += if zc.is_finite() { (ray.z - zc).powi(2).min(100.0) } else { 25.0 };
    }
    [dmp, cv / rays.len() as f64, near / hits, covered / rays.len() as f64]
}

#[test]
fn the_pipeline_is_the_formulas() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(110, 60);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.3)), ("drift", drift(0.5))]);
    let config = Config { voxel_m: Some(VOXEL_M), ego: Ego::None, ..Config::default() };
    let report = score(&path, &runs, &config);
    assert_eq!(report.config.voxel_m, VOXEL_M);

    // The segments are cut once for all runs; take them as the report states them.
    let starts = &report.config.segments.starts_scan;
    let segment_of: Vec<i64> =
        (0..scans.len()).map(|k| starts.iter().filter(|&&start| start <= k).count() as i64 - 1).collect();
    for (run, reported) in runs.iter().zip(&report.runs) {
        let rays = rays(&scans, &run.trajectory, &segment_of);
        assert_eq!(rays.len() as u64, reported.returns);
        let discs = surfels(&rays);
        assert_eq!(discs.len() as u64, reported.map.surfels);
        let direct = scores(&rays, &discs);
        let found = [
            reported.dmp_sum_m2,
            reported.r_cv_m2.at_10.unwrap(),
            reported.r_near_m2.at_0_5.unwrap(),
            reported.coverage.unwrap(),
        ];
        for (name, (found, direct)) in
            ["DMP", "R_cv(10)", "R_near(0.5)", "coverage"].iter().zip(found.iter().zip(direct))
        {
            let relative = (found / direct - 1.0).abs();
            println!("{}: {name} {found} directly {direct}, relative {relative:.1e}", run.name);
            assert!(relative < 1e-6, "{}: {name} {found}, directly {direct}", run.name);
        }
        assert!(reported.coverage.unwrap() > 0.3, "the log must have revisits for this to mean anything");
    }
}
