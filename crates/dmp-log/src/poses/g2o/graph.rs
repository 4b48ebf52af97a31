//! A whole pose graph of a g2o file.

use super::record::Edge;
use super::{Others, RecordType, Vertices, read_bytes, records};
use crate::{LogError, ParseError, PlaceInFile};
use dmp_sensor::{PoseEdge, PoseGraph, PoseGraphError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A pose graph read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseGraphFile {
    /// The graph.
    pub graph: PoseGraph,
    /// Whether its edges have information. Where none of them has, each is taken to be as good as the others:
    /// [`PoseGraph::unit_information`].
    pub has_information: bool,
    /// Vertices that say again what was said; they were left out.
    pub repeated_vertices: usize,
    /// Lines of other kinds, which were passed over, by their first words.
    pub other_records: BTreeMap<String, u64>,
}

/// Parses a pose graph in g2o's text format: lines of `VERTEX_SE3:QUAT id x y z qx qy qz qw`, of
/// `EDGE_SE3:QUAT from to x y z qx qy qz qw` with the 21 numbers of the information's upper triangle, row by
/// row, or, in all edges, without them, and of `FIX id`. Lines may be in any order. A quaternion of length 1
/// but for rounding is kept as it is, one within 10 % of it is normalised.
///
/// # Errors
/// In the first line that is cut, has no pose, id or number where it should, gives a vertex another pose,
/// leads to a vertex that is not there or has an [`EdgeFault`](dmp_sensor::EdgeFault), has information where
/// others have none or the other way, or is of a graph in the plane; and where there is no vertex.
pub fn parse_pose_graph(bytes: &[u8]) -> Result<PoseGraphFile, ParseError> {
    let (mut vertices, mut others) = (Vertices::new(), Others::default());
    let (mut edges, mut edge_places, mut informed) = (Vec::new(), Vec::new(), Informed::default());
    let mut fixed: BTreeMap<i64, PlaceInFile> = BTreeMap::new();
    for record in records(bytes) {
        let record = record?;
        match record.kind {
            RecordType::Vertex => vertices.push(&record.vertex()?)?,
            RecordType::Edge => {
                let edge = record.edge()?;
                informed.check(record.place, edge.information.is_some())?;
                edges.push(edge.into_pose_edge());
                edge_places.push(record.place);
            }
            RecordType::Fix => fixed.extend(record.fixed()?.into_iter().map(|id| (id, record.place))),
            RecordType::FlatVertex | RecordType::FlatEdge => return Err(in_the_plane(record.place)),
            RecordType::Other(tag) => {
                record.check_vertex_tag()?;
                record.check_edge_tag()?;
                others.count(tag);
            }
        }
    }
    let repeated_vertices = vertices.repeated;
    let ids: BTreeSet<i64> = fixed.keys().copied().collect();
    let graph = PoseGraph::new(vertices.into_poses(), edges, ids).map_err(|error| {
        let place = match error {
            PoseGraphError::Edge { index, .. } => edge_places.get(index).copied(),
            PoseGraphError::UnknownFixed { id } => fixed.get(&id).copied(),
            _ => None,
        };
        let problem = match error {
            PoseGraphError::Empty => format!("no vertices `VERTEX_SE3:QUAT`, but {}", others.in_words()),
            error => error.to_string(),
        };
        ParseError::new(place.unwrap_or(PlaceInFile::WholeFile), problem)
    })?;
    let has_information = informed.is_whole();
    Ok(PoseGraphFile { graph, has_information, repeated_vertices, other_records: others.0 })
}

/// Reads a pose graph, as [`parse_pose_graph`].
///
/// # Errors
/// As [`parse_pose_graph`], when the file cannot be read, and when it is packed by gzip.
pub fn read_pose_graph(path: &Path) -> Result<PoseGraphFile, LogError> {
    parse_pose_graph(&read_bytes(path)?).map_err(|e| e.in_file(path))
}

/// Why a graph in the plane is not read.
pub(super) fn in_the_plane(place: PlaceInFile) -> ParseError {
    let problem = "a graph in the plane (`VERTEX_SE2`, `EDGE_SE2`): scans need poses in space, \
                   `VERTEX_SE3:QUAT` and `EDGE_SE3:QUAT`";
    ParseError::new(place, problem)
}

impl Edge {
    /// With the information of a measurement of which nothing is known, where it has none.
    pub(super) fn into_pose_edge(self) -> PoseEdge {
        let Self { from, to, from_from_to, information } = self;
        let information = information.unwrap_or_else(PoseGraph::unit_information);
        PoseEdge { from, to, from_from_to, information }
    }
}

/// Whether edges have information: all of them or none, as otherwise some would count for nothing beside others.
#[derive(Debug, Default)]
struct Informed(Option<(PlaceInFile, bool)>);

impl Informed {
    fn check(&mut self, place: PlaceInFile, has_information: bool) -> Result<(), ParseError> {
        match *self.0.get_or_insert((place, has_information)) {
            (first, true) if !has_information => {
                Err(ParseError::new(place, format!("an edge without information, that in {first} has some")))
            }
            (first, false) if has_information => {
                Err(ParseError::new(place, format!("an edge with information, that in {first} has none")))
            }
            _ => Ok(()),
        }
    }

    /// Of no edges, too.
    fn is_whole(&self) -> bool {
        self.0.is_none_or(|(_, has_information)| has_information)
    }
}
