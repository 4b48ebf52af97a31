//! Residuals of scans in arrays, and their derivatives.

use dmp_cast::{Caster, Held, Hit, HoldBuffers, HoldSettings, Points, PosedScans};
use dmp_map::{MapError, Store};
use dmp_sensor::{
    Isometry3, Matrix3, Plane, Point3, ResidualKind, RotationError, Translation3, Vector3, nearest_rotation,
};
use numpy::{
    PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray1, PyReadwriteArray2,
    PyUntypedArrayMethods as _,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::chunks::{CHUNK, in_chunks};

/// Columns of the Jacobian.
const COLUMNS: usize = 14;
/// A plane: a point of it, and its normal.
const OF_PLANE: usize = 6;

/// The points of all scans.
#[derive(FromPyObject)]
pub(crate) enum PointRows<'py> {
    Single(PyReadonlyArray2<'py, f32>),
    Double(PyReadonlyArray2<'py, f64>),
}

/// Scans and what is asked of them: the attributes of an object of Python.
#[derive(FromPyObject)]
pub(crate) struct Request<'py> {
    points: PointRows<'py>,
    ends: PyReadonlyArray1<'py, i64>,
    poses: PyReadonlyArray3<'py, f64>,
    extrinsic: PyReadonlyArray3<'py, f64>,
    twists: Option<PyReadonlyArray2<'py, f64>>,
    times: Option<PyReadonlyArray1<'py, f64>>,
    segments: Option<PyReadonlyArray1<'py, i32>>,
    later: f64,
    scale: f64,
    kind: String,
    surfel: String,
    probe: Option<f64>,
    is_held: bool,
    threads: Option<usize>,
}

/// The arrays to fill; planes and states are read instead where the request says that they are held.
#[derive(FromPyObject)]
pub(crate) struct Filled<'py> {
    predicted: PyReadwriteArray1<'py, f64>,
    residual: PyReadwriteArray1<'py, f64>,
    jacobian: Option<PyReadwriteArray2<'py, f64>>,
    planes: PyReadwriteArray2<'py, f64>,
    state: PyReadwriteArray1<'py, u8>,
}

/// Some rows of them, from `start` on.
struct Chunk<'a> {
    start: usize,
    predicted_m: &'a mut [f64],
    residual_m: &'a mut [f64],
    jacobian: Option<&'a mut [[f64; COLUMNS]]>,
    planes: &'a mut [[f64; OF_PLANE]],
    state: &'a mut [u8],
}

/// Buffers of one thread.
#[derive(Default)]
struct Buffers {
    held: Vec<Held>,
    of_caster: HoldBuffers,
}

/// A surfel is held; and it changes nearby; or there is none as requested, but another; or none at all.
mod state {
    pub(super) const HELD: u8 = 0;
    pub(super) const CHANGES: u8 = 1;
    pub(super) const OTHER: u8 = 2;
    pub(super) const MISS: u8 = 3;
}

/// A map, and how its frame lies to that of the poses.
pub(crate) struct Frame<'a> {
    pub(crate) casters: [&'a Caster<Store>; 2],
    pub(crate) world_from_own: Isometry3<f64>,
}

impl Frame<'_> {
    /// Fills the arrays: the interpreter is free meanwhile.
    pub(crate) fn fill(&self, py: Python<'_>, asked: &Request<'_>, filled: &mut Filled<'_>) -> PyResult<()> {
        let wrong = |what: &str| PyValueError::new_err(what.to_owned());
        let kind = match asked.kind.as_str() {
            "range" => ResidualKind::Range,
            "plane" => ResidualKind::Plane,
            _ => return Err(wrong("kind: range or plane")),
        };
        let [first_only, all] = self.casters;
        let (caster, hit) = match asked.surfel.as_str() {
            "first" => (first_only, Hit::First),
            "nearest" => (all, Hit::Nearest),
            "independent" => (all, Hit::Independent),
            _ => return Err(wrong("surfel: first, nearest or independent")),
        };
        let ends =
            asked.ends.as_slice()?.iter().map(|&end| usize::try_from(end)).collect::<Result<Vec<_>, _>>();
        let world_from_own = |pose: Isometry3<f64>| self.world_from_own * pose;
        let world_from_body: Vec<_> = isometries(&asked.poses)?.into_iter().map(world_from_own).collect();
        let extrinsic = isometries(&asked.extrinsic)?;
        let scans = PosedScans {
            points: match &asked.points {
                PointRows::Single(points) => Points::Single(points.as_slice()?.as_chunks().0),
                PointRows::Double(points) => Points::Double(points.as_slice()?.as_chunks().0),
            },
            ends: &ends.map_err(|_| wrong("ends are counts"))?,
            world_from_body: &world_from_body,
            body_from_sensor: *extrinsic.first().ok_or_else(|| wrong("an extrinsic is needed"))?,
            twists_in_body: asked.twists.as_ref().map(rows).transpose()?,
            times_s: asked.times.as_ref().map(PyReadonlyArray1::as_slice).transpose()?,
            later_s: asked.later,
            scale: asked.scale,
            segments: asked.segments.as_ref().map(PyReadonlyArray1::as_slice).transpose()?,
        };
        let count = scans.points.len();
        let jacobian = filled.jacobian.as_mut().map(PyReadwriteArray2::as_slice_mut).transpose()?;
        let mut whole = Chunk {
            start: 0,
            predicted_m: filled.predicted.as_slice_mut()?,
            residual_m: filled.residual.as_slice_mut()?,
            jacobian: jacobian.map(|numbers| numbers.as_chunks_mut().0),
            planes: filled.planes.as_slice_mut()?.as_chunks_mut().0,
            state: filled.state.as_slice_mut()?,
        };
        if !scans.is_whole() || !whole.is_of(count) {
            return Err(wrong("there must be as many of each as there are returns, or scans"));
        }
        let (settings, is_held) = (HoldSettings { hit, probe_m: asked.probe }, asked.is_held);
        let own_from_world = self.world_from_own.inverse();
        let chunks = std::iter::from_fn(|| whole.take_first(CHUNK));
        in_chunks(py, (asked.threads, count), chunks, |mut chunk, buffers: &mut Buffers| {
            if !is_held {
                chunk.hold(caster, &scans, settings, &own_from_world, buffers)?;
            }
            chunk.fill(&scans, kind, &self.world_from_own);
            Ok(())
        })
    }
}

