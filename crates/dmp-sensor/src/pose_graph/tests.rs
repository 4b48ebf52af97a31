use super::*;

fn edge(from: i64, to: i64) -> PoseEdge {
    let from_from_to = Isometry3::translation(1.0, 0.0, 0.0);
    PoseEdge { from, to, from_from_to, information: PoseGraph::unit_information() }
}

fn at(ids: &[i64]) -> BTreeMap<i64, Isometry3<f64>> {
    ids.iter().map(|&id| (id, Isometry3::translation(id as f64, 0.0, 0.0))).collect()
}

fn graph(ids: &[i64], edges: &[(i64, i64)]) -> PoseGraph {
    let edges = edges.iter().map(|&(from, to)| edge(from, to)).collect();
    PoseGraph::new(at(ids), edges, BTreeSet::new()).unwrap()
}

fn fault_of(edge: PoseEdge) -> EdgeFault {
    let error = PoseGraph::new(at(&[1, 2]), vec![self::edge(1, 2), edge], BTreeSet::new()).unwrap_err();
    let PoseGraphError::Edge { index: 1, fault, .. } = error else { panic!("{error}") };
    fault
}

#[test]
fn round_deviations_have_round_information() {
    let diagonal = |place_m: f64, turn_rad: f64| -> [f64; 6] {
        let information = PoseGraph::information_of(place_m, turn_rad);
        assert_eq!(information, Matrix6::from_diagonal(&information.diagonal()));
        information.diagonal().into()
    };
    assert_eq!(diagonal(1.0, 1.0), [1.0, 1.0, 1.0, 4.0, 4.0, 4.0]);
    assert_eq!(diagonal(0.1, 0.01), [100.0, 100.0, 100.0, 4e4, 4e4, 4e4]);
    assert_eq!(diagonal(0.01, 0.001), [1e4, 1e4, 1e4, 4e6, 4e6, 4e6]);
}

#[test]
fn vertices_are_found_by_their_ids() {
    let graph = graph(&[i64::MAX, -3, 7], &[(7, -3)]);
    assert_eq!(graph.ids(), [-3, 7, i64::MAX]);
    assert_eq!(graph.poses().iter().map(|pose| pose.translation.x).collect::<Vec<_>>()[..2], [-3.0, 7.0]);
    assert_eq!((graph.index_of(7), graph.index_of(8)), (Some(1), None));
}

#[test]
fn an_edge_that_is_unusable_is_named() {
    assert_eq!(fault_of(edge(1, 9)), EdgeFault::UnknownVertex { id: 9 });
    assert_eq!(fault_of(edge(9, 1)), EdgeFault::UnknownVertex { id: 9 });
    assert_eq!(fault_of(edge(2, 2)), EdgeFault::SameVertex { id: 2 });
    let nowhere = Isometry3::translation(0.0, f64::NAN, 0.0);
    assert_eq!(fault_of(PoseEdge { from_from_to: nowhere, ..edge(1, 2) }), EdgeFault::NotFinite);
    let with = |change: fn(&mut Matrix6<f64>)| {
        let mut edge = edge(1, 2);
        change(&mut edge.information);
        fault_of(edge)
    };
    assert_eq!(with(|m| m[(2, 2)] = f64::INFINITY), EdgeFault::NotFinite);
    assert_eq!(with(|m| m[(0, 5)] = 0.5), EdgeFault::NotSymmetric);
    let EdgeFault::NotPositiveDefinite { least: Some(least) } = with(|m| m[(4, 4)] = -2.0) else { panic!() };
    assert!((least + 2.0).abs() < 1e-12);
    assert_eq!(with(|m| m[(1, 1)] = 0.0), EdgeFault::NotPositiveDefinite { least: Some(0.0) });
    // Every number of the diagonal is well, and still: 1 and 4 with 3 beside them.
    let fault = with(|m| (m[(0, 3)], m[(3, 0)]) = (3.0, 3.0));
    let text = fault.to_string();
    assert!(text.ends_with("not positive definite: its smallest eigenvalue is -8.541e-1"), "{text}");
}

#[test]
fn what_is_no_graph_is_named() {
    let new = |ids: &[i64], fixed: &[i64]| PoseGraph::new(at(ids), vec![], fixed.iter().copied().collect());
    assert_eq!(new(&[], &[]), Err(PoseGraphError::Empty));
    assert_eq!(new(&[1], &[2]), Err(PoseGraphError::UnknownFixed { id: 2 }));
    let far = BTreeMap::from([(5, Isometry3::translation(f64::INFINITY, 0.0, 0.0))]);
    let error = PoseGraph::new(far, vec![], BTreeSet::new());
    assert_eq!(error, Err(PoseGraphError::NotFinite { id: 5 }));
    let graph = graph(&[1, 2], &[(1, 2)]);
    let error = graph.with_poses(vec![Isometry3::identity()]);
    assert_eq!(error, Err(PoseGraphError::OtherCount { poses: 1, vertices: 2 }));
    let moved = graph.with_poses(vec![Isometry3::identity(); 2]).unwrap();
    assert_eq!((moved.edges(), moved.poses()), (graph.edges(), &[Isometry3::identity(); 2][..]));
}

#[test]
fn parts_that_no_edge_connects_are_named() {
    let apart = graph(&[0, 1, 2, 10, 11, 20, 30, 40], &[(1, 0), (2, 1), (0, 2), (11, 10)]);
    let component = |vertices, first| Component { vertices, first };
    let components = apart.components(&[]);
    assert_eq!(
        components,
        [component(3, 0), component(2, 10), component(1, 20), component(1, 30), component(1, 40)]
    );
    let error = apart.check_connected(&[]).unwrap_err().to_string();
    let parts = "3 vertices with 0, 2 vertices with 10, 1 vertex with 20, 1 vertex with 30, and 1 more";
    assert_eq!(error, format!("the graph is in 5 parts that no edge connects: {parts}"));
    let extra = [edge(11, 2), edge(20, 10), edge(40, 30), edge(40, 99)];
    assert_eq!(apart.components(&extra), [component(6, 0), component(2, 30)]);
    assert_eq!(apart.check_connected(&[&extra[..], &[edge(30, 1)]].concat()), Ok(()));
}
