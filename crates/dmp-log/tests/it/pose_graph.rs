use crate::common::{Random, assert_says, refusals};
use dmp_log::{
    CandidateFault, LoopCandidates, PlaceInFile, PoseGraphFile, parse_g2o, parse_loop_candidates,
    parse_pose_graph, read_loop_candidates, read_pose_graph, write_pose_edges, write_pose_graph,
};
use dmp_sensor::{
    EdgeFault, Isometry3, Matrix6, PoseEdge, PoseGraph, Quaternion, Translation3, UnitQuaternion,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

const UNIT: &str = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
/// The information is 11 to 66, with the row and the column of an element as its digits.
const DIGITS: &str = "11 12 13 14 15 16 22 23 24 25 26 33 34 35 36 44 45 46 55 56 66";

/// As written by several programs: comments, tabs, CRLF, trailing blanks, edges before their vertices,
/// parameters, other vertices and edges, a fixed vertex, one that is there again.
fn graph_text() -> String {
    let dominant = DIGITS.replace("11 ", "111 ").replace(" 22", " 222").replace(" 33 ", " 333 ");
    let dominant = dominant.replace(" 44 ", " 444 ").replace(" 55 ", " 555 ").replace(" 66", " 666");
    format!(
        "\u{feff}# saved by a program\r\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n\n\
        EDGE_SE3:QUAT 7 -2\t1 2 3 0 0 0.6 0.8 {dominant} \r\n\
        VERTEX_SE3:QUAT 7 4 5 6 0 0 0.70710678 0.70710678 \nFIX 7 9\nFIX -2 # the first\n\
        VERTEX_SE3:QUAT -2 0.1 1e-3 -3 0 0 0 1\nVERTEX_SE3:QUAT 9 7 8 9 -1 0 0 0\n\
        VERTEX_TRACKXYZ 8 1 2 3\nVERTEX_SE3:QUAT 7 4 5 6 0 0 0.70710678 0.70710678\n\
        EDGE_SE3_PRIORXYZ 0 1 2 3 1 0 0 1 0 1\nEDGE_SE3_PRIORXYZ 0 1 2 3 1 0 0 1 0 1\n\
        EDGE_SE3:QUAT -2 9 0 0 0 0 0 0 1 {UNIT}"
    )
}

fn parse(text: &str) -> PoseGraphFile {
    parse_pose_graph(text.as_bytes()).unwrap()
}

/// Three vertices on a line, two edges.
fn line_of_three() -> PoseGraphFile {
    let vertex = |id| format!("VERTEX_SE3:QUAT {id} {id} 0 0 0 0 0 1\n");
    let edge = |from, to| format!("EDGE_SE3:QUAT {from} {to} 1 0 0 0 0 0 1 {UNIT}\n");
    parse(&[vertex(0), vertex(1), vertex(2), edge(0, 1), edge(1, 2)].concat())
}

#[test]
fn a_graph_is_read_whatever_else_is_in_its_file() {
    let PoseGraphFile { graph, has_information, repeated_vertices, other_records } = parse(&graph_text());
    assert_eq!((graph.ids(), graph.fixed()), (&[-2, 7, 9][..], &[-2, 7, 9][..]));
    assert_eq!(graph.poses()[0].translation.vector.as_slice(), [0.1, 1e-3, -3.0]);
    assert_eq!(graph.poses()[2].rotation.coords.as_slice(), [-1.0, 0.0, 0.0, 0.0]);
    assert!((graph.poses()[1].rotation.coords.norm() - 1.0).abs() < 1e-15);
    assert_eq!((has_information, repeated_vertices), (true, 1));
    let others = ["EDGE_SE3_PRIORXYZ", "PARAMS_SE3OFFSET", "VERTEX_TRACKXYZ"].map(str::to_owned);
    assert_eq!(other_records, others.into_iter().zip([2, 1, 1]).collect());
    let [first, second] = graph.edges() else { panic!("two edges") };
    assert_eq!((first.from, first.to, second.from, second.to), (7, -2, -2, 9));
    assert_eq!(first.from_from_to.translation.vector.as_slice(), [1.0, 2.0, 3.0]);
    assert_eq!(first.from_from_to.rotation.coords.as_slice(), [0.0, 0.0, 0.6, 0.8]);
    for (row, column) in (0..6).flat_map(|row| (row..6).map(move |column| (row, column))) {
        let digits = (10 * (row + 1) + column + 1) as f64;
        let wanted = if row == column { digits * 10.0 + (row + 1) as f64 } else { digits };
        assert_eq!(first.information[(row, column)], wanted, "{row} {column}");
        assert_eq!(first.information[(column, row)], wanted);
    }
    assert_eq!(second.information, Matrix6::identity());
}

#[test]
fn vertices_are_those_of_the_trajectory() {
    let text = graph_text();
    let vertices = parse_g2o(text.as_bytes()).unwrap();
    assert_eq!(vertices.trajectory.poses(), parse(&text).graph.poses());
}

#[test]
fn without_information_all_edges_are_as_good() {
    let text = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n";
    let file = parse(&format!("{text}EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1\nEDGE_SE3:QUAT 1 0 -1 0 0 0 0 0 1\n"));
    assert!(!file.has_information);
    assert!(file.graph.edges().iter().all(|edge| edge.information == PoseGraph::unit_information()));
    // A graph of one pose or without edges is a graph; whether it is of any use is for others to say.
    assert_eq!((parse(text).graph.edges().len(), parse(text).has_information), (0, true));
}

/// Bits, as `==` takes -0 for 0.
fn bits(pose: &Isometry3<f64>) -> Vec<u64> {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).map(|c| c.to_bits()).collect()
}

