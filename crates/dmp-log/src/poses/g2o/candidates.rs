//! Loop candidates: edges of a g2o file that may be added to a graph.

use super::graph::in_the_plane;
use super::{Others, PoseGraphFile, Record, RecordType, read_bytes, records, undirected};
use crate::{LogError, ParseError, PlaceInFile};
use dmp_sensor::{EdgeFault, PoseEdge};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A measurement that may be added to a graph: a loop that somebody thinks to have seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its line.
    pub place: PlaceInFile,
    /// The measurement.
    pub edge: PoseEdge,
}

/// A candidate that cannot be tried.
#[derive(Debug, Clone, PartialEq)]
pub struct SkippedCandidate {
    /// Its line.
    pub place: PlaceInFile,
    /// The vertices that it leads from and to, where they could be read.
    pub ends: Option<(i64, i64)>,
    /// Why it cannot be tried.
    pub fault: CandidateFault,
}

/// Why a candidate cannot be tried.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CandidateFault {
    /// Its line makes no sense.
    #[error("{problem}")]
    Line {
        /// What is wrong, with the value.
        problem: String,
    },
    /// It cannot be an edge of the graph.
    #[error(transparent)]
    Edge(#[from] EdgeFault),
    /// It has no information, and the edges of the graph have: there is no saying what it counts beside them.
    #[error("it has no information, and the edges of the graph have")]
    NoInformation,
    /// The graph has an edge between the same two vertices, in either direction.
    #[error("the graph has an edge between {from} and {to} already")]
    InGraph {
        /// The vertex that the candidate leads from.
        from: i64,
        /// The vertex that it leads to.
        to: i64,
    },
    /// A candidate before it is between the same two vertices, in either direction.
    #[error("the candidate in {first} is between {from} and {to} already")]
    Repeated {
        /// The line of the candidate that is kept.
        first: PlaceInFile,
        /// The vertex that this one leads from.
        from: i64,
        /// The vertex that it leads to.
        to: i64,
    },
}

/// The loop candidates of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopCandidates {
    /// Those that can be tried, in the order of the lines.
    pub candidates: Vec<Candidate>,
    /// The others, in the order of the lines.
    pub skipped: Vec<SkippedCandidate>,
    /// Lines that are no edges, which were passed over, by their first words: vertices are those of the graph.
    pub other_records: BTreeMap<String, u64>,
}

/// Parses loop candidates for a graph: lines as those of its edges in [`parse_pose_graph`](super::parse_pose_graph).
/// What is wrong with one of them is no error: it is skipped.
///
/// # Errors
/// In a line that is no text or of a graph in the plane, and where there is no edge at all.
pub fn parse_loop_candidates(bytes: &[u8], of: &PoseGraphFile) -> Result<LoopCandidates, ParseError> {
    let mut pairs_of_graph: BTreeSet<(i64, i64)> = BTreeSet::new();
    pairs_of_graph.extend(of.graph.edges().iter().map(|edge| undirected(edge.from, edge.to)));
    let mut seen = Seen { of, pairs_of_graph, pairs: BTreeMap::new() };
    let (mut candidates, mut skipped, mut others) = (Vec::new(), Vec::new(), Others::default());
    for record in records(bytes) {
        let record = record?;
        let place = record.place;
        let tag = match record.kind {
            RecordType::FlatVertex | RecordType::FlatEdge => return Err(in_the_plane(place)),
            RecordType::Edge => None,
            RecordType::Vertex => Some(super::record::VERTEX),
            RecordType::Fix => Some(super::record::FIX),
            RecordType::Other(tag) => record.check_edge_tag().is_ok().then_some(tag),
        };
        if let Some(tag) = tag {
            others.count(tag);
            continue;
        }
        let found = record.check_edge_tag().map_err(Into::into).and_then(|()| seen.candidate(&record));
        match found {
            Ok(edge) => candidates.push(Candidate { place, edge }),
            Err(fault) => skipped.push(SkippedCandidate { place, ends: record.ends(), fault }),
        }
    }
    if candidates.is_empty() && skipped.is_empty() {
        let problem = format!("no edges `EDGE_SE3:QUAT`, but {}", others.in_words());
        return Err(ParseError::new(PlaceInFile::WholeFile, problem));
    }
    Ok(LoopCandidates { candidates, skipped, other_records: others.0 })
}

/// Reads loop candidates for a graph, as [`parse_loop_candidates`].
///
/// # Errors
/// As [`parse_loop_candidates`], when the file cannot be read, and when it is packed by gzip.
pub fn read_loop_candidates(path: &Path, of: &PoseGraphFile) -> Result<LoopCandidates, LogError> {
    parse_loop_candidates(&read_bytes(path)?, of).map_err(|e| e.in_file(path))
}

/// What candidates must be new to.
struct Seen<'a> {
    of: &'a PoseGraphFile,
    pairs_of_graph: BTreeSet<(i64, i64)>,
    /// Of candidates that can be tried, with their lines.
    pairs: BTreeMap<(i64, i64), PlaceInFile>,
}

impl Seen<'_> {
    fn candidate(&mut self, record: &Record<'_>) -> Result<PoseEdge, CandidateFault> {
        let edge = record.edge()?;
        let has_information = edge.information.is_some();
        let edge = edge.into_pose_edge();
        self.of.graph.check_edge(&edge)?;
        if self.of.has_information && !has_information {
            return Err(CandidateFault::NoInformation);
        }
        let (from, to) = (edge.from, edge.to);
        if self.pairs_of_graph.contains(&undirected(from, to)) {
            return Err(CandidateFault::InGraph { from, to });
        }
        if let Some(&first) = self.pairs.get(&undirected(from, to)) {
            return Err(CandidateFault::Repeated { first, from, to });
        }
        self.pairs.insert(undirected(from, to), record.place);
        Ok(edge)
    }
}

impl From<ParseError> for CandidateFault {
    fn from(error: ParseError) -> Self {
        Self::Line { problem: error.problem }
    }
}
