//! A drive of SC-DLO with a loop, which lies beside the project: found through `DMP_DATA`, skipped without it.

use dmp_log::{read_pose_graph, read_trajectory};
use dmp_loops::{Kernel, OptimiseOptions, optimise};
use dmp_sensor::{Isometry3, Matrix6, PoseEdge, PoseGraph};
use std::path::PathBuf;

fn data() -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("DMP_DATA") else {
        println!("skipped: DMP_DATA does not say where the recordings are");
        return None;
    };
    // Tests run in their package's folder; a relative path was meant from the workspace's.
    let workspace = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    Some(workspace.join(folder).join("pose_graphs"))
}

/// Its graph has no information. The tools of this family take standard deviations of 1 mrad and 1 cm for a step, and
/// 0.7 for a loop with Cauchy's kernel: with these the poses are those that GTSAM found there.
#[test]
fn a_drive_is_optimised_as_by_the_tool_that_recorded_it() {
    let Some(folder) = data() else { return };
    let poses = |name: &str| read_trajectory(&folder.join(name)).unwrap().trajectory.poses().to_vec();
    let (odometry, wanted) = (poses("scdlo_odom_poses.txt"), poses("scdlo_optimized_poses.txt"));
    let graph = read_pose_graph(&folder.join("scdlo_singlesession_posegraph.g2o")).unwrap().graph;
    let sure = |metres: f64, radians: f64| {
        let (place, turn) = (1.0 / (metres * metres), 4.0 / (radians * radians));
        Matrix6::from_diagonal(&[place, place, place, turn, turn, turn].into())
    };
    let edges = graph.edges().iter().map(|edge| {
        let a_loop = edge.to != edge.from + 1;
        let information = if a_loop { sure(0.5_f64.sqrt(), 0.5_f64.sqrt()) } else { sure(0.01, 0.001) };
        PoseEdge { information, ..edge.clone() }
    });
    let vertices = graph.ids().iter().copied().zip(odometry.iter().copied()).collect();
    let graph = PoseGraph::new(vertices, edges.collect(), [0].into()).unwrap();
    let options = OptimiseOptions { loop_kernel: Some(Kernel::Cauchy(1.0)), ..OptimiseOptions::default() };
    let found = optimise(&graph, &[], &options).unwrap();
    let apart_m = |poses: &[Isometry3<f64>]| -> Vec<f64> {
        let apart = poses.iter().zip(&wanted).map(|(a, b)| a.translation.vector - b.translation.vector);
        apart.map(|apart| apart.norm()).collect()
    };
    let mean_and_most = |apart: &[f64]| {
        (apart.iter().sum::<f64>() / apart.len() as f64, apart.iter().copied().fold(0.0, f64::max))
    };
    let (before, after) =
        (mean_and_most(&apart_m(&odometry)), mean_and_most(&apart_m(&found.world_from_body)));
    println!("mean and most: {before:?} m before, {after:?} m after, {} iterations", found.iterations);
    assert!(found.converged && found.iterations < 10);
    assert!(before.0 > 0.9 && before.1 > 2.3);
    assert!(after.0 < 1e-3 && after.1 < 6e-3);
}