fn random_graph(random: &mut Random) -> PoseGraph {
    let mut number = |scale: f64| scale * ((random.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0);
    let mut pose = || {
        let [x, y, z] = std::array::from_fn(|k| number([1e7, 30.0, 1e-9][k]));
        let turn = Quaternion::new(number(1.0), number(1.0), number(1.0), number(0.01));
        // Products of rotations leave the unit sphere by their rounding.
        let turn = (0..5).fold(UnitQuaternion::from_quaternion(turn), |product, _| product * product);
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    };
    let vertices: BTreeMap<i64, Isometry3<f64>> =
        [i64::MIN, -1, 0, 3, i64::MAX].into_iter().map(|id| (id, pose())).collect();
    let measured = [(3, -1), (i64::MAX, i64::MIN), (-1, 3)].map(|ends| (ends, pose()));
    let edges = measured.map(|((from, to), from_from_to)| {
        let root = Matrix6::from_fn(|_, _| number(1.0));
        let information = root * root.transpose() + Matrix6::identity();
        PoseEdge { from, to, from_from_to, information: (information + information.transpose()) / 2.0 }
    });
    PoseGraph::new(vertices, edges.to_vec(), BTreeSet::from([3, i64::MIN])).unwrap()
}

#[test]
fn a_graph_that_was_written_is_read_to_the_same_bits() {
    let mut random = Random(3);
    for _ in 0..200 {
        let graph = random_graph(&mut random);
        let mut text = Vec::new();
        write_pose_graph(&mut text, &graph).unwrap();
        let PoseGraphFile { graph: read, has_information, .. } = parse_pose_graph(&text).unwrap();
        assert!(has_information);
        assert_eq!(read, graph);
        let measured = |graph: &PoseGraph| -> Vec<Isometry3<f64>> {
            let edges = graph.edges().iter().map(|edge| edge.from_from_to);
            graph.poses().iter().copied().chain(edges).collect()
        };
        let same = measured(&read).iter().zip(&measured(&graph)).all(|(a, b)| bits(a) == bits(b));
        assert!(same);
    }
}

#[test]
fn each_fault_of_a_graph_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("graph.g2o");
    let good = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\r\n\r\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\r\n";
    let good = format!("{good}EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 {UNIT}\n");
    let with_tail = |tail: &str| format!("EDGE_SE3:QUAT 1 0 1 2 3 0 0 0 1 {tail}");
    let indefinite = with_tail("1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 -2.5 0 1");
    refusals(
        |line| {
            fs::write(&path, format!("{good}{line}\n# the end\n")).unwrap();
            read_pose_graph(&path).unwrap_err().to_string()
        },
        "graph.g2o: line 5: ",
        &[
            ("VERTEX_SE3:QUAT 2 0 0 0 0 0 0 0", "(0, 0, 0, 0) is zero"),
            ("VERTEX_SE3:QUAT 2 0 0 0 0 0 0", "7 columns | cut?"),
            ("VERTEX_SE3:QUAT 2 0 0 inf 0 0 0 1", "`inf` is not finite"),
            (
                "VERTEX_SE3:QUAT 1 0 0 4 0 0 0 1",
                "the vertex 1 has another pose than in line 3: 4.000 m apart",
            ),
            ("VERTEX_SE2 2 0 0 0", "in the plane | VERTEX_SE3:QUAT"),
            ("EDGE_SE2 0 1 0 0 0 1 0 0 1 0 1", "in the plane | EDGE_SE3:QUAT"),
            ("EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 1 0 0", "12 columns, expected 30 | or 9 | cut?"),
            ("EDGE_SE3:QUAT", "0 columns | cut?"),
            ("EDGE_SE3:", "`EDGE_SE3:` | cut?"),
            ("VERTEX_SE", "`VERTEX_SE` | cut?"),
            ("EDGE_SE3:QUAT 1 0 1 2 3 0 0 0 1", "an edge without information, that in line 4 has some"),
            (&with_tail(UNIT).replace(" 2 ", " nan "), "`nan` is not finite"),
            (&with_tail(UNIT).replace("1 0 1", "1 0.5 1"), "id `0.5` is no whole number"),
            (&with_tail(UNIT).replace("0 0 0 1 1", "0 0 0 2 1"), "(0, 0, 0, 2) has the norm 2.0000"),
            (&with_tail(UNIT).replace("1 0 1 2", "1 77 1 2"), "the edge from 1 to 77: there is no vertex 77"),
            (
                &with_tail(UNIT).replace("1 0 1 2", "1 1 1 2"),
                "from 1 to 1: it leads from the vertex 1 to itself",
            ),
            (&indefinite, "from 1 to 0: | not positive definite: its smallest eigenvalue is -2.500e0"),
            ("FIX", "`FIX` without an id"),
            ("FIX 0 5", "the vertex 5 is to be fixed, and there is no such vertex"),
        ],
    );
}

