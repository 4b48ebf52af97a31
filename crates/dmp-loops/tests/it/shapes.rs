//! Graphs whose optimum is known.

use crate::common::{Random, apart, circle, edge, graph, optimised, step};
use dmp_loops::{Kernel, OptimiseOptions, optimise};
use dmp_sensor::{Isometry3, Matrix6, PoseEdge, PoseGraph, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Standard deviations of a metre and of 0.1 mrad: a graph that stretches and does not bend.
fn stiff() -> Matrix6<f64> {
    Matrix6::from_diagonal(&[1.0, 1.0, 1.0, 4e8, 4e8, 4e8].into())
}

/// A square of ten metres, of whose four sides the last is measured 0.8 m too long.
fn square() -> PoseGraph {
    let side = |length_m: f64| step(length_m, 0.0, FRAC_PI_2);
    let poses: Vec<Isometry3<f64>> =
        (0..4).map(|k| (0..k).fold(Isometry3::identity(), |pose, _| pose * side(10.0))).collect();
    let sides = [(0, 1, 10.0), (1, 2, 10.0), (2, 3, 10.0), (3, 0, 10.8)];
    let edges =
        sides.map(|(from, to, length_m)| PoseEdge { information: stiff(), ..edge(from, to, side(length_m)) });
    graph(&poses, edges.to_vec(), &[])
}

#[test]
fn a_wrong_side_of_a_square_is_shared_by_all() {
    let graph = square();
    let found = optimised(&graph, &[]);
    // Each side takes a quarter: four times (0.2 m)².
    assert!((found.chi2_before - 0.64).abs() < 1e-9, "{}", found.chi2_before);
    assert!((found.chi2_after - 0.16).abs() < 1e-6, "{}", found.chi2_after);
    let at: Vec<Vector3<f64>> = found.world_from_body.iter().map(|pose| pose.translation.vector).collect();
    let wanted = [[0.0, 0.0], [10.0, 0.2], [10.0, 10.4], [0.0, 10.6]];
    for (at, [x, y]) in at.iter().zip(wanted) {
        assert!((at - Vector3::new(x, y, 0.0)).norm() < 1e-3, "{at}");
    }
    assert_eq!(found.world_from_body[0], graph.poses()[0]);
}

#[test]
fn a_chain_without_loops_stays_as_it_is() {
    let mut random = Random(4);
    let mut poses = vec![random.pose(1e3, 1.0)];
    for k in 1..300 {
        poses.push(poses[k - 1] * Isometry3::translation(1.0, 0.0, 0.0) * random.pose(0.3, 0.3));
    }
    let edges: Vec<PoseEdge> = (1..300)
        .map(|k| {
            let information = random.information(1e3);
            PoseEdge { information, ..edge(k as i64 - 1, k as i64, poses[k - 1].inv_mul(&poses[k])) }
        })
        .collect();
    let there = optimised(&graph(&poses, edges.clone(), &[]), &[]);
    assert_eq!((there.iterations, &there.world_from_body), (1, &poses));
    // From other poses it comes back to these.
    let start: Vec<Isometry3<f64>> = poses
        .iter()
        .enumerate()
        .map(|(k, pose)| if k == 0 { *pose } else { pose * random.pose(1.0, 0.3) })
        .collect();
    let back = optimised(&graph(&start, edges, &[]), &[]);
    let (metres, radians) = apart(&back.world_from_body, &poses);
    assert!(
        metres < 1e-6 && radians < 1e-9 && back.chi2_after < 1e-12,
        "{metres} {radians} {}",
        back.chi2_after
    );
}

#[test]
fn what_is_optimised_stays_to_the_bit() {
    let circle = circle(60, 20.0, &stiff());
    let closing = [edge(59, 0, step(2.5, 0.5, 0.2))];
    let first = optimised(&circle, &closing);
    let again = optimised(&circle.with_poses(first.world_from_body.clone()).unwrap(), &closing);
    assert_eq!((again.iterations, &again.world_from_body), (1, &first.world_from_body));
    assert_eq!(again.chi2_before, again.chi2_after);
}

#[test]
fn the_first_vertex_is_held_where_none_is_fixed() {
    let square = square();
    let free = optimised(&square, &[]);
    let fixed = optimised(&graph(square.poses(), square.edges().to_vec(), &[0]), &[]);
    assert_eq!(free, fixed);
    // Another one held is the same square elsewhere; two held stay both.
    let last = optimised(&graph(square.poses(), square.edges().to_vec(), &[3]), &[]);
    assert_eq!(last.world_from_body[3], square.poses()[3]);
    let shift = free.world_from_body[3] * last.world_from_body[3].inverse();
    let moved: Vec<Isometry3<f64>> = last.world_from_body.iter().map(|pose| shift * pose).collect();
    let (metres, radians) = apart(&moved, &free.world_from_body);
    assert!(metres < 1e-6 && radians < 1e-8 && (last.chi2_after - free.chi2_after).abs() < 1e-9);
    let both = optimised(&graph(square.poses(), square.edges().to_vec(), &[0, 3]), &[]);
    assert_eq!([0, 3].map(|k| both.world_from_body[k]), [0, 3].map(|k| square.poses()[k]));
    assert!(both.chi2_after > free.chi2_after + 0.1);
}

#[test]
fn where_in_the_world_a_graph_is_does_not_matter() {
    let circle = circle(100, 30.0, &stiff());
    let closing = [edge(99, 0, step(2.5, 0.4, 0.1))];
    let here = optimised(&circle, &closing);
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 2.0);
    // UTM: an f64 resolves a nanometre there.
    let there_from_here = Isometry3::from_parts(Translation3::new(5e5, 5.4e6, 300.0), turn);
    let poses = circle.poses().iter().map(|pose| there_from_here * pose).collect();
    let there = optimised(&circle.with_poses(poses).unwrap(), &closing);
    assert!((there.chi2_after - here.chi2_after).abs() < 1e-9 * here.chi2_after);
    let back: Vec<Isometry3<f64>> =
        there.world_from_body.iter().map(|pose| there_from_here.inv_mul(pose)).collect();
    let (metres, radians) = apart(&back, &here.world_from_body);
    assert!(metres < 1e-6 && radians < 1e-8, "{metres} {radians}");
}