impl Chunk<'_> {
    fn is_of(&self, count: usize) -> bool {
        let jacobian = self.jacobian.as_ref().map_or(count, |rows| rows.len());
        [self.predicted_m.len(), self.residual_m.len(), jacobian, self.planes.len(), self.state.len()]
            == [count; 5]
    }

    /// Its first rows, which leave it.
    fn take_first(&mut self, most: usize) -> Option<Self> {
        let count = most.min(self.state.len());
        let start = self.start;
        self.start += count;
        (count > 0).then(|| Chunk {
            start,
            predicted_m: self.predicted_m.split_off_mut(..count).unwrap_or_default(),
            residual_m: self.residual_m.split_off_mut(..count).unwrap_or_default(),
            jacobian: self.jacobian.as_mut().map(|rows| rows.split_off_mut(..count).unwrap_or_default()),
            planes: self.planes.split_off_mut(..count).unwrap_or_default(),
            state: self.state.split_off_mut(..count).unwrap_or_default(),
        })
    }

    /// Writes planes and states.
    fn hold(
        &mut self,
        caster: &Caster<Store>,
        scans: &PosedScans<'_>,
        settings: HoldSettings,
        own_from_world: &Isometry3<f64>,
        buffers: &mut Buffers,
    ) -> Result<(), MapError> {
        let Buffers { held, of_caster } = buffers;
        let returns = self.start..self.start + self.state.len();
        caster.hold(scans, returns, settings, held, of_caster)?;
        for ((held, numbers), state) in held.iter().zip(&mut *self.planes).zip(&mut *self.state) {
            (*numbers, *state) = match *held {
                Held::Surfel { plane: Plane { mean_m, normal }, changes } => {
                    let mean_m = own_from_world * Point3::from(mean_m);
                    let n = own_from_world.rotation * normal;
                    let state = if changes { state::CHANGES } else { state::HELD };
                    ([mean_m.x, mean_m.y, mean_m.z, n.x, n.y, n.z], state)
                }
                Held::Other => ([f64::NAN; OF_PLANE], state::OTHER),
                Held::Miss => ([f64::NAN; OF_PLANE], state::MISS),
            };
        }
        Ok(())
    }

    /// Writes predictions, residuals and derivatives; NaN where no plane is held, or a ray runs along it.
    fn fill(&mut self, scans: &PosedScans<'_>, kind: ResidualKind, world_from_own: &Isometry3<f64>) {
        let returns = self.start..self.start + self.state.len();
        let mut row = 0;
        scans.each(returns, |_, posed| {
            let [x, y, z, i, j, k] = self.planes[row];
            let plane = Plane {
                mean_m: (world_from_own * Point3::new(x, y, z)).coords,
                normal: world_from_own.rotation * Vector3::new(i, j, k),
            };
            let found = posed.against(kind, &plane);
            let (predicted_m, residual_m) =
                found.map_or((f64::NAN, f64::NAN), |(m, found)| (m, found.residual_m));
            (self.predicted_m[row], self.residual_m[row]) = (predicted_m, residual_m);
            if let Some(jacobian) = &mut self.jacobian {
                jacobian[row] = found.map_or([f64::NAN; COLUMNS], |(_, gradient)| scans.row(&gradient));
            }
            row += 1;
        });
    }
}

fn rows<'a, const N: usize>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [[f64; N]]> {
    if array.shape()[1] != N {
        return Err(PyValueError::new_err(format!("{N} numbers a row are needed")));
    }
    Ok(array.as_slice()?.as_chunks().0)
}

/// K × 4 × 4 matrices as motions.
fn isometries(matrices: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<Isometry3<f64>>> {
    if matrices.shape()[1..] != [4, 4] {
        return Err(PyValueError::new_err("poses are K × 4 × 4"));
    }
    let numbers: &[[f64; 16]] = matrices.as_slice()?.as_chunks().0;
    numbers
        .iter()
        .enumerate()
        .map(|(number, [a, b, c, x, d, e, f, y, g, h, i, z, ..])| {
            let rotation = nearest_rotation(Matrix3::new(*a, *b, *c, *d, *e, *f, *g, *h, *i));
            let why = |error: RotationError| PyValueError::new_err(format!("pose {number}: {error}"));
            Ok(Isometry3::from_parts(Translation3::new(*x, *y, *z), rotation.map_err(why)?))
        })
        .collect()
}
