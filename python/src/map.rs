//! Maps: their surfels as arrays, rays cast into them, and residuals of scans.

use std::path::PathBuf;
use std::sync::Arc;

use dmp_cast::{CastSettings, Caster, TileCache, Wanted};
use dmp_map::{MapError, Store, TileId};
use dmp_sensor::Isometry3;
use numpy::ndarray::Array2;
use numpy::{
    IntoPyArray as _, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1, PyReadwriteArray2,
    PyUntypedArrayMethods as _,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::cast::{Buffers, Casting, Found, Rays};
use crate::chunks::{CHUNK, in_chunks};
use crate::errors::input;
use crate::residuals::{Filled, Frame, Request};

/// Centres and normals of surfels.
type Surfels<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f32>>);
/// The same before conversion to arrays.
type CentresAndNormals = (Vec<[f64; 3]>, Vec<[f32; 3]>);
/// Arrays for the first crossing of each ray and, if requested, for the nearest one, the first independent one, and the
/// normal of the first.
type Crossings<'py> = (
    PyReadwriteArray1<'py, f64>,
    Option<PyReadwriteArray1<'py, f64>>,
    Option<PyReadwriteArray1<'py, f64>>,
    Option<PyReadwriteArray2<'py, f32>>,
);

/// A map on disk. Positions and directions are in the frame of the run's trajectory.
#[pyclass(module = "dmp_slam._core", frozen)]
pub(crate) struct Map {
    caster: Caster<Store>,
    first_only: Caster<Store>,
    world_from_own: Isometry3<f64>,
}

#[pymethods]
impl Map {
    #[new]
    fn open(py: Python<'_>, path: PathBuf, memory_bytes: usize) -> PyResult<Self> {
        let open = || Store::open(&path).map_err(|error| input(py, &error));
        let (store, again) = (open()?, open()?);
        let tiles = Arc::new(TileCache::new(memory_bytes));
        let world_from_own = store.own_from_world().inverse();
        let first_only = CastSettings { wanted: Wanted::First, ..CastSettings::default() };
        Ok(Self {
            caster: Caster::sharing(store, CastSettings::default(), &tiles, 0),
            // The same map, so the tiles are shared.
            first_only: Caster::sharing(again, first_only, &tiles, 0),
            world_from_own,
        })
    }

    /// Number of surfels.
    fn __len__(&self) -> usize {
        self.caster.map().surfels() as usize
    }

    /// Edge of the voxels, metres.
    #[getter]
    fn voxel_m(&self) -> f64 {
        self.caster.map().lattice().voxel_m()
    }

    /// The description of the map's origin.
    #[getter]
    fn origin(&self) -> String {
        self.caster.map().origin().text.clone()
    }

    /// Centres (N × 3, metres) and normals (N × 3) of all surfels, tile by tile.
    fn surfels<'py>(&self, py: Python<'py>) -> PyResult<Surfels<'py>> {
        let read = py.detach(|| self.read()).map_err(|error| input(py, &error))?;
        let (centres, normals) = read;
        let arrays = array(centres).and_then(|centres| Ok((centres, array(normals)?)));
        let (centres, normals) = arrays.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((centres.into_pyarray(py), normals.into_pyarray(py)))
    }

    /// Casts rays from origins along directions (N × 3 each) and fills `found` with ranges in metres, NaN for a miss.
    /// `threads` defaults to the number of cores.
    #[pyo3(signature = (origins, directions, ranges, segments, threads, found))]
    #[expect(clippy::too_many_arguments, reason = "they are those of Python")]
    fn cast<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        ranges: Option<PyReadonlyArray1<'py, f64>>,
        segments: Option<PyReadonlyArray1<'py, i32>>,
        threads: Option<usize>,
        found: Crossings<'py>,
    ) -> PyResult<()> {
        let rays = Rays {
            origins: rows(&origins)?,
            directions: rows(&directions)?,
            measured_m: ranges.as_ref().map(PyReadonlyArray1::as_slice).transpose()?,
            segments: segments.as_ref().map(PyReadonlyArray1::as_slice).transpose()?,
            world_from_own: self.world_from_own,
        };
        let (mut first, mut nearest, mut independent, mut normals) = found;
        let found = Found {
            first_m: first.as_slice_mut()?,
            nearest_m: nearest.as_mut().map(PyReadwriteArray1::as_slice_mut).transpose()?,
            independent_m: independent.as_mut().map(PyReadwriteArray1::as_slice_mut).transpose()?,
            normals: normals
                .as_mut()
                .map(PyReadwriteArray2::as_slice_mut)
                .transpose()?
                .map(|normals| normals.as_chunks_mut().0),
        };
        let count = rays.count().filter(|&count| found.is_of(count));
        let count =
            count.ok_or_else(|| PyValueError::new_err("there must be as many of each as there are rays"))?;
        let caster = if rays.measured_m.is_some() { &self.caster } else { &self.first_only };
        let casting = Casting { caster, rays, own_from_world: *self.caster.map().own_from_world() };
        in_chunks(py, (threads, count), found.chunks(CHUNK), |chunk, buffers: &mut Buffers| {
            casting.cast(chunk, buffers)
        })
    }

    /// Fills arrays with the residuals of scans, and their derivatives.
    fn residuals(&self, py: Python<'_>, asked: Request<'_>, mut filled: Filled<'_>) -> PyResult<()> {
        let casters = [&self.first_only, &self.caster];
        Frame { casters, world_from_own: self.world_from_own }.fill(py, &asked, &mut filled)
    }
}

impl Map {
    fn read(&self) -> Result<CentresAndNormals, MapError> {
        let map = self.caster.map();
        let mut tiles: Vec<TileId> = map.entries().map(|entry| entry.tile).collect();
        tiles.sort_unstable();
        let (mut centres, mut normals) =
            (Vec::with_capacity(self.__len__()), Vec::with_capacity(self.__len__()));
        for tile in tiles {
            for disc in map.discs_in_own(tile)? {
                centres.push(disc.centre_in_own_m);
                normals.push(disc.normal_in_own);
            }
        }
        Ok((centres, normals))
    }
}

fn array<T: Clone>(rows: Vec<[T; 3]>) -> Result<Array2<T>, numpy::ndarray::ShapeError> {
    Array2::from_shape_vec((rows.len(), 3), rows.into_flattened())
}

/// The rows of an N × 3 array in C order.
fn rows<'a>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [[f64; 3]]> {
    if array.shape()[1] != 3 {
        return Err(PyValueError::new_err("rays must be N × 3"));
    }
    Ok(array.as_slice()?.as_chunks().0)
}
