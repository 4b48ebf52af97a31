//! Maps given by the user: stores, clouds and meshes.

use dmp_lengths::thousands;
use std::io::ErrorKind;
use std::path::Path;

use dmp_disk::DiskError;
use dmp_log::{LengthUnit, NO_CHECKSUMS, is_mesh, read_cloud, read_mesh};
use dmp_map::{FuseBuffers, Lattice, MapError, MapFuser, Store, TriangleSampler};
use dmp_runs::{EvaluateError, MapSource, Progress, Remedy, Run, SettingName, Stage, as_asked_m, in_voxels};
use dmp_sensor::{Isometry3, Point3};

/// Samples of a mesh per voxel edge: 25 on a filled voxel face, where three make a surfel.
const SAMPLES_PER_VOXEL: f64 = 5.0;
/// Most samples of a mesh: 16 km² at voxels of 0.2 m.
const MAX_SAMPLES: u64 = 10_000_000_000;
/// Samples fused at once.
const BATCH: usize = 65_536;

/// Opens the stores among the given maps; `None` for the other runs.
///
/// Comes first, so that stores with other voxels are rejected before a long log is read.
pub(crate) fn given_stores(runs: &[Run]) -> Result<Vec<Option<Store>>, EvaluateError> {
    let open = |run: &Run| match &run.map {
        MapSource::Given(path) => {
            let store = store_at(path).map_err(EvaluateError::map_of(&run.name))?;
            store.iter().try_for_each(|store| EvaluateError::if_empty(path, store, None, 0))?;
            Ok(store)
        }
        MapSource::Fused => Ok(None),
    };
    runs.iter().map(open).collect()
}

/// The common voxel edge of the given stores, metres; `None` without stores.
pub(crate) fn voxel_of_stores(
    runs: &[Run],
    stores: &[Option<Store>],
    asked_m: Option<f64>,
) -> Result<Option<f64>, EvaluateError> {
    let mut given: Option<(&Run, f64)> = None;
    for (run, store) in runs.iter().zip(stores) {
        let Some(store) = store else { continue };
        let voxel_m = store.lattice().voxel_m();
        match given {
            Some((other, other_m)) if other_m != voxel_m => {
                return Err(EvaluateError::DifferentVoxels {
                    a: other.name.clone(),
                    b: run.name.clone(),
                    a_m: other_m,
                    b_m: voxel_m,
                });
            }
            _ => given = Some((run, voxel_m)),
        }
    }
    if let (Some((_, given_m)), Some(asked_m)) = (given, asked_m)
        && Lattice::new(asked_m)?.voxel_m() != given_m
    {
        return Err(EvaluateError::Setting {
            setting: SettingName::Voxel,
            value: format!("{asked_m} m"),
            why: "a given map has another voxel edge",
            remedy: Some(Remedy::VoxelOfMap),
        });
    }
    Ok(given.map(|(_, voxel_m)| voxel_m))
}

/// The store at a path, if it is one.
fn store_at(path: &Path) -> Result<Option<Store>, MapError> {
    match Store::open(path) {
        Ok(store) => Ok(Some(store)),
        Err(MapError::NotAStore { .. }) => Ok(None),
        // For a missing file or a folder, the reader of clouds has the better error.
        Err(MapError::Disk(DiskError::Io { source, .. }))
            if matches!(source.kind(), ErrorKind::NotFound | ErrorKind::IsADirectory) =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// The result of reading a given cloud or mesh.
#[derive(Debug, Default)]
pub(crate) struct GivenMap {
    /// Points or triangles that are not finite.
    pub(crate) dropped: u64,
    /// Conversions made, in words.
    pub(crate) notes: Vec<String>,
}

/// Fuses a cloud or a mesh `into` a map, after transforming it into the map's world (`world_from_own`). Its
/// points have no segment.
pub(crate) fn fuse_given(
    path: &Path,
    run: &str,
    unit: Option<LengthUnit>,
    into: (&MapFuser, &Isometry3<f64>),
    progress: &dyn Progress,
) -> Result<GivenMap, EvaluateError> {
    progress.begin(Stage::ReadMap, 0);
    let (fuser, world_from_own) = into;
    let buffers = FuseBuffers::default();
    let mut points = Points { fuser, world_from_own, run, progress, buffers, batch: Vec::new() };
    let mut given = if is_mesh(path)? {
        fuse_mesh(path, unit, &mut points)?
    } else {
        fuse_cloud(path, unit, &mut points)?
    };
    if let Some(unit) = unit {
        given.notes.push(format!("in {}, as --map-unit says: brought to metres", unit.name()));
    }
    given.notes.push(NO_CHECKSUMS.to_owned());
    for note in &given.notes {
        progress.note(&format!("map of `{run}`: {note}").into());
    }
    Ok(given)
}

/// Collects finite points for a map.
struct Points<'a> {
    fuser: &'a MapFuser,
    world_from_own: &'a Isometry3<f64>,
    run: &'a str,
    progress: &'a dyn Progress,
    buffers: FuseBuffers,
    batch: Vec<[f64; 3]>,
}

impl Points<'_> {
    /// Fuses the collected points.
    fn flush(&mut self) -> Result<(), EvaluateError> {
        self.progress.advance(self.batch.len() as u64);
        if self.progress.cancelled() {
            return Err(EvaluateError::Cancelled);
        }
        for point in &mut self.batch {
            *point = (self.world_from_own * Point3::from(*point)).into();
        }
        let added = self.fuser.add(&self.batch, None, &mut self.buffers);
        self.batch.clear();
        added.map_err(EvaluateError::map_of(self.run))
    }
}

