use std::path::Path;

use dmp_log::{ScanLog, read_cloud};
use dmp_map::{Durability, FuseScratch, Lattice, MapFuser, Store, WorkFolder};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Worker, each_frame};
use crate::memory;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::watch::{Stage, Watch};

/// Share of the memory that the maps under construction may take.
const FUSE_SHARE: f64 = 0.5;

/// Every run's map, ready to be cast into.
#[derive(Debug)]
pub(crate) struct Maps {
    pub(crate) of_runs: Vec<RunMap>,
    /// Where the returns went; `None` when no map had to be fused.
    pub(crate) counts: Option<ReturnCounts>,
    pub(crate) scratch_bytes: u64,
    /// Holds the stores; goes with them.
    _work: WorkFolder,
}

/// The map of one run.
#[derive(Debug)]
pub(crate) struct RunMap {
    pub(crate) store: Store,
    /// Whether its surfels know the segments they were seen in.
    pub(crate) fused: bool,
    /// Occupied voxels without a surfel; `None` for a store that was given.
    pub(crate) thin_voxels: Option<u64>,
    /// Points of a given cloud that are not finite.
    pub(crate) points_dropped: u64,
}

/// Opens the stores among the given maps; `None` for the other runs.
///
/// Before anything else, so that stores with other voxels are refused before a long log is read.
pub(crate) fn given_stores(runs: &[Run]) -> Result<Vec<Option<Store>>, EvaluateError> {
    let open = |run: &Run| match &run.map {
        MapSource::Given(path) if is_store(path) => {
            Store::open(path).map(Some).map_err(EvaluateError::map_of(&run.name))
        }
        _ => Ok(None),
    };
    runs.iter().map(open).collect()
}

/// The voxel edge that the given stores have, metres; `None` where none is given.
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
        && Lattice::new(asked_m).map_err(EvaluateError::Work)?.voxel_m() != given_m
    {
        return Err(EvaluateError::Setting {
            setting: "voxel",
            value: format!("{asked_m} m"),
            why: "a given map has voxels of another edge; leave --voxel out to take that",
        });
    }
    Ok(given.map(|(_, voxel_m)| voxel_m))
}

/// Fuses the maps that are not given, all in one pass over the log, and opens those that are.
pub(crate) fn maps_of(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    stores: Vec<Option<Store>>,
    config: &Config,
    watch: &dyn Watch,
) -> Result<Maps, EvaluateError> {
    let work = WorkFolder::new(&config.work_folder).map_err(EvaluateError::Work)?;
    let lattice = Lattice::new(plan.voxel.voxel_m).map_err(EvaluateError::Work)?;
    let to_fuse = runs.iter().filter(|run| run.map == MapSource::Fused).count().max(1);
    let budget_bytes = (FUSE_SHARE * config.memory_bytes as f64) as usize / to_fuse;
    let new_fuser = |run: &Run| {
        MapFuser::new(lattice, budget_bytes, work.path()).map_err(EvaluateError::map_of(&run.name))
    };

    let fusers = runs
        .iter()
        .map(|run| (run.map == MapSource::Fused).then(|| new_fuser(run)).transpose())
        .collect::<Result<Vec<_>, _>>()?;
    let counts = if fusers.iter().any(Option::is_some) {
        Some(fuse_scans(log, plan, runs, config, &fusers, watch)?)
    } else {
        None
    };

    let mut scratch_bytes = 0;
    let mut maps = Vec::new();
    for ((run, fuser), store) in runs.iter().zip(fusers).zip(stores) {
        let map_error = EvaluateError::map_of(&run.name);
        let file_name = format!("{}.dmpmap", file_stem(runs, run));
        let (path, durability) = match &config.save_maps {
            Some(folder) => (folder.join(file_name), Durability::Durable),
            None => (work.file(&file_name), Durability::Scratch),
        };
        maps.push(match (fuser, store, &run.map) {
            (Some(fuser), ..) => {
                scratch_bytes += fuser.scratch_bytes();
                let (store, thin_voxels) =
                    finish(fuser, &path, &provenance(log, run, plan), durability, watch)
                        .map_err(map_error)?;
                RunMap { store, fused: true, thin_voxels: Some(thin_voxels), points_dropped: 0 }
            }
            (None, Some(store), _) => RunMap { store, fused: false, thin_voxels: None, points_dropped: 0 },
            (None, None, MapSource::Given(given)) => {
                let fuser = new_fuser(run)?;
                let points_dropped = fuse_cloud(given, &run.name, &fuser, watch)?;
                let text = format!("fused from {}", given.display());
                let path = work.file(&format!("given-{}.dmpmap", file_stem(runs, run)));
                let (store, thin_voxels) =
                    finish(fuser, &path, &text, Durability::Scratch, watch).map_err(map_error)?;
                RunMap { store, fused: false, thin_voxels: Some(thin_voxels), points_dropped }
            }
            (None, None, MapSource::Fused) => continue,
        });
        memory::look();
    }
    Ok(Maps { of_runs: maps, counts, scratch_bytes, _work: work })
}

