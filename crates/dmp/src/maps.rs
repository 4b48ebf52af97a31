//! Maps alone: those that scores would speak of, and those of clouds.

use std::path::Path;
use std::sync::Arc;

use dmp_disk::WorkFolder;
use dmp_lengths::thousands;
use dmp_log::ScanLog;
use dmp_map::{Lattice, MapFuser, Origin, Store};
use dmp_reduce::Scales;
use dmp_sensor::Isometry3;

use crate::config::{Config, Run};
use crate::error::{EvaluateError, as_asked_m, in_voxels};
use crate::evaluation::Task;
use crate::fuse::{Life, finish};
use crate::given::fuse_given;
use crate::watch::Watch;
use crate::work::{Work, pool};

/// The maps of some runs, on disk as long as this lives.
#[derive(Debug)]
pub struct RunMaps {
    maps: Vec<(String, Store)>,
    /// Holds the stores; goes with them.
    _work: Arc<Work>,
}

impl RunMaps {
    /// Every run's name and map, in the order given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Store)> {
        self.maps.iter().map(|(name, map)| (name.as_str(), map))
    }
}

/// Fuses the maps of `runs` from `log`, as [`evaluate`](crate::evaluate) does, and scores nothing: the
/// maps that its scores would speak of. Scans without a pose in any of the runs are left out of all.
///
/// # Errors
/// As [`evaluate`](crate::evaluate), which also keeps and takes up what was done in the same way.
pub fn fuse_maps<'a>(
    log: &'a dyn ScanLog,
    runs: &'a [Run],
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<RunMaps, EvaluateError> {
    Task::open(log, runs, config, watch.into())?.keeping(|task| {
        let planned = task.plan(runs)?;
        planned.foresee_disk(&planned.sound()?)?;
        let fused = planned.fuse()?.keep_out_trails()?;
        let maps = fused.runs.into_iter().map(|run| (run.run.name.clone(), run.map.store)).collect();
        Ok(RunMaps { maps, _work: fused.work })
    })
}

/// A map that was made of a cloud or a mesh.
#[derive(Debug)]
pub struct CloudMap {
    /// The map, where it was asked for.
    pub store: Store,
    /// Occupied voxels without a surfel.
    pub thin_voxels: u64,
    /// Points, or triangles, that are not finite.
    pub points_dropped: u64,
    /// What was made of the file, in words.
    pub notes: Vec<String>,
}

/// Points that span a surface in fewer of their voxels than this share are too sparse for voxels of this size.
const SPARSE: f64 = 0.25;

impl CloudMap {
    /// Where the points span a surface in hardly any of their voxels: that, in words.
    pub fn sparse(&self) -> Option<String> {
        sparse(&self.store, self.thin_voxels)
    }
}

/// The same of a map with so many voxels without a surfel.
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

/// Makes a map of a cloud or a mesh and writes it to `output`, as [`evaluate`](crate::evaluate) does with one that is
/// given.
///
/// # Errors
/// When the file cannot be read or the map cannot be written; then there is none at `output`, or the one that was.
pub fn map_of_cloud<'a>(
    cloud: &Path,
    output: &Path,
    config: &Config,
    watch: impl Into<Watch<'a>>,
) -> Result<CloudMap, EvaluateError> {
    let progress = watch.into().progress;
    // A cloud does not say what made it: it is taken for that of a drive.
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
    let (found, (store, thin_voxels)) = pool.install(|| {
        let into = (&fuser, &Isometry3::identity());
        let found = fuse_given(cloud, &name, settings.map_unit, into, progress)?;
        let finished = finish(fuser, output, &Origin::of(text), Life::User, progress)?;
        Ok::<_, EvaluateError>((found, finished))
    })?;
    Ok(CloudMap { store, thin_voxels, points_dropped: found.dropped, notes: found.notes })
}