fn fuse_cloud(
    path: &Path,
    unit: Option<LengthUnit>,
    points: &mut Points<'_>,
) -> Result<GivenMap, EvaluateError> {
    let mut dropped = 0;
    let summary = read_cloud(path, unit, |batch| {
        points.batch.extend(batch.iter().filter(|point| point.iter().all(|c| c.is_finite())));
        dropped += (batch.len() - points.batch.len()) as u64;
        points.flush()
    })?;
    Ok(GivenMap { dropped, notes: summary.unit_note.into_iter().collect() })
}

/// Samples a mesh so densely that each voxel it passes through gets a surfel; `docs/formats.md` explains why
/// the mesh itself is not cast. Large triangles are sampled in several batches.
fn fuse_mesh(
    path: &Path,
    unit: Option<LengthUnit>,
    points: &mut Points<'_>,
) -> Result<GivenMap, EvaluateError> {
    let scale = unit.unwrap_or(LengthUnit::Metre).metres();
    let spacing_m = points.fuser.lattice().voxel_m() / SAMPLES_PER_VOXEL;
    let mut sampler = TriangleSampler::new(spacing_m, MAX_SAMPLES);
    let run = points.run;
    let mut dropped = 0;
    let summary = read_mesh(path, |batch| {
        for triangle in batch {
            if !triangle.as_flattened().iter().all(|c| c.is_finite()) {
                dropped += 1;
                continue;
            }
            let in_metres = triangle.map(|corner| corner.map(|c| c * scale));
            let sampled = sampler.sample(&in_metres, |sample| {
                points.batch.push(sample);
                if points.batch.len() < BATCH {
                    return Ok(());
                }
                points.flush().map_err(SampleError::Fuse)
            });
            sampled.map_err(|error| match error {
                SampleError::Fuse(error) => error,
                SampleError::Mesh(error) => EvaluateError::map_of(run)(error),
            })?;
        }
        points.flush()
    })?;
    let note = format!(
        "{} of {} triangles, {:.1} m², sampled each {spacing_m:.3} m",
        summary.format.name(),
        thousands(summary.triangles),
        sampler.area_m2()
    );
    Ok(GivenMap { dropped, notes: vec![note] })
}

/// Reasons to stop sampling a triangle.
enum SampleError {
    Mesh(MapError),
    Fuse(EvaluateError),
}

impl From<MapError> for SampleError {
    fn from(error: MapError) -> Self {
        Self::Mesh(error)
    }
}

/// Below this share of voxels in which they span a surface, points are too sparse for the voxel size.
const SPARSE: f64 = 0.25;

/// A warning if the points of a map with `thin_voxels` voxels without a surfel span a surface in too few of them.
pub(crate) fn sparse(map: &Store, thin_voxels: u64) -> Option<String> {
    let surfels = map.surfels();
    let voxels = surfels + thin_voxels;
    (SPARSE * voxels as f64 > surfels as f64).then(|| {
        format!(
            "its points span a surface in only {} of {} of {} m; larger voxels may help",
            thousands(surfels),
            in_voxels(voxels),
            as_asked_m(map.lattice().voxel_m())
        )
    })
}
