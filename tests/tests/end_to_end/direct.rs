//! The whole pipeline against the formulas written down once more: `f64`, sorted maps, every ray tested
//! with every disc. Nothing here calls the crates that fuse, cast or reduce.

use std::collections::{BTreeMap, BTreeSet};

use dmp::{Config, Ego, Run};
use dmp_sensor::{Isometry3, Quaternion, Scan, Track, Trajectory, Translation3, UnitQuaternion};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::common::{drift, plain, runs_of, score, small_town, write_mcap};

pub(crate) const VOXEL_M: f64 = 1.0;

pub(crate) struct Disc {
    voxel: [i64; 3],
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    segments: Vec<i64>,
}

#[derive(Clone, Copy)]
pub(crate) struct Ray {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    z: f64,
    segment: i64,
}

impl Ray {
    /// The end of the ray in whole units of the lattice.
    fn end_units(&self) -> [i64; 3] {
        let end = self.origin + self.direction * self.z;
        [end.x, end.y, end.z].map(|c| (c * 8192.0).round() as i64)
    }

    /// The voxel it ends in.
    pub(crate) fn voxel(&self) -> [i64; 3] {
        self.end_units().map(|c| c.div_euclid((VOXEL_M * 8192.0) as i64))
    }

    /// Where the ray crosses a disc, if it does.
    fn crossing(&self, disc: &Disc) -> Option<f64> {
        let cos = disc.normal.dot(&self.direction);
        let t = disc.normal.dot(&(disc.centre - self.origin)) / cos;
        let off = self.origin + self.direction * t - disc.centre;
        (cos.abs() >= 0.01 && off.norm() <= 0.8 * VOXEL_M && (0.0..=200.0).contains(&t)).then_some(t)
    }

    /// Whether it crosses a disc at `t` above the tile of 32 m that the disc's centre is in.
    fn is_in_tile_of(&self, disc: &Disc, t: f64) -> bool {
        let at = self.origin + self.direction * t;
        (0..2).all(|k| (at[k] / 32.0).floor() == (disc.centre[k] / 32.0).floor())
    }

    /// How far the ray ends behind the disc's plane when it crosses it at `t`, metres.
    fn depth(&self, disc: &Disc, t: f64) -> f64 {
        (self.z - t) * disc.normal.dot(&self.direction).abs()
    }

    /// Whether the disc was seen often enough more than `reach` segments from the ray's own.
    pub(crate) fn is_independent_of(&self, disc: &Disc, reach: i64) -> bool {
        disc.segments.iter().filter(|&&s| s < self.segment - reach).count() >= 3
            || disc.segments.iter().filter(|&&s| s > self.segment + reach).count() >= 3
    }
}

