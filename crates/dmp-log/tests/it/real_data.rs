//! Recordings that lie beside the project: found through `DMP_DATA`, skipped without it.

use crate::cloud::read;
use crate::common::{assert_says, open, read_all};
use dmp_log::{CloudFormat, LogFormat, TrajectoryFormat, read_pose_graph, read_trajectory};
use std::path::PathBuf;

fn data(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("DMP_DATA") else {
        println!("skipped: DMP_DATA does not say where the recordings are");
        return None;
    };
    // Tests run in their package's folder; a relative path was meant from the workspace's.
    let workspace = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    Some(workspace.join(folder).join(name))
}

#[test]
fn rs32_has_times_of_points() {
    let Some(path) = data("rs32_static") else { return };
    let log = open(&path);
    let scans = read_all(&*log);
    assert_eq!((scans.len(), log.summary().format), (14, LogFormat::BinFolder));
    assert_says(log.summary().point_times.as_deref().unwrap(), &["seconds after the scan's stamp"]);
    for scan in &scans {
        assert_eq!(scan.time_offsets_ns.len(), scan.len());
        let last = *scan.time_offsets_ns.iter().max().unwrap();
        assert!((90_000_000..=101_000_000).contains(&last), "{last}");
        assert!(scan.time_offsets_ns.iter().all(|&offset| offset >= 0));
    }
    let run = read_trajectory(&path.join("poses_icp_odom.txt")).unwrap();
    assert_eq!((run.trajectory.len(), run.format), (14, TrajectoryFormat::Tum));
    assert_eq!(run.trajectory.stamps_ns().unwrap()[0], 1_690_309_709_285_305_500);
}

#[test]
fn las_maps_are_read_whole() {
    // The first is 1177.46 ft wide and says so; the second is in metres.
    for (name, points, extent_m) in [("autzen_trim.laz", 110_000, 358.89), ("lone-star.laz", 518_862, 32.445)]
    {
        let Some(path) = data("las_maps") else { return };
        let (summary, cloud) = read(&path.join(name)).unwrap();
        assert_eq!((summary.format, summary.points), (CloudFormat::Laz, points));
        let (low, high) = cloud
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[0]), high.max(p[0])));
        let extent = high - low;
        println!("{name}: {extent} along x; {:?}", summary.unit_note);
        assert!((extent - extent_m).abs() < 0.01, "{extent}");
        let in_feet =
            summary.unit_note.is_some_and(|note| note.starts_with("in feet, heights too by its GeoTIFF"));
        assert_eq!(in_feet, name == "autzen_trim.laz");
    }
}

/// Everyone writes the same poses: rows of matrices to seven digits before and after the optimisation,
/// vertices to six decimals.
#[test]
fn vertices_of_a_pose_graph_are_its_odometry() {
    let Some(folder) = data("pose_graphs") else { return };
    let graph = read_trajectory(&folder.join("scdlo_singlesession_posegraph.g2o")).unwrap();
    assert_eq!((graph.trajectory.len(), graph.format), (292, TrajectoryFormat::G2o));
    assert_eq!((graph.out_of_order, graph.repeated, graph.trajectory.stamps_ns()), (0, 0, None));
    assert_says(&graph.notes.join("; "), &["ids (0 to 291)"]);
    let farthest_m = |name: &str| {
        let rows = read_trajectory(&folder.join(name)).unwrap().trajectory;
        let apart = graph.trajectory.poses().iter().zip(rows.poses());
        let apart = apart.map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        apart.fold(0.0, f64::max)
    };
    let (odometry_m, optimized_m) =
        (farthest_m("scdlo_odom_poses.txt"), farthest_m("scdlo_optimized_poses.txt"));
    println!("vertices lie {odometry_m} m from the odometry, {optimized_m} m from the optimised poses");
    assert!(odometry_m < 1e-3 && optimized_m > 0.1);
}

/// Written without information, with two loops a hundred times.
#[test]
fn a_pose_graph_is_read_with_its_loop() {
    let Some(folder) = data("pose_graphs") else { return };
    let file = read_pose_graph(&folder.join("scdlo_singlesession_posegraph.g2o")).unwrap();
    assert_eq!((file.graph.ids().len(), file.graph.edges().len()), (292, 392));
    assert!(!file.has_information && file.other_records.is_empty());
    assert_eq!(file.graph.check_connected(&[]), Ok(()));
    let loops = file.graph.edges().iter().filter(|edge| edge.to != edge.from + 1);
    let ends: Vec<(i64, i64)> = loops.map(|edge| (edge.from, edge.to)).collect();
    assert_eq!(ends, [vec![(0, 290); 4], vec![(1, 291); 97]].concat());
    // Poses are written to six decimals, and so are the steps between them.
    let poses = file.graph.poses();
    for edge in file.graph.edges().iter().filter(|edge| edge.to == edge.from + 1) {
        let step = poses[edge.from as usize].inv_mul(&poses[edge.to as usize]);
        let off = edge.from_from_to.inv_mul(&step);
        assert!(off.translation.vector.norm() < 1e-3 && off.rotation.angle() < 1e-5, "{off}");
    }
    let error = read_pose_graph(&folder.join("parking-garage.g2o.gz")).unwrap_err().to_string();
    assert_says(&error, &["parking-garage.g2o.gz: ", "gzip"]);
}