fn finish(
    fuser: MapFuser,
    path: &Path,
    provenance: &str,
    durability: Durability,
    watch: &dyn Watch,
) -> Result<(Store, u64), dmp_map::MapError> {
    let done = std::sync::atomic::AtomicU64::new(0);
    let summary = fuser.finish(path, provenance, durability, &|tiles, total| {
        let before = done.swap(tiles, std::sync::atomic::Ordering::Relaxed);
        if before == 0 {
            watch.begin(Stage::Surfels, total);
        }
        watch.advance(tiles - before);
    })?;
    let store = match durability {
        Durability::Durable => Store::open(&summary.path)?,
        Durability::Scratch => Store::open_once(&summary.path)?,
    };
    Ok((store, summary.thin_voxels))
}

fn provenance(log: &dyn ScanLog, run: &Run, plan: &Plan<'_>) -> String {
    let summary = log.summary();
    format!(
        "dmp {}; log {} ({}); run {}; {} scans, {} segments",
        env!("CARGO_PKG_VERSION"),
        summary.path.display(),
        summary.fingerprint,
        run.name,
        plan.frames().len(),
        plan.segments.starts.len()
    )
}

/// A run's name as a file name: what file systems or shells take amiss becomes `_`, and where that makes
/// two runs alike, they get their numbers.
fn file_stem(runs: &[Run], run: &Run) -> String {
    let harmless = |run: &Run| -> String {
        run.name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
    };
    let stem = harmless(run);
    let alike: Vec<&Run> = runs.iter().filter(|other| harmless(other).eq_ignore_ascii_case(&stem)).collect();
    match alike.iter().position(|other| other.name == run.name) {
        Some(number) if alike.len() > 1 => format!("{stem}-{}", number + 1),
        _ => stem,
    }
}

fn is_store(path: &Path) -> bool {
    // Whatever is wrong with the file is better said by the one that reads it as a whole.
    !matches!(Store::open(path), Err(dmp_map::MapError::NotAStore { .. } | dmp_map::MapError::Io { .. }))
}

/// Fuses a cloud, whose points know no segment. Answers how many points were not finite.
fn fuse_cloud(path: &Path, run: &str, fuser: &MapFuser, watch: &dyn Watch) -> Result<u64, EvaluateError> {
    let mut buffers = FuseScratch::default();
    let mut finite = Vec::new();
    let mut dropped = 0;
    watch.begin(Stage::ReadMap, 0);
    read_cloud(path, |batch| {
        finite.clear();
        finite.extend(batch.iter().filter(|point| point.iter().all(|c| c.is_finite())));
        dropped += (batch.len() - finite.len()) as u64;
        watch.advance(batch.len() as u64);
        if watch.cancelled() {
            return Err(EvaluateError::Cancelled);
        }
        fuser.add(&finite, None, &mut buffers).map_err(EvaluateError::map_of(run))
    })?;
    Ok(dropped)
}

struct FuseWorker<'a> {
    poser: Poser<'a>,
    runs: &'a [Run],
    fusers: &'a [Option<MapFuser>],
    watch: &'a dyn Watch,
    buffers: FuseScratch,
    points: Vec<[f64; 3]>,
    counts: ReturnCounts,
}

impl Worker for FuseWorker<'_> {
    fn frame(&mut self, _: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, runs, fusers, buffers, points, .. } = self;
        let counts = poser.blocks(frame, scan, |rays| {
            for ((fuser, rays), run) in fusers.iter().zip(rays).zip(*runs) {
                if let Some(fuser) = fuser {
                    points.clear();
                    points.extend(rays.iter().map(Ray::endpoint_in_world));
                    fuser
                        .add(points, Some(frame.segment), buffers)
                        .map_err(EvaluateError::map_of(&run.name))?;
                }
            }
            Ok::<(), EvaluateError>(())
        })?;
        self.counts.merge(&counts);
        self.watch.advance(counts.total());
        Ok(())
    }
}

fn fuse_scans(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    config: &Config,
    fusers: &[Option<MapFuser>],
    watch: &dyn Watch,
) -> Result<ReturnCounts, EvaluateError> {
    watch.begin(Stage::Fuse, plan.returns());
    let worker = |_| FuseWorker {
        poser: Poser::new(&plan.poses, &plan.filter),
        runs,
        fusers,
        watch,
        buffers: FuseScratch::default(),
        points: Vec::new(),
        counts: ReturnCounts::default(),
    };
    let workers = (0..config.threads).map(worker).collect();
    let mut counts = ReturnCounts::default();
    for worker in each_frame(log, plan.frames(), config.order, watch, workers)? {
        counts.merge(&worker.counts);
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::{Isometry3, Trajectory};

    #[test]
    fn every_run_has_a_file_of_its_own() {
        let still = Trajectory::unstamped(vec![Isometry3::identity()]).unwrap();
        let runs = ["a/x", "a_x", "A_X", "b ü"].map(|name| Run::new(name, still.clone()));
        let stems: Vec<String> = runs.iter().map(|run| file_stem(&runs, run)).collect();
        assert_eq!(stems, ["a_x-1", "a_x-2", "A_X-3", "b_ü"]);
    }
}