/// Of the surfels of a run those that its rays do not contradict, and the voxels of the others: the definition in `docs/metric.md`, "What moves".
pub(crate) fn without_what_moved(
    (report, run, scans): (&dmp::Report, &Run, &[Scan]),
    discs: Vec<Disc>,
) -> (Vec<Disc>, BTreeSet<[i64; 3]>) {
    let (in_world, segment_of) = (in_world(report, run), segments_of(report, run, scans.len()));
    let count = 50.max(scans.len() / 8).min(scans.len());
    let of_followed = |k: usize| rays(&scans[k..=k], &in_world, &segment_of[k..=k]);
    let followed: Vec<Ray> = (0..count).flat_map(|k| of_followed(k * scans.len() / count)).collect();
    assert!(followed.len() < 500_000, "of more returns some are drawn");
    let along = along(scans, &in_world);
    let segments = segment_of.last().unwrap() + 1;
    let begin_m = |segment| along[segment_of.partition_point(|&of_scan| of_scan < segment)].0;
    let begins_m: Vec<f64> = (0..segments).map(begin_m).collect();
    let is_of_pass = |ray: &Ray, disc: &Disc| {
        let mut seen = disc.segments.clone();
        seen.sort_unstable();
        let (third, third_last) = (seen[2], seen[seen.len() - 3]);
        let here_m = begins_m[ray.segment as usize];
        (third.min(third_last)..=third.max(third_last))
            .any(|segment| (begins_m[segment as usize] - here_m).abs() <= 66.0)
    };
    let is_contradicted = |disc: &Disc| {
        let (mut through, mut on) = (0, 0);
        for ray in followed.iter().filter(|ray| is_of_pass(ray, disc)) {
            match ray.crossing(disc).filter(|&t| ray.is_in_tile_of(disc, t)) {
                Some(t) if (t - ray.z).abs() <= 0.5 => on += 1,
                Some(t) if ray.depth(disc, t) > 0.5 => through += 1,
                _ => {}
            }
        }
        through >= 2 && through > on / 2
    };
    let mut tiles: BTreeMap<[i64; 2], (usize, usize)> = BTreeMap::new();
    let tile_of = |disc: &Disc| [0, 1].map(|k| (disc.centre[k] / 32.0).floor() as i64);
    let judged = |disc: Disc| {
        let out = is_contradicted(&disc);
        (disc, out)
    };
    let judged: Vec<(Disc, bool)> = discs.into_iter().map(judged).collect();
    for (disc, out) in &judged {
        let of_tile = tiles.entry(tile_of(disc)).or_default();
        *of_tile = (of_tile.0 + usize::from(*out), of_tile.1 + 1);
    }
    // A tile that would lose more than a third keeps all.
    let is_left_out = |disc: &Disc, out: bool| {
        let (out_of_tile, all) = tiles[&tile_of(disc)];
        out && 3 * out_of_tile <= all
    };
    let (out, kept): (Vec<_>, Vec<_>) = judged.into_iter().partition(|(disc, out)| is_left_out(disc, *out));
    (kept.into_iter().map(|(disc, _)| disc).collect(), out.into_iter().map(|(disc, _)| disc.voxel).collect())
}

/// How far along the path each scan is, measured with a ruler of 6 m, and where.
fn along(scans: &[Scan], in_world: &Trajectory) -> Vec<(f64, Vector3<f64>)> {
    let track = Track::new(in_world, dmp_sensor::Isometry3::identity(), i64::MAX);
    let place = |scan: &Scan| track.world_from_sensor_at(scan.stamp_ns.unwrap()).unwrap().translation.vector;
    let (mut end, mut begun_m, mut along_m) = (place(&scans[0]), 0.0, 0.0f64);
    let step = |scan: &Scan| {
        let apart_m = (place(scan) - end).norm();
        along_m = along_m.max(begun_m + apart_m);
        if apart_m >= 6.0 {
            (end, begun_m) = (place(scan), along_m);
        }
        (along_m, place(scan))
    };
    let all: Vec<_> = scans.iter().map(step).collect();
    assert!(along_m >= 96.0, "a shorter path has a shorter ruler");
    all
}

/// The segments whose places the run comes by again: within 15 m between their middles, five segments on, after four times as
/// much travel.
pub(crate) fn revisits(scans: &[Scan], in_world: &Trajectory, segment_of: &[i64]) -> BTreeSet<i64> {
    let along = along(scans, in_world);
    let middle = |segment: i64| {
        let scans: Vec<_> = along.iter().zip(segment_of).filter(|(_, of)| **of == segment).collect();
        let half_m = 0.5 * (scans[0].0.0 + scans[scans.len() - 1].0.0);
        *scans.iter().find(|((along_m, _), _)| *along_m >= half_m).unwrap().0
    };
    let middles: Vec<_> = (0..=*segment_of.last().unwrap()).map(middle).collect();
    let is_again = |(a, b): (usize, usize)| {
        let apart_m = (middles[a].1 - middles[b].1).norm();
        a.abs_diff(b) >= 5 && apart_m <= 15.0 && 4.0 * apart_m <= (middles[a].0 - middles[b].0).abs()
    };
    (0..middles.len()).filter(|&a| (0..middles.len()).any(|b| is_again((a, b)))).map(|a| a as i64).collect()
}

