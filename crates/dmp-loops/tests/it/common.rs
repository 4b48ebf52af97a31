//! Graphs that the tests share.

use dmp_loops::{OptimiseOptions, Optimised, optimise};
use dmp_sensor::{
    Isometry3, Matrix6, PoseEdge, PoseGraph, Quaternion, Translation3, UnitQuaternion, Vector3,
};
use std::collections::BTreeSet;

/// `SplitMix64`: the same numbers everywhere.
#[derive(Debug, Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// From −1 to 1.
    pub(crate) fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A random pose of up to these metres and, for small ones, radians.
    pub(crate) fn pose(&mut self, metres: f64, radians: f64) -> Isometry3<f64> {
        let [x, y, z] = std::array::from_fn(|_| metres * self.number());
        let [i, j, k] = std::array::from_fn(|_| radians * self.number() / 2.0);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(1.0, i, j, k));
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    }

    /// A symmetric positive definite matrix with numbers around this size.
    pub(crate) fn information(&mut self, size: f64) -> Matrix6<f64> {
        let root = Matrix6::from_fn(|_, _| self.number());
        let matrix = (root * root.transpose() + Matrix6::identity()) * size;
        (matrix + matrix.transpose()) / 2.0
    }
}

pub(crate) fn turned_z(angle_rad: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad)
}

pub(crate) fn step(x: f64, y: f64, angle_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, 0.0), turned_z(angle_rad))
}

pub(crate) fn edge(from: i64, to: i64, from_from_to: Isometry3<f64>) -> PoseEdge {
    PoseEdge { from, to, from_from_to, information: PoseGraph::unit_information() }
}

/// A graph of poses with the ids 0, 1, 2, …
pub(crate) fn graph(poses: &[Isometry3<f64>], edges: Vec<PoseEdge>, fixed: &[i64]) -> PoseGraph {
    let vertices = (0..).zip(poses.iter().copied()).collect();
    PoseGraph::new(vertices, edges, fixed.iter().copied().collect::<BTreeSet<i64>>()).unwrap()
}

/// A circle of `count` poses whose steps are measured exactly, with this information.
pub(crate) fn circle(count: usize, radius_m: f64, information: &Matrix6<f64>) -> PoseGraph {
    let turn = std::f64::consts::TAU / count as f64;
    let forward = step(radius_m * libm::sin(turn), radius_m * (1.0 - libm::cos(turn)), turn);
    let mut poses = vec![Isometry3::identity()];
    for k in 1..count {
        poses.push(poses[k - 1] * forward);
    }
    let edges = (1..count as i64).map(|k| PoseEdge { information: *information, ..edge(k - 1, k, forward) });
    graph(&poses, edges.collect(), &[])
}

pub(crate) fn optimised(graph: &PoseGraph, extra: &[PoseEdge]) -> Optimised {
    let found = optimise(graph, extra, &OptimiseOptions::default()).unwrap();
    assert!(found.converged, "after {} iterations, chi2 {}", found.iterations, found.chi2_after);
    assert!(found.chi2_after <= found.chi2_before * (1.0 + 1e-12) + 1e-18);
    found
}

/// The farthest that two lists of poses are apart, metres and radians.
pub(crate) fn apart(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold((0.0, 0.0), |(metres, radians), (a, b)| {
        let off = a.inv_mul(b);
        (off.translation.vector.norm().max(metres), off.rotation.angle().max(radians))
    })
}
