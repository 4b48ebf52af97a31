use super::TrajectoryParseError;
use super::numbers::{numbers, pose_of};
use crate::decimal::shorten;
use crate::text::lines;
use crate::{ParseError, Place};
use dmp_sensor::{Isometry3, Trajectory, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

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

const SE3: &str = "VERTEX_SE3:QUAT";
const SE2: &str = "VERTEX_SE2";
const POSE_TAGS: [&str; 2] = [SE3, SE2];

/// A vertex as its line has it.
pub(super) struct Vertex {
    pub(super) place: Place,
    pub(super) id: i64,
    pub(super) position_m: [f64; 3],
    /// x, y, z, w.
    pub(super) quaternion: [f64; 4],
}

/// Whether this word begins a pose graph rather than a table of numbers.
pub(super) fn is_tag(word: &str) -> bool {
    word == "FIX" || ["VERTEX", "EDGE", "PARAMS_"].iter().any(|start| word.starts_with(start))
}

/// Parses the poses of a graph in g2o's text format: lines of `VERTEX_SE3:QUAT id x y z qx qy qz qw` and
/// `VERTEX_SE2 id x y theta` (radians, z = 0), `world_from_body`, in the order of the ids. Ids are no
/// stamps. Other lines are passed over: edges, parameters, `FIX`, data of a sensor, other vertices.
///
/// # Errors
/// In the first vertex whose line is cut or holds no pose, or whose id has another pose already; and where
/// there is no pose.
pub fn parse_g2o(bytes: &[u8]) -> Result<GraphVertices, TrajectoryParseError> {
    let mut poses: BTreeMap<i64, (Place, Isometry3<f64>)> = BTreeMap::new();
    let (mut out_of_order, mut repeated, mut last) = (0, 0, i64::MIN);
    let other_vertices = for_each_vertex(bytes, |vertex| {
        let Vertex { place, id, position_m, quaternion } = vertex;
        let pose = pose_of(place, position_m, quaternion)?;
        match poses.entry(id) {
            Entry::Vacant(vacant) => {
                vacant.insert((place, pose));
                out_of_order += usize::from(id < last);
                last = id;
            }
            Entry::Occupied(there) => {
                let (first, other) = there.get();
                let apart_m = (pose.translation.vector - other.translation.vector).norm();
                // The tolerance of stamps that are there twice.
                if apart_m > 1e-3 || pose.rotation.angle_to(&other.rotation) > 1e-3 {
                    let problem =
                        format!("the vertex {id} has another pose than in {first}: {apart_m:.3} m apart");
                    return Err(ParseError::new(place, problem));
                }
                repeated += 1;
            }
        }
        Ok(())
    })?;
    let ids = poses.keys().copied().collect();
    let trajectory = Trajectory::unstamped(poses.into_values().map(|(_, pose)| pose).collect())?;
    Ok(GraphVertices { trajectory, ids, out_of_order, repeated, other_vertices })
}

/// Gives `each` the poses of a graph in the order of the lines; how many vertices were none.
pub(super) fn for_each_vertex(
    bytes: &[u8],
    mut each: impl FnMut(Vertex) -> Result<(), ParseError>,
) -> Result<usize, ParseError> {
    let mut others = 0;
    for line in lines(bytes) {
        let (place, columns) = line?;
        let Some((&tag, rest)) = columns.split_first() else { continue };
        let vertex = match tag {
            SE3 => {
                let [_, x, y, z, quaternion @ ..] = numbers::<8>(place, rest, "id x y z qx qy qz qw")?;
                Vertex { place, id: id_of(place, rest)?, position_m: [x, y, z], quaternion }
            }
            SE2 => {
                let [_, x, y, theta_rad] = numbers::<4>(place, rest, "id x y theta")?;
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta_rad);
                let quaternion = turn.coords.into();
                Vertex { place, id: id_of(place, rest)?, position_m: [x, y, 0.0], quaternion }
            }
            _ if POSE_TAGS.iter().any(|pose_tag| pose_tag.starts_with(tag)) => {
                return Err(ParseError::new(place, format!("`{}`: is the line cut?", shorten(tag))));
            }
            _ => {
                others += usize::from(tag.starts_with("VERTEX"));
                continue;
            }
        };
        each(vertex)?;
    }
    Ok(others)
}

/// An id is a whole number; GTSAM puts a letter into its upper bits, which is more than an `f64` holds.
fn id_of(place: Place, columns: &[&str]) -> Result<i64, ParseError> {
    let id = columns.first().copied().unwrap_or_default();
    id.parse().map_err(|_| ParseError::new(place, format!("the id `{}` is no whole number", shorten(id))))
}