/// The segment of each scan in a run, as the report states it.
pub(crate) fn segments_of(report: &dmp::Report, run: &Run, scans: usize) -> Vec<i64> {
    let of_report = report.inputs.runs.iter().find(|input| input.name == run.name).unwrap();
    let starts = &of_report.segments.starts_scan;
    (0..scans).map(|k| starts.iter().filter(|&&start| start <= k).count() as i64 - 1).collect()
}

/// A run in the frame that the report says it was scored in.
pub(crate) fn in_world(report: &dmp::Report, run: &Run) -> Trajectory {
    let of_report = report.inputs.runs.iter().find(|input| input.name == run.name).unwrap();
    let [x, y, z, i, j, k, w] = of_report.world_from_own;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    run.trajectory.moved(&Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

/// Every return of the log as a ray of one run.
pub(crate) fn rays(scans: &[Scan], run: &Trajectory, segment_of: &[i64]) -> Vec<Ray> {
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
pub(crate) fn surfels(rays: &[Ray]) -> Vec<Disc> {
    let edge = (VOXEL_M * 8192.0) as i64;
    let mut voxels: BTreeMap<[i64; 3], Vec<([i64; 3], i64)>> = BTreeMap::new();
    let mut cells: BTreeMap<[i64; 3], Vec<Vector3<f64>>> = BTreeMap::new();
    for ray in rays {
        let p = ray.end_units();
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
                let corner = Vector3::from(voxel.map(|v| (v * edge) as f64 / 8192.0));
                let (centre, normal) = rounded(corner, mean(&points), normal);
                let voxel = *voxel;
                discs.push(Disc { voxel, centre, normal, segments: members.iter().map(|m| m.1).collect() });
            }
        }
    }
    discs
}

/// A disc as it is kept: `docs/store-format.md`, "How a surfel is rounded".
fn rounded(corner: Vector3<f64>, mean: Vector3<f64>, normal: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let axis = normal.iamax();
    // Its slopes against the axis it is most along, to 2⁻¹⁸.
    let slopes = (normal / normal[axis]).map(|slope| (slope * 262_144.0).round() / 262_144.0);
    // Lattice units from the voxel's corner.
    let mean = (mean - corner) * 8192.0;
    let height_over = |place: Vector3<f64>| {
        let across: f64 = (0..3).filter(|&k| k != axis).map(|k| slopes[k] * (mean[k] - place[k])).sum();
        ((mean[axis] + across) * 32.0).round() / 32.0
    };
    // Voxels of a metre have no more steps than units.
    let mut place = mean.map(f64::round);
    let last = VOXEL_M * 8192.0 - 1.0;
    let height = height_over(place);
    for k in (0..3).filter(|&k| k != axis && !(0.0..=last).contains(&height)) {
        // Uphill where the plane is too low, downhill where it is too high.
        let lower_place = (slopes[k] > 0.0) == (height < 0.0);
        place[k] = if lower_place { mean[k].floor() } else { mean[k].ceil() };
    }
    place[axis] = height_over(place);
    (corner + place / 8192.0, slopes.normalize())
}

/// The scores, directly, by name.
pub(crate) fn scores(rays: &[Ray], discs: &[Disc], revisits: &BTreeSet<i64>) -> BTreeMap<&'static str, f64> {
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    let mut add = |name, value| *sums.entry(name).or_default() += value;
    for ray in rays {
        let (mut z1, mut zc, mut gap, mut revisited) = (f64::INFINITY, f64::INFINITY, 5.0f64, false);
        for disc in discs {
            if let Some(t) = ray.crossing(disc) {
                z1 = z1.min(t);
                gap = gap.min((t - ray.z).abs());
                if ray.is_independent_of(disc, 1) {
                    zc = zc.min(t);
                }
                revisited |= t <= ray.z + 0.5 && ray.is_independent_of(disc, 5);
            }
        }
        let cut = |residual: f64, tau: f64| residual.powi(2).min(tau * tau);
        if z1.is_finite() {
            add("hits", 1.0);
            add("DMP", (ray.z - z1).powi(2));
            for (name, tau) in [("near 5", 5.0), ("near 2", 2.0), ("near 0.5", 0.5)] {
                add(name, cut(gap, tau));
            }
        }
        if zc.is_finite() {
            add("covered", 1.0);
            for (name, tau) in [("cv 2", 2.0), ("cv 0.5", 0.5), ("cv 0.2", 0.2)] {
                add(name, cut(ray.z - zc, tau));
            }
        }
        add("cv 10", if zc.is_finite() { cut(ray.z - zc, 10.0) } else { 15.0 });
        add("revisited", f64::from(revisited && revisits.contains(&ray.segment)));
        add("blocked", f64::from(z1 < ray.z - 0.5));
    }
    sums
}

