//! One flat cell: how thick it is, over all visits, within one, and by the sensor alone.

use super::cell_sums::CellSums;
use crate::grid::{Lattice, UNITS_PER_M};
use crate::surfels::smallest_eigenvector;
use crate::voxels::Moments;

/// Points that a cell needs, that a visit needs to count as one, and that a voxel needs for a plane of its own.
const CELL_POINTS: u64 = 20;
const VISIT_POINTS: u64 = 8;
const VOXEL_POINTS: u64 = 6;
/// Degrees of freedom that single scans need.
const SCAN_FREEDOM: u64 = 10;
/// The points must reach this far along the plane in both directions, RMS, in voxel edges.
const LEAST_SPREAD: f64 = 0.2;
/// A flat cell is at most this thick, in proportion to how far the points reach along it (RMS).
const MOST_THICK: f64 = 0.5;
/// A surface that is bent or has an edge is thicker in the cell than in its voxels: this much more variance, and this
/// many voxel edges, are allowed.
const MOST_BENT: f64 = 2.0;
const BENT_ANYWAY: f64 = 0.02;
/// Two layers are apart by more than this many times the thickness of one (then two equal bells have two peaks), by more
/// than this many standard errors, and by more than this many voxel edges.
const LAYERS: f64 = 2.0;
const LAYERS_ERRORS: f64 = 5.0;
const LAYERS_EDGES: f64 = 0.04;

/// How thick a flat cell is: RMS distances from its plane, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlatCell {
    /// Of all points.
    pub(crate) thick_m: f64,
    /// Of the points of each visit from the mean of their visit.
    pub(crate) within_m: f64,
    /// Of the points of single scans, if these have several in a voxel.
    pub(crate) sensor_m: Option<f64>,
    /// Points on a square metre of the plane.
    pub(crate) points_per_m2: f64,
    /// Between the outermost layers of different visits, if there are two visits; 0 for a single layer.
    pub(crate) layers_m: Option<f64>,
}

impl FlatCell {
    /// Of a cell whose points lie on one plane in every visit.
    pub(crate) fn of(sums: &CellSums, lattice: &Lattice, reach: i32) -> Option<Self> {
        let visits = visits_of(sums, reach);
        let mut all = Moments::default();
        visits.iter().for_each(|visit| all.merge_shifted(visit, [0; 3]));
        let seen: Vec<&Moments> = visits.iter().filter(|visit| visit.count >= VISIT_POINTS).collect();
        let points: u64 = seen.iter().map(|visit| visit.count).sum();
        if points < CELL_POINTS {
            return None;
        }
        // About the mean of each visit: what lies between the visits does not tilt the plane.
        let within = sum(seen.iter().map(|visit| scatter(visit)));
        let freedom = (points - seen.len() as u64) as f64;
        let (normal, [_, second, third]) = smallest_eigenvector(within.map(|s| s / freedom));
        let within_units2 = along(&within, normal) / (freedom - 2.0);
        let edge = f64::from(lattice.voxel_units());
        let is_broad = second.sqrt() >= LEAST_SPREAD * edge;
        let is_thin = within_units2 <= MOST_THICK * MOST_THICK * second;
        let bent = MOST_BENT * in_voxels(sums)? + BENT_ANYWAY * edge * BENT_ANYWAY * edge;
        if !is_broad || !is_thin || within_units2 > bent {
            return None;
        }
        let metres = |units2: f64| units2.max(0.0).sqrt() / UNITS_PER_M;
        let apart = |a: &Moments, b: &Moments| {
            let apart = (dot(a.mean_units(), normal) - dot(b.mean_units(), normal)).abs();
            let error = (within_units2 * (1.0 / a.count as f64 + 1.0 / b.count as f64)).sqrt();
            let least = (LAYERS * within_units2.sqrt()).max(LAYERS_ERRORS * error).max(LAYERS_EDGES * edge);
            if apart > least { apart } else { 0.0 }
        };
        let of_pairs = seen.iter().enumerate().flat_map(|(k, a)| seen[..k].iter().map(move |b| apart(a, b)));
        let layers = of_pairs.fold(0.0, f64::max);
        // Of a rectangle that the points fill.
        let area_m2 = 12.0 * metres(second) * metres(third);
        let scans = sums.of_scans.map(|s| s as f64);
        let sensor = || metres(along(&scans, normal) / sums.of_scans_freedom as f64);
        Some(Self {
            thick_m: metres(along(&scatter(&all), normal) / (all.count as f64 - 3.0)),
            within_m: metres(within_units2),
            sensor_m: (sums.of_scans_freedom >= SCAN_FREEDOM).then(sensor),
            points_per_m2: all.count as f64 / area_m2,
            layers_m: (seen.len() > 1).then_some(layers / UNITS_PER_M),
        })
    }
}

impl CellSums {
    /// Whether its points are enough for a plane.
    pub(super) fn is_dense(&self) -> bool {
        self.groups.iter().map(|(_, group)| group.count).sum::<u64>() >= CELL_POINTS
    }
}

/// The normal of all points of a cell, if they are enough.
pub(super) fn normal_of(sums: &CellSums) -> Option<[f64; 3]> {
    let mut all = Moments::default();
    sums.groups.iter().for_each(|(_, group)| all.merge_shifted(group, [0; 3]));
    (all.count >= CELL_POINTS).then(|| smallest_eigenvector(all.covariance_units2()).0)
}

/// The sums of each visit.
fn visits_of(sums: &CellSums, reach: i32) -> Vec<Moments> {
    let mut visits: Vec<Moments> = Vec::new();
    let mut last = None;
    for &(group, moments) in &sums.groups {
        let first = i64::from(group) << sums.level;
        match visits.last_mut().filter(|_| last.is_some_and(|last| first - last <= i64::from(reach))) {
            Some(visit) => visit.merge_shifted(&moments, [0; 3]),
            None => visits.push(moments),
        }
        last = Some(first + (1 << sums.level) - 1);
    }
    visits
}

/// Variance across the planes of the cell's voxels, each with a plane of its own, squared units.
fn in_voxels(sums: &CellSums) -> Option<f64> {
    let voxels = sums.voxels.iter().map(|(_, voxel)| voxel).filter(|voxel| voxel.count >= VOXEL_POINTS);
    let (mut across, mut freedom) = (0.0, 0.0);
    for voxel in voxels {
        let scatter = scatter(voxel);
        across += along(&scatter, smallest_eigenvector(scatter).0);
        freedom += voxel.count as f64 - 3.0;
    }
    (freedom > 0.0).then(|| across / freedom)
}

/// Σ (p − p̄)(p − p̄)ᵀ, squared units.
fn scatter(moments: &Moments) -> [f64; 6] {
    moments.covariance_units2().map(|c| c * moments.count as f64)
}

fn sum(matrices: impl Iterator<Item = [f64; 6]>) -> [f64; 6] {
    matrices.fold([0.0; 6], |a, b| std::array::from_fn(|k| a[k] + b[k]))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// nᵀ S n.
fn along([xx, xy, xz, yy, yz, zz]: &[f64; 6], n: [f64; 3]) -> f64 {
    let [x, y, z] = n;
    xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z)
}
