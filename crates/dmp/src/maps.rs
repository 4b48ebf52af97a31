use std::path::Path;

use dmp_log::ScanLog;
use dmp_map::{Lattice, MapFuser, Origin, Store, WorkFolder};
use dmp_sensor::Isometry3;

use crate::checkpoint::Work;
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::own_frame::Placed;
use crate::plan::{Heads, Plan};
use crate::watch::Watch;
use crate::{fuse, given, trails};

/// The maps of some runs, on disk as long as this lives.
#[derive(Debug)]
pub struct RunMaps {
    names: Vec<String>,
    maps: fuse::Maps,
    /// Holds the stores; goes with them.
    _work: Work,
}

impl RunMaps {
    /// Every run's name and map, in the order given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Store)> {
        self.names.iter().map(String::as_str).zip(self.maps.of_runs.iter().map(|map| &map.store))
    }
}

/// Fuses the maps of `runs` from `log`, as [`evaluate`](crate::evaluate) does, and scores nothing: the
/// maps that its scores would speak of. Scans without a pose in any of the runs are left out of all.
///
/// # Errors
/// As [`evaluate`](crate::evaluate), which also keeps and takes up what was done in the same way.
pub fn fuse_maps(
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    watch: &dyn Watch,
) -> Result<RunMaps, EvaluateError> {
    let config = &config.settled(log.summary());
    config.check()?;
    given::check_free_space(runs, config)?;
    let work = Work::open(log, runs, config)?;
    let (maps, work) = work.within(watch, |work| fuse_in(work, log, runs, config, watch))?;
    Ok(RunMaps { names: runs.iter().map(|run| run.name.clone()).collect(), maps, _work: work })
}

fn fuse_in(
    work: &Work,
    log: &dyn ScanLog,
    runs: &[Run],
    config: &Config,
    watch: &dyn Watch,
) -> Result<fuse::Maps, EvaluateError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(config.threads).build();
    let pool = pool.map_err(|source| EvaluateError::Threads { threads: config.threads, source })?;
    let stores = given::given_stores(runs)?;
    let voxel_m = given::voxel_of_stores(runs, &stores, config.voxel_m)?.or(config.voxel_m);
    let placed = Placed::new(Heads::Log(log), runs, &stores, config)?;
    let runs = placed.runs.as_slice();
    let plan = Plan::new(log, runs, &placed.own_from_world, &Config { voxel_m, ..config.clone() }, watch)?;
    work.look_for_room(log, &plan, runs, config, watch)?;
    let maps = pool.install(|| fuse::maps_of(log, &plan, runs, stores, None, config, work, watch))?;
    if !config.free_space {
        return Ok(maps);
    }
    fuse::keep_if_due(work, &maps)?;
    pool.install(|| trails::keep_out(log, &plan, runs, maps, config, work, watch))
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

/// Makes a map of a cloud or a mesh and writes it to `output`, as [`evaluate`](crate::evaluate) does with one that is
/// given.
///
/// # Errors
/// When the file cannot be read or the map cannot be written; then there is none at `output`, or the one that was.
pub fn map_of_cloud(
    cloud: &Path,
    output: &Path,
    config: &Config,
    watch: &dyn Watch,
) -> Result<CloudMap, EvaluateError> {
    config.check()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(config.threads).build();
    let pool = pool.map_err(|source| EvaluateError::Threads { threads: config.threads, source })?;
    let work = WorkFolder::new(&config.work_folder).map_err(EvaluateError::Work)?;
    let usual_m = config.scales().lengths().cloud_voxel_m;
    let lattice = Lattice::new(config.voxel_m.unwrap_or(usual_m)).map_err(EvaluateError::Work)?;
    let budget_bytes = config.memory_bytes / 2;
    let fuser = MapFuser::new(lattice, budget_bytes, work.path()).map_err(EvaluateError::Work)?;
    let name = output.display().to_string();
    let found = given::fuse_given(cloud, &name, config.map_unit, &fuser, &Isometry3::identity(), watch)?;
    let text = format!("dmp {}; fused from {}", env!("CARGO_PKG_VERSION"), cloud.display());
    let finished = pool.install(|| fuse::finish(fuser, output, &Origin::of(text), fuse::Life::User, watch));
    let (store, thin_voxels) = finished.map_err(EvaluateError::Work)?;
    Ok(CloudMap { store, thin_voxels, points_dropped: found.dropped, notes: found.notes })
}