#[test]
fn the_pipeline_is_the_formulas() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(80, 40);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(0.5))]);
    let config = Config { voxel_m: Some(VOXEL_M), ego: Ego::None, ..plain() };
    let report = score(&path, &runs, &config);
    assert_eq!(report.config.voxel_m, VOXEL_M);

    for (run, reported) in runs.iter().zip(&report.runs) {
        let (segment_of, in_world) = (segments_of(&report, run, scans.len()), in_world(&report, run));
        let mut rays = rays(&scans, &in_world, &segment_of);
        assert_eq!(rays.len() as u64, reported.returns + reported.returns_left_out);
        let discs = surfels(&rays);
        assert_eq!(discs.len() as u64, reported.map.surfels);
        let all = discs.len() as u64;
        let (discs, left_out) = without_what_moved((&report, run, &scans), discs);
        rays.retain(|ray| !left_out.contains(&ray.voxel()));
        assert_eq!(rays.len() as u64, reported.returns);
        assert!(reported.returns_left_out > 0);
        assert_eq!(reported.map.surfels_contradicted, Some(all - discs.len() as u64));
        let revisits = revisits(&scans, &in_world, &segment_of);
        assert!(!revisits.is_empty() && segment_of.iter().any(|segment| !revisits.contains(segment)));
        let sums = scores(&rays, &discs, &revisits);
        let returns = rays.len() as f64;
        let (hits, covered) = (sums["hits"], sums["covered"]);
        let (cv, near) = (&reported.r_cv_m2, &reported.r_near_m2);
        let all = [
            ("DMP", Some(reported.dmp_sum_m2), sums["DMP"]),
            ("mean", reported.dmp_mean_m2, sums["DMP"] / hits),
            ("R_cv 10", cv[0], sums["cv 10"] / returns),
            ("R_cv 2", cv[1], sums["cv 2"] / covered),
            ("R_cv 0.5", cv[2], sums["cv 0.5"] / covered),
            ("R_cv 0.2", cv[3], sums["cv 0.2"] / covered),
            ("R_near 5", near[0], sums["near 5"] / hits),
            ("R_near 2", near[1], sums["near 2"] / hits),
            ("R_near 0.5", near[2], sums["near 0.5"] / hits),
            ("miss", reported.miss_rate, 1.0 - hits / returns),
            ("blocked", reported.blocked_rate, sums["blocked"] / returns),
            ("coverage", reported.coverage, covered / returns),
            ("revisit", reported.coverage_revisit, sums["revisited"] / returns),
        ];
        for (name, found, direct) in all {
            let relative = (found.unwrap() / direct - 1.0).abs();
            assert!(relative < 1e-6, "{}: {name} {found:?}, directly {direct}", run.name);
        }
        assert!(reported.coverage.unwrap() > 0.3, "the log must have revisits for this to mean anything");
    }
}
