//! The vertices of a g2o file as a trajectory.

use super::error::TrajectoryParseError;
use crate::ParseError;
use crate::poses::g2o::{RecordType, Vertex, Vertices, records};
use dmp_sensor::Trajectory;

/// The vertices of a pose graph, in the order of their ids.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphVertices {
    /// The poses, `world_from_body`, without stamps.
    pub trajectory: Trajectory,
    /// Their ids, increasing.
    pub ids: Vec<i64>,
    /// Vertices whose id was smaller than the one before them.
    pub out_of_order: usize,
    /// Vertices that say again what was said; they were left out.
    pub repeated: usize,
    /// Vertices of other types, which are no poses: landmarks, planes and the like.
    pub other_vertices: usize,
}

/// Parses the poses of a graph in g2o's text format: lines of `VERTEX_SE3:QUAT id x y z qx qy qz qw` and
/// `VERTEX_SE2 id x y theta` (radians, z = 0), `world_from_body`, in the order of the ids. Ids are no
/// stamps. Other lines are passed over: edges, parameters, `FIX`, data of a sensor, other vertices.
///
/// # Errors
/// In the first vertex whose line is cut or holds no pose, or whose id has another pose already; and where
/// there is no pose.
pub fn parse_g2o(bytes: &[u8]) -> Result<GraphVertices, TrajectoryParseError> {
    let mut vertices = Vertices::new();
    let other_vertices = for_each_vertex(bytes, |vertex| vertices.push(&vertex))?;
    let (out_of_order, repeated) = (vertices.out_of_order, vertices.repeated);
    let (ids, poses) = vertices.into_poses().into_iter().unzip();
    Ok(GraphVertices {
        trajectory: Trajectory::unstamped(poses)?,
        ids,
        out_of_order,
        repeated,
        other_vertices,
    })
}

/// Gives `each` the poses of a graph in the order of the lines; how many vertices were none.
pub(super) fn for_each_vertex(
    bytes: &[u8],
    mut each: impl FnMut(Vertex) -> Result<(), ParseError>,
) -> Result<usize, ParseError> {
    let mut others = 0;
    for record in records(bytes) {
        let record = record?;
        match record.kind {
            RecordType::Vertex | RecordType::FlatVertex => each(record.vertex()?)?,
            RecordType::Other(tag) => {
                record.check_vertex_tag()?;
                others += usize::from(tag.starts_with("VERTEX"));
            }
            RecordType::Edge | RecordType::FlatEdge | RecordType::Fix => {}
        }
    }
    Ok(others)
}
