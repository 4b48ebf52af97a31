//! Maps: their surfels as arrays, and rays cast into them.
//!
//! Threads are those of one call. A process that forked has none of the threads of its parent: a pool that is kept, as rayon keeps
//! one, would be waited for without end.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;

use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Query, TileCache, Wanted};
use dmp_map::{MapError, Store, TileId};
use dmp_sensor::{Isometry3, Point3, Vector3};
use numpy::ndarray::Array2;
use numpy::{
    IntoPyArray as _, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods as _,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::{failed, input};

/// Rays between two looks whether somebody asks to stop.
const BLOCK: usize = 1 << 20;
/// Rays that a thread takes at a time.
const CHUNK: usize = 1 << 13;

/// Centres and normals of surfels.
type Surfels<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f32>>);
/// The same before they are arrays.
type CentresAndNormals = (Vec<[f64; 3]>, Vec<[f32; 3]>);
/// The first, the nearest and the first independent crossing of each ray.
type Crossings<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// A map on disk. Places and directions are those of the frame of the run's trajectory.
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
            // The same map, so the same tiles.
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

    /// What the map was made of.
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

    /// Casts rays from origins along directions (N × 3 each). Ranges are metres along them, NaN where nothing is met. Without a number of
    /// threads there are as many as the machine runs at once.
    #[pyo3(signature = (origins, directions, ranges, segments, threads))]
    fn cast<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        ranges: Option<PyReadonlyArray1<'py, f64>>,
        segments: Option<PyReadonlyArray1<'py, i32>>,
        threads: Option<usize>,
    ) -> PyResult<Crossings<'py>> {
        let (starts, ways) = (rows(&origins)?, rows(&directions)?);
        let measured = ranges.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
        let of_drive = segments.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
        let rays = starts.len();
        let others = [Some(ways.len()), measured.map(<[f64]>::len), of_drive.map(<[i32]>::len)];
        if others.into_iter().flatten().any(|count| count != rays) {
            return Err(PyValueError::new_err("there must be as many of each as there are rays"));
        }
        let caster = if measured.is_some() { &self.caster } else { &self.first_only };
        let query = |ray: usize| Query {
            origin_in_world_m: (self.world_from_own * Point3::from(starts[ray])).into(),
            direction_in_world: (self.world_from_own * unit(ways[ray])).into(),
            measured_m: measured.map_or(f64::INFINITY, |ranges| ranges[ray]),
            segment: of_drive.map(|segments| segments[ray]),
        };
        let mut alone = CastBuffers::default();
        let mut found = [const { Vec::new() }; 3].map(|mut list: Vec<f64>| {
            list.reserve_exact(rays);
            list
        });
        let pool = pool(threads, rays).map_err(|error| failed(py, &format_args!("no threads: {error}")))?;
        for start in (0..rays).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(rays);
            let answered = py.detach(|| match &pool {
                Some(pool) => pool.install(|| answers(caster, block, &query)),
                None => chunks(block).map(|chunk| answer(caster, chunk, &query, &mut alone)).collect(),
            });
            for answer in answered.map_err(|error| input(py, &error))?.iter().flatten() {
                let crossings = [answer.first_m, answer.nearest_m, answer.independent_m];
                found.iter_mut().zip(crossings).for_each(|(list, m)| list.push(m.unwrap_or(f64::NAN)));
            }
            py.check_signals()?;
        }
        let [first, nearest, independent] = found.map(|list| list.into_pyarray(py));
        Ok((first, nearest, independent))
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

/// The rows of an array N × 3 in the order of C.
fn rows<'a>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [[f64; 3]]> {
    if array.shape()[1] != 3 {
        return Err(PyValueError::new_err("rays must be N × 3"));
    }
    Ok(array.as_slice()?.as_chunks().0)
}

/// A direction of length one; what has no direction stays as it is, and meets nothing.
fn unit(direction: [f64; 3]) -> Vector3<f64> {
    let direction = Vector3::from(direction);
    direction.try_normalize(0.0).unwrap_or(direction)
}

/// Threads for so many rays; `None` where the calling one is enough.
fn pool(threads: Option<usize>, rays: usize) -> Result<Option<ThreadPool>, rayon::ThreadPoolBuildError> {
    let most = threads.or_else(|| thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    match most.min(rays.div_ceil(CHUNK)) {
        0 | 1 => Ok(None),
        threads => ThreadPoolBuilder::new().num_threads(threads).build().map(Some),
    }
}

fn chunks(rays: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    rays.clone().step_by(CHUNK).map(move |start| start..(start + CHUNK).min(rays.end))
}

fn answers(
    caster: &Caster<Store>,
    rays: Range<usize>,
    query: &(impl Fn(usize) -> Query + Sync),
) -> Result<Vec<Vec<Answer>>, MapError> {
    let chunks: Vec<Range<usize>> = chunks(rays).collect();
    chunks
        .into_par_iter()
        .map_init(CastBuffers::default, |buffers, chunk| answer(caster, chunk, query, buffers))
        .collect()
}

fn answer(
    caster: &Caster<Store>,
    rays: Range<usize>,
    query: &impl Fn(usize) -> Query,
    buffers: &mut CastBuffers,
) -> Result<Vec<Answer>, MapError> {
    let queries: Vec<Query> = rays.map(query).collect();
    let mut answers = Vec::new();
    caster.cast(&queries, &mut answers, buffers).map(|()| answers)
}
