//! One line of a g2o file: a vertex, an edge, or something else.

use dmp_sensor::{Isometry3, Matrix6, Quaternion, UnitQuaternion, Vector3};

use crate::file::columns::numbers;
use crate::file::{lines, pose_of, shorten, values};
use crate::{ParseError, PlaceInFile};

pub(super) const VERTEX: &str = "VERTEX_SE3:QUAT";
pub(super) const EDGE: &str = "EDGE_SE3:QUAT";
pub(super) const FIX: &str = "FIX";
const FLAT_VERTEX: &str = "VERTEX_SE2";
const FLAT_EDGE: &str = "EDGE_SE2";

/// Columns of an edge without information, and of one with the upper triangle of it.
const SHORT_EDGE: usize = 9;
const WHOLE_EDGE: usize = SHORT_EDGE + 21;
/// How far the square of a quaternion's norm may be from 1 for it to be of length 1 but for rounding.
const UNIT_TOLERANCE: f64 = 1e-12;

/// What a line says, by its first word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RecordType<'a> {
    /// A pose.
    Vertex,
    /// A pose in the plane.
    FlatVertex,
    /// A measurement between two poses.
    Edge,
    /// A measurement between two poses in the plane.
    FlatEdge,
    /// Vertices that are held where they are.
    Fix,
    /// Anything else.
    Other(&'a str),
}

#[derive(Debug)]
pub(crate) struct Record<'a> {
    pub(crate) place: PlaceInFile,
    pub(crate) kind: RecordType<'a>,
    /// The columns behind the first word.
    columns: Vec<&'a str>,
}

/// A vertex as its line has it.
#[derive(Debug)]
pub(crate) struct Vertex {
    pub(crate) place: PlaceInFile,
    pub(crate) id: i64,
    pub(crate) position_m: [f64; 3],
    /// x, y, z, w.
    pub(crate) quaternion: [f64; 4],
}

/// An edge as its line has it.
#[derive(Debug)]
pub(super) struct Edge {
    pub(super) from: i64,
    pub(super) to: i64,
    pub(super) from_from_to: Isometry3<f64>,
    pub(super) information: Option<Matrix6<f64>>,
}

pub(crate) fn records(bytes: &[u8]) -> impl Iterator<Item = Result<Record<'_>, ParseError>> {
    lines(bytes).map(|line| {
        let (place, columns) = line?;
        let (tag, columns) =
            columns.split_first().map_or(("", Vec::new()), |(tag, rest)| (*tag, rest.to_vec()));
        let kind = match tag {
            VERTEX => RecordType::Vertex,
            FLAT_VERTEX => RecordType::FlatVertex,
            EDGE => RecordType::Edge,
            FLAT_EDGE => RecordType::FlatEdge,
            FIX => RecordType::Fix,
            other => RecordType::Other(other),
        };
        Ok(Record { place, kind, columns })
    })
}

/// Whether this word begins a pose graph rather than a table of numbers.
pub(crate) fn is_tag(word: &str) -> bool {
    word == FIX || ["VERTEX", "EDGE", "PARAMS_"].iter().any(|start| word.starts_with(start))
}

