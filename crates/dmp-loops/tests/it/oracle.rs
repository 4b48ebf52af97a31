//! Against a method that is as plain as it can be: dense matrices, differences for derivatives, damped steps.

use crate::common::{Random, apart, edge, graph, optimised};
use dmp_loops::{Kernel, OptimiseOptions, optimise};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph, Translation3, Vector3};
use nalgebra::{DMatrix, DVector, Matrix4, Rotation3, UnitQuaternion};

/// x, y, z and the vector part of the quaternion of M⁻¹ A⁻¹ B, with matrices.
fn residual(edge: &PoseEdge, a: &Matrix4<f64>, b: &Matrix4<f64>) -> [f64; 6] {
    let measured = edge.from_from_to.to_homogeneous();
    let off = measured.try_inverse().unwrap() * a.try_inverse().unwrap() * b;
    let rotation = Rotation3::from_matrix_unchecked(off.fixed_view::<3, 3>(0, 0).into_owned());
    let turn = UnitQuaternion::from_rotation_matrix(&rotation);
    let sign = if turn.w < 0.0 { -1.0 } else { 1.0 };
    [off[(0, 3)], off[(1, 3)], off[(2, 3)], sign * turn.i, sign * turn.j, sign * turn.k]
}

struct Dense<'a> {
    edges: Vec<&'a PoseEdge>,
    poses: Vec<Isometry3<f64>>,
    /// A kernel of all edges that are no steps from an id to the next.
    kernel: Option<Kernel>,
}

impl Dense<'_> {
    /// All poses but the first moved by rotation vectors and shifts.
    fn moved(&self, step: &DVector<f64>) -> Vec<Isometry3<f64>> {
        let mut poses = self.poses.clone();
        for (k, pose) in poses.iter_mut().skip(1).enumerate() {
            let part = |at: usize| Vector3::new(step[6 * k + at], step[6 * k + at + 1], step[6 * k + at + 2]);
            let turn = UnitQuaternion::from_scaled_axis(part(3));
            *pose = Isometry3::from_parts(
                Translation3::from(pose.translation.vector + part(0)),
                UnitQuaternion::new_normalize((turn * pose.rotation).into_inner()),
            );
        }
        poses
    }

    /// Residuals one below the other, as if their information was 1 and there was no kernel.
    fn whitened(&self, poses: &[Isometry3<f64>]) -> DVector<f64> {
        let matrices: Vec<Matrix4<f64>> = poses.iter().map(Isometry3::to_homogeneous).collect();
        let rows = self.edges.iter().flat_map(|edge| {
            let off = residual(edge, &matrices[edge.from as usize], &matrices[edge.to as usize]);
            let root = edge.information.cholesky().unwrap().l();
            let white = root.transpose() * nalgebra::Vector6::from(off);
            let square = white.norm_squared();
            let scale = match self.kernel.filter(|_| (edge.to - edge.from).abs() != 1) {
                Some(Kernel::Cauchy(scale)) => {
                    (scale * scale * (square / (scale * scale)).ln_1p() / square).sqrt()
                }
                Some(Kernel::Huber(scale)) if square > scale * scale => {
                    (scale * (2.0 * square.sqrt() - scale) / square).sqrt()
                }
                _ => 1.0,
            };
            (white * scale).iter().copied().collect::<Vec<f64>>()
        });
        DVector::from_iterator(6 * self.edges.len(), rows)
    }

    fn optimise(mut self) -> (Vec<Isometry3<f64>>, f64) {
        let unknowns = 6 * (self.poses.len() - 1);
        let mut damping = 1e-4;
        let mut residuals = self.whitened(&self.poses);
        for _ in 0..3000 {
            let slopes = DMatrix::from_columns(
                &(0..unknowns)
                    .map(|k| {
                        let mut step = DVector::zeros(unknowns);
                        step[k] = 1e-5;
                        let ahead = self.whitened(&self.moved(&step));
                        (ahead - self.whitened(&self.moved(&-step))) / 2e-5
                    })
                    .collect::<Vec<_>>(),
            );
            let mut normal = slopes.transpose() * &slopes;
            (0..unknowns).for_each(|k| normal[(k, k)] *= 1.0 + damping);
            let step = normal.cholesky().unwrap().solve(&(slopes.transpose() * -&residuals));
            if step.amax() < 1e-11 {
                break;
            }
            let there = self.moved(&step);
            let residuals_there = self.whitened(&there);
            if residuals_there.norm_squared() <= residuals.norm_squared() {
                (self.poses, residuals) = (there, residuals_there);
                damping *= 0.3;
            } else {
                damping *= 4.0;
            }
        }
        let cost = residuals.norm_squared();
        (self.poses, cost)
    }
}