#[test]
fn information_weighs() {
    let circle = circle(50, 20.0, &stiff());
    let closing = |weight: f64| {
        let edge = edge(49, 0, step(4.0, 0.5, 0.1));
        [PoseEdge { information: stiff() * weight, ..edge }]
    };
    let residual = |weight: f64| optimised(&circle, &closing(weight)).extra_chi2[0] / weight;
    let squares = [1e-4, 1e-2, 1.0, 1e2, 1e4].map(residual);
    assert!(squares.is_sorted_by(|a, b| *a > 2.0 * *b), "{squares:?}");
    // Everything weighed alike changes chi2 and no pose.
    let scaled = |factor: f64| {
        let edges =
            circle.edges().iter().map(|edge| PoseEdge { information: stiff() * factor, ..edge.clone() });
        optimised(&graph(circle.poses(), edges.collect(), &[]), &closing(factor))
    };
    let (one, many) = (scaled(1.0), scaled(1e3));
    assert!((many.chi2_after - 1e3 * one.chi2_after).abs() < 1e-6 * many.chi2_after);
    let (metres, _) = apart(&one.world_from_body, &many.world_from_body);
    assert!(metres < 1e-6, "{metres}");
    // The same edge twice is one of twice the information.
    let twice = optimised(&circle, &[closing(1.0), closing(1.0)].concat());
    let double = optimised(&circle, &closing(2.0));
    let (metres, _) = apart(&twice.world_from_body, &double.world_from_body);
    assert!(metres < 1e-6 && (twice.extra_chi2.iter().sum::<f64>() - double.extra_chi2[0]).abs() < 1e-9);
}

#[test]
fn an_added_edge_is_one_of_the_graph() {
    let circle = circle(40, 10.0, &stiff());
    let closing = edge(39, 0, step(2.0, 0.2, 0.1));
    let added = optimised(&circle, std::slice::from_ref(&closing));
    let own = [circle.edges(), &[closing]].concat();
    let own = optimised(&graph(circle.poses(), own, &[]), &[]);
    assert!(own.extra_chi2.is_empty());
    assert_eq!(own.world_from_body, added.world_from_body);
    assert_eq!((own.chi2_before, own.chi2_after), (added.chi2_before, added.chi2_after));
}

/// A kernel is for what is in the graph: an added edge pulls with all its weight.
#[test]
fn a_kernel_lets_a_wrong_loop_of_the_graph_go() {
    let circle = circle(40, 10.0, &(stiff() * 1e4));
    let good = edge(39, 0, circle.poses()[39].inv_mul(&circle.poses()[0]));
    let wrong = edge(5, 30, Isometry3::translation(3.0, 3.0, 0.0));
    let options = OptimiseOptions { loop_kernel: Some(Kernel::Cauchy(0.1)), ..OptimiseOptions::default() };
    let off = |own: &[&PoseEdge], extra: &[PoseEdge], options: &OptimiseOptions| {
        let edges = circle.edges().iter().chain(own.iter().copied()).cloned().collect();
        let found = optimise(&graph(circle.poses(), edges, &[]), extra, options).unwrap();
        assert!(found.converged);
        apart(&found.world_from_body, circle.poses()).0
    };
    let without = off(&[&good, &wrong], &[], &OptimiseOptions::default());
    let with = off(&[&good, &wrong], &[], &options);
    let added = off(&[&good], std::slice::from_ref(&wrong), &options);
    assert!(
        without > 0.02 && with < 0.1 * without && (added - without).abs() < 0.1 * without,
        "{without} {with} {added}"
    );
}

/// Loops of a long drive, right and wrong by metres and radians: each has its minimum, within a few steps.
#[test]
fn wrong_loops_of_a_long_drive_converge() {
    let information = Matrix6::from_diagonal(&[1e4, 1e4, 1e4, 4e6, 4e6, 4e6].into());
    let drive = circle(700, 200.0, &information);
    let mut random = Random(6);
    for round in 0..30 {
        let (from, to) = (random.below(300), 400 + random.below(300));
        let off = [random.pose(0.1, 0.01), random.pose(3.0, 0.1), random.pose(30.0, 1.0)][round % 3];
        let from_from_to = drive.poses()[from].inv_mul(&drive.poses()[to]) * off;
        let wrong =
            PoseEdge { information: information * 1e-2, ..edge(from as i64, to as i64, from_from_to) };
        let found = optimised(&drive, &[wrong]);
        assert!(found.iterations < 30, "{round}: {}", found.iterations);
    }
}
