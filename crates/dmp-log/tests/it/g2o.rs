use crate::common::assert_says;
use dmp_log::{TrajectoryFormat, parse_g2o, parse_tum, read_raw_trajectory, read_trajectory};
use std::fs;

/// As written by several programs: parameters, other vertices, edges, priors, fixed vertices, trailing
/// blanks, large ids.
const GRAPH: &str = "# saved by a program\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n\
    VERTEX_SE3:QUAT 8646911284551352322 4 5 6 0 0 0.70710678 0.70710678 \n\
    FIX 8646911284551352320\n\
    VERTEX_SE3:QUAT 8646911284551352320 1 2 3 0 0 0 1\t\r\n\
    VERTEX_PLANE 7 0 0 1 0\nVERTEX_TRACKXYZ 8 1 2 3\n\
    ROBOTLASER1 0 -1.57 3.14 0.5\n\
    VERTEX_SE3:QUAT 8646911284551352320 1 2 3 0 0 0 1\n\
    EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n\
    EDGE_SE3_PRIORXYZ 0 1 2 3 1 0 0 1 0 1\n\n";

#[test]
fn vertices_are_in_the_order_of_their_ids() {
    let graph = parse_g2o(GRAPH.as_bytes()).unwrap();
    assert_eq!(graph.ids, [8_646_911_284_551_352_320, 8_646_911_284_551_352_322]);
    assert_eq!((graph.out_of_order, graph.repeated, graph.other_vertices), (1, 1, 2));
    let tum = parse_tum(b"0 1 2 3 0 0 0 1\n1 4 5 6 0 0 0.70710678 0.70710678").unwrap().trajectory;
    assert_eq!(graph.trajectory.poses(), tum.poses());
    assert_eq!(graph.trajectory.stamps_ns(), None);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("graph.g2o");
    fs::write(&path, GRAPH).unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!((read.format, read.out_of_order, read.repeated), (TrajectoryFormat::G2o, 1, 1));
    assert_says(
        &read.notes.join("; "),
        &["8646911284551352320 to 8646911284551352322, not all", "2 vertices"],
    );
    let raw = read_raw_trajectory(&path, None).unwrap();
    assert_eq!(raw.positions_m.iter().map(|p| p.x).collect::<Vec<_>>(), [1.0, 1.0, 4.0]);
}

#[test]
fn a_graph_in_the_plane_turns_about_z() {
    let graph =
        parse_g2o(b"EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nVERTEX_SE2 -1 1 2 1.5\nVERTEX_SE2 0 3 4 -0.5\n").unwrap();
    assert_eq!((graph.ids, graph.out_of_order), (vec![-1, 0], 0));
    let [first, second] = graph.trajectory.poses() else { panic!("two poses") };
    assert_eq!(first.translation.vector.as_slice(), [1.0, 2.0, 0.0]);
    let (roll, pitch, yaw) = first.rotation.euler_angles();
    assert!(roll.abs() < 1e-15 && pitch.abs() < 1e-15 && (yaw - 1.5).abs() < 1e-15);
    assert!((second.rotation.euler_angles().2 + 0.5).abs() < 1e-15);
}

#[test]
fn row_18_bad_vertices_are_named_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("graph.g2o");
    let good = "\u{feff}# a graph\r\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\r\n";
    let cases = [
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 0", &["(0, 0, 0, 0) is zero"][..]),
        ("VERTEX_SE3:QUAT 1 0 nan 0 0 0 0 1", &["`nan` is not finite"]),
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0", &["7 columns", "cut?"]),
        ("VERTEX_SE3:QUAT", &["0 columns", "cut?"]),
        ("VERTEX_SE3:Q", &["`VERTEX_SE3:Q`", "cut?"]),
        ("VERTEX_SE2 1 0 0", &["3 columns", "id x y theta"]),
        ("VERTEX_SE3:QUAT 1.5 0 0 0 0 0 0 1", &["id `1.5`", "no whole number"]),
        ("VERTEX_SE3:QUAT 1 0 2e8 0 0 0 0 1", &["2e8 m"]),
        ("VERTEX_SE3:QUAT 0 0 3 0 0 0 0 1", &["the vertex 0 has another pose than in line 2: 3.000 m"]),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 1 0", &["another pose"]),
    ];
    for (line, parts) in cases {
        fs::write(&path, format!("{good}{line}")).unwrap();
        let error = read_trajectory(&path).unwrap_err().to_string();
        assert_says(&error, &["graph.g2o: line 3: "]);
        assert_says(&error, parts);
    }
    fs::write(&path, "EDGE_SE3:QUAT 0 1\n").unwrap();
    assert_says(&read_trajectory(&path).unwrap_err().to_string(), &["graph.g2o: ", "no poses"]);
}
