//! Makes maps without scores: of runs and of clouds.

use std::path::Path;
use std::sync::Arc;

use dmp_disk::WorkFolder;
use dmp_log::ScanLog;
use dmp_map::{Lattice, MapFuser, Origin, Store};
use dmp_reduce::Scales;
use dmp_runs::{Config, EvaluateError, Run, Watch, pool};
use dmp_sensor::Isometry3;

use crate::means::Work;
use crate::passes::{Finished, Life, Task, finish, fuse_given, sparse};

/// The maps of some runs, on disk as long as this value lives.
#[derive(Debug)]
pub struct RunMaps {
    maps: Vec<(String, Store)>,
    /// Owns the files of the stores.
    _work: Arc<Work>,
}

impl RunMaps {
    /// Every run's name and map, in the order given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Store)> {
        self.maps.iter().map(|(name, map)| (name.as_str(), map))
    }
}

/// Fuses the maps of `runs` from `log` as [`evaluate`](crate::evaluate) does, without scoring: they are the
/// maps that would be scored. Scans without a pose in any of the runs are excluded from all.
///
/// # Errors
/// As [`evaluate`](crate::evaluate), which also writes and resumes checkpoints in the same way.
pub fn fuse_maps<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<RunMaps, EvaluateError> {
    Task::open(log, runs, config, watch.into())?.keeping(|task| {
        let planned = task.plan(runs)?;
        planned.foresee_disk(&planned.sound()?)?;
        let fused = planned.fuse()?.without_trails()?;
        let maps = fused.runs.into_iter().map(|run| (run.run.name.clone(), run.map.store)).collect();
        Ok(RunMaps { maps, _work: fused.work })
    })
}

/// A map made of a cloud or a mesh.
#[derive(Debug)]
pub struct CloudMap {
    /// The map, at the requested path.
    pub store: Store,
    /// Occupied voxels without a surfel.
    pub thin_voxels: u64,
    /// Points, or triangles, that are not finite.
    pub points_dropped: u64,
    /// Conversions made, in words.
    pub notes: Vec<String>,
}

impl CloudMap {
    /// A warning if the points span a surface in too few of their voxels.
    pub fn sparse(&self) -> Option<String> {
        sparse(&self.store, self.thin_voxels)
    }
}

/// Makes a map of a cloud or a mesh and writes it to `output`, as [`evaluate`](crate::evaluate) does with a
/// given one.
///
/// # Errors
/// When the file cannot be read or the map cannot be written; `output` then is unchanged.
pub fn map_of_cloud<'a>(
    cloud: &Path,
    output: &Path,
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<CloudMap, EvaluateError> {
    let progress = watch.into().progress;
    // A cloud does not name its sensor: a drive is assumed.
    config.check()?;
    let any_range = Config { min_range_m: None, max_range_m: None, ..config.clone() };
    let (settings, means) = any_range.on_scales(Scales::Drive)?;
    let pool = pool(means.threads)?;
    let work = WorkFolder::new(&means.work_folder)?;
    let voxel_m = settings.voxel_m.unwrap_or(settings.scales.lengths().cloud_voxel_m);
    let lattice = Lattice::new(voxel_m)?;
    let fuser = MapFuser::new(lattice, means.cloud_map_bytes(), work.path())?;
    let name = cloud.display().to_string();
    let file = cloud.file_name().unwrap_or_default().to_string_lossy();
    let text = format!("dmp {}; fused from {file}", env!("CARGO_PKG_VERSION"));
    let (found, finished) = pool.install(|| {
        let into = (&fuser, &Isometry3::identity());
        let found = fuse_given(cloud, &name, settings.map_unit, into, progress)?;
        let finished = finish(fuser, output, &Origin::of(text), (Life::User, 0), progress)?;
        Ok::<_, EvaluateError>((found, finished))
    })?;
    let Finished { store, thin_voxels, .. } = finished;
    Ok(CloudMap { store, thin_voxels, points_dropped: found.dropped, notes: found.notes })
}