fn dense(graph: &PoseGraph, extra: &[PoseEdge], kernel: Option<Kernel>) -> (Vec<Isometry3<f64>>, f64) {
    let edges = graph.edges().iter().chain(extra).collect();
    Dense { edges, poses: graph.poses().to_vec(), kernel }.optimise()
}

/// A walk with noisy measurements and some loops, started a little off.
fn random_graph(random: &mut Random, count: usize, noise: [f64; 2]) -> PoseGraph {
    let mut poses = vec![random.pose(20.0, 1.0)];
    for k in 1..count {
        let forward = random.pose(1.0, 0.8);
        poses.push(poses[k - 1] * Isometry3::translation(2.0, 0.0, 0.0) * forward);
    }
    let mut ends: Vec<(usize, usize)> = (1..count).map(|k| (k - 1, k)).collect();
    ends.extend((0..count / 2).map(|_| (random.below(count), random.below(count))).filter(|(a, b)| a != b));
    let edges = ends.into_iter().map(|(a, b)| {
        let from_from_to = poses[a].inv_mul(&poses[b]) * random.pose(noise[0], noise[1]);
        let information = random.information(1.0);
        PoseEdge { information, ..edge(a as i64, b as i64, from_from_to) }
    });
    let edges = edges.collect();
    let start: Vec<Isometry3<f64>> = poses.iter().map(|pose| pose * random.pose(0.2, 0.1)).collect();
    graph(&start, edges, &[])
}

fn assert_same(found: &dmp_loops::Optimised, cost: f64, wanted: &(Vec<Isometry3<f64>>, f64), what: &str) {
    // A graph without loops fits exactly.
    assert!((cost - wanted.1).abs() <= 1e-9 * wanted.1.max(1e-6), "{what}: chi2 {cost}, not {}", wanted.1);
    let (metres, radians) = apart(&found.world_from_body, &wanted.0);
    assert!(metres < 1e-6 && radians < 1e-6, "{what}: {metres} m, {radians} rad");
}

/// A loop wrong by metres bends the graph: its residuals stay large, and their second derivatives count.
#[test]
fn the_optimum_with_a_wrong_loop_is_that_of_the_plain_method() {
    let mut random = Random(2);
    for round in 0..8 {
        let count = 5 + random.below(4);
        let graph = random_graph(&mut random, count, [0.02, 0.01]);
        let (from, to) = (&graph.poses()[0], &graph.poses()[count - 1]);
        let wrong = PoseEdge {
            information: random.information(3.0),
            ..edge(0, count as i64 - 1, from.inv_mul(to) * random.pose(3.0, 0.5))
        };
        let extra = [wrong];
        let found = optimised(&graph, &extra);
        assert!(found.chi2_after > 0.03 && found.extra_chi2[0] < found.chi2_after, "{}", found.chi2_after);
        assert_same(&found, found.chi2_after, &dense(&graph, &extra, None), &format!("round {round}"));
    }
}

#[test]
fn the_optimum_is_that_of_the_plain_method_with_a_kernel_and_without() {
    let mut random = Random(3);
    let kernels = [None, Some(Kernel::Huber(0.3)), Some(Kernel::Cauchy(1.0))];
    for (round, loop_kernel) in kernels.into_iter().cycle().take(15).enumerate() {
        let count = 4 + random.below(5);
        let graph = random_graph(&mut random, count, [0.3, 0.1]);
        let options = OptimiseOptions { loop_kernel, ..OptimiseOptions::default() };
        let found = optimise(&graph, &[], &options).unwrap();
        assert!(found.converged);
        let wanted = dense(&graph, &[], loop_kernel);
        let edges = graph.edges().iter().collect();
        let cost = Dense { edges, poses: vec![], kernel: loop_kernel }.whitened(&found.world_from_body);
        assert_same(&found, cost.norm_squared(), &wanted, &format!("round {round} {loop_kernel:?}"));
    }
}