impl Record<'_> {
    /// The vertex of a line of one of the two kinds.
    pub(crate) fn vertex(&self) -> Result<Vertex, ParseError> {
        let Self { place, ref columns, .. } = *self;
        let (position_m, quaternion) = if self.kind == RecordType::FlatVertex {
            let [_, x, y, theta_rad] = numbers::<4>(place, columns, "id x y theta")?;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta_rad);
            ([x, y, 0.0], turn.coords.into())
        } else {
            let [_, x, y, z, quaternion @ ..] = numbers::<8>(place, columns, "id x y z qx qy qz qw")?;
            ([x, y, z], quaternion)
        };
        Ok(Vertex { place, id: id_of(place, columns, 0)?, position_m, quaternion })
    }

    pub(super) fn edge(&self) -> Result<Edge, ParseError> {
        let Self { place, ref columns, .. } = *self;
        let information = match columns.len() {
            SHORT_EDGE => None,
            WHOLE_EDGE => Some(symmetric(values(place, columns.get(SHORT_EDGE..).unwrap_or_default())?)),
            count => {
                let problem = format!(
                    "{count} columns, expected {WHOLE_EDGE} (from to x y z qx qy qz qw, 21 of the information) \
                    or {SHORT_EDGE} (without information): is the line cut?"
                );
                return Err(ParseError::new(place, problem));
            }
        };
        let (from, to) = (id_of(place, columns, 0)?, id_of(place, columns, 1)?);
        let [x, y, z, quaternion @ ..] = values::<7>(place, columns.get(2..).unwrap_or_default())?;
        Ok(Edge { from, to, from_from_to: kept_pose_of(place, [x, y, z], quaternion)?, information })
    }

    /// The ids of a line of vertices that are held.
    pub(super) fn fixed(&self) -> Result<Vec<i64>, ParseError> {
        if self.columns.is_empty() {
            return Err(ParseError::new(self.place, "`FIX` without an id: is the line cut?"));
        }
        (0..self.columns.len()).map(|column| id_of(self.place, &self.columns, column)).collect()
    }

    /// The two ids of an edge whose line is otherwise wrong, where they can be read.
    pub(super) fn ends(&self) -> Option<(i64, i64)> {
        Some((id_of(self.place, &self.columns, 0).ok()?, id_of(self.place, &self.columns, 1).ok()?))
    }

    /// What is wrong where the first word is the start of one for a pose.
    pub(crate) fn check_vertex_tag(&self) -> Result<(), ParseError> {
        self.check_tag(&[VERTEX, FLAT_VERTEX])
    }

    /// What is wrong where the first word is the start of one for a measurement.
    pub(super) fn check_edge_tag(&self) -> Result<(), ParseError> {
        self.check_tag(&[EDGE, FLAT_EDGE])
    }

    fn check_tag(&self, whole: &[&str]) -> Result<(), ParseError> {
        match self.kind {
            RecordType::Other(tag) if whole.iter().any(|whole| whole.starts_with(tag)) => {
                Err(ParseError::new(self.place, format!("`{}`: is the line cut?", shorten(tag))))
            }
            _ => Ok(()),
        }
    }
}

impl Vertex {
    /// Its pose, `world_from_body`.
    pub(crate) fn pose(&self) -> Result<Isometry3<f64>, ParseError> {
        kept_pose_of(self.place, self.position_m, self.quaternion)
    }
}

/// As [`pose_of`], but a quaternion that is of length 1 but for rounding is kept, so that poses that were
/// written with all digits come back to the same bits.
fn kept_pose_of(
    place: PlaceInFile,
    position_m: [f64; 3],
    quaternion: [f64; 4],
) -> Result<Isometry3<f64>, ParseError> {
    let pose = pose_of(place, position_m, quaternion)?;
    let [x, y, z, w] = quaternion;
    let kept = Quaternion::new(w, x, y, z);
    if (kept.norm_squared() - 1.0).abs() > UNIT_TOLERANCE {
        return Ok(pose);
    }
    Ok(Isometry3::from_parts(pose.translation, UnitQuaternion::new_unchecked(kept)))
}

fn symmetric(upper: [f64; 21]) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    for ((row, column), value) in places.zip(upper) {
        matrix[(row, column)] = value;
        matrix[(column, row)] = value;
    }
    matrix
}

/// An id is a whole number; GTSAM puts a letter into its upper bits, which is more than an `f64` holds.
pub(super) fn id_of(place: PlaceInFile, columns: &[&str], column: usize) -> Result<i64, ParseError> {
    let id = columns.get(column).copied().unwrap_or_default();
    id.parse().map_err(|_| ParseError::new(place, format!("the id `{}` is no whole number", shorten(id))))
}
