//! What cannot be optimised, and what was not.

use crate::common::{Random, circle, edge, graph, optimised, step};
use dmp_loops::{Kernel, OptimiseError, OptimiseOptions, optimise};
use dmp_sensor::{Component, EdgeFault, Isometry3, PoseEdge, PoseGraph};

fn error(graph: &PoseGraph, extra: &[PoseEdge]) -> OptimiseError {
    optimise(graph, extra, &OptimiseOptions::default()).unwrap_err()
}

#[test]
fn parts_that_no_edge_connects_are_named() {
    let poses: Vec<Isometry3<f64>> = (0..6).map(|k| step(f64::from(k), 0.0, 0.0)).collect();
    let forward = step(1.0, 0.0, 0.0);
    let edges = vec![edge(0, 1, forward), edge(1, 2, forward), edge(3, 4, forward)];
    // Also where each part has a vertex that is held.
    for fixed in [&[][..], &[0, 3, 5]] {
        let apart = graph(&poses, edges.clone(), fixed);
        let OptimiseError::Disconnected(found) = error(&apart, &[]) else { panic!("they are connected") };
        let component = |vertices, first| Component { vertices, first };
        assert_eq!(found.components, [component(3, 0), component(2, 3), component(1, 5)]);
    }
    let apart = graph(&poses, edges, &[]);
    let text = error(&apart, &[edge(4, 5, forward)]).to_string();
    assert!(text.contains("2 parts") && text.contains("3 vertices with 0, 3 vertices with 3"), "{text}");
    // An added edge may connect them.
    let found = optimised(&apart, &[edge(4, 5, forward), edge(0, 5, step(5.3, 0.0, 0.0))]);
    assert!((found.world_from_body[5].translation.x - 5.3).abs() < 1e-9);
}

#[test]
fn an_added_edge_that_cannot_be_is_named() {
    let circle = circle(10, 5.0, &PoseGraph::unit_information());
    let good = edge(9, 0, step(3.0, 0.0, 0.5));
    let fault = |edge: PoseEdge| match error(&circle, &[good.clone(), edge]) {
        OptimiseError::Edge { index: 1, fault, .. } => fault,
        other => panic!("{other}"),
    };
    assert_eq!(fault(edge(9, 10, step(1.0, 0.0, 0.0))), EdgeFault::UnknownVertex { id: 10 });
    assert_eq!(fault(edge(3, 3, step(1.0, 0.0, 0.0))), EdgeFault::SameVertex { id: 3 });
    let information = -PoseGraph::unit_information();
    let EdgeFault::NotPositiveDefinite { .. } = fault(PoseEdge { information, ..good.clone() }) else {
        panic!()
    };
}

#[test]
fn numbers_that_are_too_large_or_no_numbers_fail() {
    let circle = circle(10, 5.0, &PoseGraph::unit_information());
    let far = edge(9, 0, step(1e200, 0.0, 0.0));
    let OptimiseError::NotFinite { chi2 } = error(&circle, &[far]) else { panic!("1e400 is no f64") };
    assert_eq!(chi2, f64::INFINITY);
    // What fits exactly has no cost, but its lever of 100 m makes 1e311 of this information.
    let poses = [step(0.0, 0.0, 0.0), step(100.0, 0.0, 0.0)];
    let information = PoseGraph::unit_information() * 1e307;
    let strong = PoseEdge { information, ..edge(1, 0, step(-100.0, 0.0, 0.0)) };
    let lever = edge(0, 1, step(100.0, 0.0, 0.0));
    assert_eq!(error(&graph(&poses, vec![lever, strong], &[0]), &[]), OptimiseError::Undetermined);
    let default = OptimiseOptions::default();
    let option = |options: OptimiseOptions| optimise(&circle, &[], &options).unwrap_err().to_string();
    let text = option(OptimiseOptions { tolerance: 0.0, ..default.clone() });
    assert!(text.contains("a tolerance of 0:"), "{text}");
    let text = option(OptimiseOptions { loop_kernel: Some(Kernel::Cauchy(f64::NAN)), ..default });
    assert!(text.contains("a kernel's scale of NaN:"), "{text}");
}

#[test]
fn too_few_iterations_are_reported() {
    let circle = circle(60, 20.0, &(PoseGraph::unit_information() * 100.0));
    let wrong = [edge(50, 3, step(5.0, 5.0, 2.0))];
    let whole = optimised(&circle, &wrong);
    assert!(whole.iterations > 3);
    let mut chi2 = f64::INFINITY;
    for most_iterations in 0..whole.iterations {
        let options = OptimiseOptions { most_iterations, ..OptimiseOptions::default() };
        let found = optimise(&circle, &wrong, &options).unwrap();
        assert!(!found.converged && found.iterations == most_iterations);
        // The best so far, and the more the better.
        assert!(found.chi2_after <= chi2 && found.chi2_after >= whole.chi2_after * (1.0 - 1e-12));
        chi2 = found.chi2_after;
        if most_iterations == 0 {
            assert_eq!((&found.world_from_body[..], found.chi2_after), (circle.poses(), found.chi2_before));
        }
    }
}

/// Poses and steps from one to the next with loops, off by so many metres and radians, started off by half of that.
fn noisy(random: &mut Random, metres: f64, radians: f64) -> PoseGraph {
    let count = 2 + random.below(30);
    let poses: Vec<Isometry3<f64>> = (0..count).map(|_| random.pose(20.0, 2.0)).collect();
    let mut ends: Vec<(usize, usize)> = (1..count).map(|k| (k - 1, k)).collect();
    ends.extend((0..count).map(|_| (random.below(count), random.below(count))).filter(|(a, b)| a != b));
    let measured = |(a, b): (usize, usize)| {
        let information = random.information(1.0);
        let from_from_to = poses[a].inv_mul(&poses[b]) * random.pose(metres, radians);
        PoseEdge { information, ..edge(a as i64, b as i64, from_from_to) }
    };
    let edges = ends.into_iter().map(measured).collect();
    let start: Vec<Isometry3<f64>> =
        poses.iter().map(|pose| pose * random.pose(metres / 2.0, radians / 2.0)).collect();
    graph(&start, edges, &[])
}

/// Whatever the measurements, there is an answer, and it is no worse than the start; where they are not wholly at
/// odds, it is a minimum.
#[test]
fn noisy_graphs_get_an_answer() {
    let mut random = Random(8);
    for (metres, radians, least) in [(0.5, 0.2, 200), (2.0, 0.5, 195), (1e3, 10.0, 0)] {
        let mut converged = 0;
        for _ in 0..200 {
            let graph = noisy(&mut random, metres, radians);
            let found = optimise(&graph, &[], &OptimiseOptions::default()).unwrap();
            let numbers =
                |pose: &Isometry3<f64>| [pose.translation.vector.amax(), pose.rotation.coords.norm()];
            assert!(found.world_from_body.iter().flat_map(numbers).all(f64::is_finite));
            assert!(found.chi2_after <= found.chi2_before * (1.0 + 1e-9));
            converged += usize::from(found.converged);
        }
        println!("off by {metres} m and {radians} rad: {converged} of 200 converged");
        assert!(converged >= least);
    }
}
