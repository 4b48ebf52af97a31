use std::path::Path;

use dmp_log::ScanLog;
use dmp_map::{Durability, FuseScratch, Lattice, MapFuser, Store, WorkFolder};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Worker, each_frame};
use crate::given::fuse_given;
use crate::memory;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::trails::{TrailBuffers, TrailSummary, Trails};
use crate::watch::{Stage, Watch};

/// Share of the memory that the maps under construction may take.
const FUSE_SHARE: f64 = 0.5;

/// Every run's map, ready to be cast into.
#[derive(Debug)]
pub(crate) struct Maps {
    pub(crate) of_runs: Vec<RunMap>,
    /// Where the returns went; `None` when no map had to be fused.
    pub(crate) counts: Option<ReturnCounts>,
    /// Used returns that are in no map, for they lie on trails.
    pub(crate) left_out: u64,
    /// Where trails were looked for: what was found.
    pub(crate) trails: Option<TrailSummary>,
    pub(crate) scratch_bytes: u64,
    /// For every run, what was made of a map that was given, in words.
    pub(crate) notes: Vec<Vec<String>>,
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
    /// Points of a given cloud, or triangles of a mesh, that are not finite.
    pub(crate) points_dropped: u64,
}

/// Fuses the maps that are not given, all in one pass over the log, and opens those that are. Returns on
/// `trails` are left out of all.
pub(crate) fn maps_of(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    stores: Vec<Option<Store>>,
    trails: Option<&Trails>,
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
    let fused = if fusers.iter().any(Option::is_some) {
        Some(fuse_scans(log, plan, runs, config, &fusers, trails, watch)?)
    } else {
        None
    };
    let (counts, left_out) = fused.unzip();

    let mut scratch_bytes = 0;
    let mut maps = Vec::new();
    let mut notes = vec![Vec::new(); runs.len()];
    for (((run, fuser), store), notes) in runs.iter().zip(fusers).zip(stores).zip(&mut notes) {
        let map_error = EvaluateError::map_of(&run.name);
        let file_name = format!("{}.dmpmap", file_stem(runs, run));
        let (path, durability) = match &config.save_maps {
            // Maps that are fused once more without trails are saved then.
            Some(folder) if trails.is_some() || !config.free_space => {
                (folder.join(file_name), Durability::Durable)
            }
            _ => (work.file(&file_name), Durability::Scratch),
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
                let found = fuse_given(given, &run.name, config.map_unit, &fuser, watch)?;
                *notes = found.notes;
                let text = format!("fused from {}", given.display());
                let path = work.file(&format!("given-{}.dmpmap", file_stem(runs, run)));
                let (store, thin_voxels) =
                    finish(fuser, &path, &text, Durability::Scratch, watch).map_err(map_error)?;
                RunMap { store, fused: false, thin_voxels: Some(thin_voxels), points_dropped: found.dropped }
            }
            (None, None, MapSource::Fused) => continue,
        });
        memory::look();
    }
    let left_out = left_out.unwrap_or(0);
    Ok(Maps { of_runs: maps, counts, left_out, trails: None, scratch_bytes, notes, _work: work })
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

struct FuseWorker<'a> {
    poser: Poser<'a>,
    runs: &'a [Run],
    fusers: &'a [Option<MapFuser>],
    trails: Option<&'a Trails>,
    /// Of the returns at hand: whether they are in no map. Empty where all are.
    on_trail: Vec<bool>,
    trail_buffers: TrailBuffers,
    left_out: u64,
    watch: &'a dyn Watch,
    buffers: FuseScratch,
    points: Vec<[f64; 3]>,
    counts: ReturnCounts,
}

impl Worker for FuseWorker<'_> {
    fn frame(&mut self, _: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, runs, fusers, buffers, points, trails, on_trail, trail_buffers, left_out, .. } =
            self;
        let counts = poser.blocks(frame, scan, |rays| {
            match trails {
                Some(trails) => trails.mark(runs, rays, on_trail, trail_buffers)?,
                None => on_trail.clear(),
            }
            *left_out += on_trail.iter().filter(|&&on_trail| on_trail).count() as u64;
            for ((fuser, rays), run) in fusers.iter().zip(rays).zip(*runs) {
                if let Some(fuser) = fuser {
                    let fused = |&(k, _): &(usize, &Ray)| !on_trail.get(k).copied().unwrap_or(false);
                    points.clear();
                    points.extend(
                        rays.iter().enumerate().filter(fused).map(|(_, ray)| ray.endpoint_in_world()),
                    );
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
    trails: Option<&Trails>,
    watch: &dyn Watch,
) -> Result<(ReturnCounts, u64), EvaluateError> {
    watch.begin(Stage::Fuse, plan.returns());
    let worker = |_| FuseWorker {
        poser: Poser::new(&plan.poses, &plan.filter),
        runs,
        fusers,
        trails,
        on_trail: Vec::new(),
        trail_buffers: TrailBuffers::default(),
        left_out: 0,
        watch,
        buffers: FuseScratch::default(),
        points: Vec::new(),
        counts: ReturnCounts::default(),
    };
    let workers = (0..config.threads).map(worker).collect();
    let (mut counts, mut left_out) = (ReturnCounts::default(), 0);
    for worker in each_frame(log, plan.frames(), config.order, watch, workers)? {
        counts.merge(&worker.counts);
        left_out += worker.left_out;
    }
    Ok((counts, left_out))
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