#[test]
fn what_is_no_graph_is_refused_with_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("graph.g2o.gz");
    let error = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        read_pose_graph(&path).unwrap_err().to_string()
    };
    refusals(
        |text| error(text.as_bytes()),
        "graph.g2o.gz: ",
        &[
            ("", "no vertices `VERTEX_SE3:QUAT`, but nothing"),
            ("1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 1\n1.5\n", "but 2 `1.5`, 1 `2.5`"),
            ("A\nB\nC\nD\n", "but 1 `A`, 1 `B`, 1 `C`, others"),
            ("FIX 3\n", "no vertices"),
        ],
    );
    assert_says(&error(b"\x1f\x8b\x08\x08 packed"), &["the whole file: packed by gzip", "gunzip"]);
    assert_says(&error(b"VERTEX_SE3:QUAT 0 \xff\xfe"), &["line 1: not text"]);
    assert!(read_pose_graph(&folder.path().join("none")).unwrap_err().is_usage());
}

#[test]
fn each_fault_of_a_candidate_is_named_and_the_others_are_kept() {
    let others = "# loops\nVERTEX_SE3:QUAT 0 9 9 9 0 0 0 1\nVERTEX_SE3:QUAT broken\nFIX 0\nODD\n";
    let edges = [
        format!("0 2 1 0 0 0 0 0 1 {UNIT}"),
        format!("0 5 1 0 0 0 0 0 1 {UNIT}"),
        format!("2 2 1 0 0 0 0 0 1 {UNIT}"),
        format!("2 1 1 0 0 0 0 0 1 {UNIT}"),
        format!("2 0 1 0 0 0 0 0 1 {UNIT}"),
        "0 2 1 0 0 0 0 0 1".to_owned(),
        "0 2 1 0 0 0 0 0 1 1 2 3".to_owned(),
        "x 2 1 0 0 0 0 0 1".to_owned(),
        format!("0 2 1 0 0 0 0 0 0 {UNIT}"),
        format!("0 2 1 0 0 0 0 0 1 -{UNIT}"),
    ];
    let edges = edges.map(|line| format!("EDGE_SE3:QUAT {line}")).join("\r\n");
    let text = format!("{others}{edges}\r\nEDGE_SE3");
    let graph = line_of_three();
    let found = parse_loop_candidates(text.as_bytes(), &graph).unwrap();
    let LoopCandidates { candidates, skipped, other_records } = found;
    let [only] = &candidates[..] else { panic!("{candidates:?}") };
    assert_eq!((only.place, only.edge.from, only.edge.to), (PlaceInFile::Line(6), 0, 2));
    let count = |tag: &str| other_records.get(tag).copied();
    assert_eq!((count("VERTEX_SE3:QUAT"), count("FIX"), count("ODD")), (Some(2), Some(1), Some(1)));
    assert_eq!(other_records.len(), 3);

    assert!(skipped.iter().map(|skipped| skipped.place).eq((7..=16).map(PlaceInFile::Line)));
    let wanted = [
        (Some((0, 5)), "there is no vertex 5"),
        (Some((2, 2)), "from the vertex 2 to itself"),
        (Some((2, 1)), "the graph has an edge between 2 and 1 already"),
        (Some((2, 0)), "the candidate in line 6 is between 2 and 0 already"),
        (Some((0, 2)), "it has no information, and the edges of the graph have"),
        (Some((0, 2)), "12 columns, expected 30"),
        (None, "id `x` is no whole number"),
        (Some((0, 2)), "(0, 0, 0, 0) is zero"),
        (Some((0, 2)), "not positive definite: its smallest eigenvalue is -1.000e0"),
        (None, "`EDGE_SE3`: is the line cut?"),
    ];
    for (skipped, (ends, part)) in skipped.iter().zip(wanted) {
        assert_eq!(skipped.ends, ends);
        assert_says(&skipped.fault.to_string(), &[part]);
    }
    assert_eq!(skipped[0].fault, CandidateFault::Edge(EdgeFault::UnknownVertex { id: 5 }));
}

/// Only a candidate that can be tried stands in the way of another.
#[test]
fn a_skipped_candidate_hides_no_other() {
    let text = format!("EDGE_SE3:QUAT 0 2 1 0 0 0 0 0 1\nEDGE_SE3:QUAT 2 0 1 0 0 0 0 0 1 {UNIT}\n");
    let found = parse_loop_candidates(text.as_bytes(), &line_of_three()).unwrap();
    assert_eq!((found.candidates.len(), found.candidates[0].place), (1, PlaceInFile::Line(2)));
    assert_eq!(found.skipped[0].fault, CandidateFault::NoInformation);
    // Where no edge of the graph has any, a candidate needs none.
    let bare = PoseGraphFile { has_information: false, ..line_of_three() };
    let found = parse_loop_candidates(text.as_bytes(), &bare).unwrap();
    assert_eq!(found.candidates[0].edge.information, PoseGraph::unit_information());
    let fault = CandidateFault::Repeated { first: PlaceInFile::Line(1), from: 2, to: 0 };
    assert_eq!((found.candidates.len(), &found.skipped[0].fault), (1, &fault));
}

#[test]
fn candidates_are_written_and_files_without_any_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("candidates.g2o");
    let graph = line_of_three();
    let edge = PoseEdge { from: 2, to: 0, ..graph.graph.edges()[0].clone() };
    let mut text = Vec::new();
    write_pose_edges(&mut text, std::slice::from_ref(&edge)).unwrap();
    fs::write(&path, &text).unwrap();
    let found = read_loop_candidates(&path, &graph).unwrap();
    assert_eq!((found.candidates.len(), &found.candidates[0].edge), (1, &edge));

    let error = |text: &str| {
        fs::write(&path, text).unwrap();
        read_loop_candidates(&path, &graph).unwrap_err().to_string()
    };
    assert_says(&error("FIX 0\n"), &["candidates.g2o: ", "no edges `EDGE_SE3:QUAT`, but 1 `FIX`"]);
    assert_says(&error("EDGE_SE2 0 2 0 0 0 1 0 0 1 0 1\n"), &["line 1: ", "in the plane"]);
}
