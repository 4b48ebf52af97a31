use std::path::{Path, PathBuf};

use dmp_log::ScanLog;
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Origin, Store};
use dmp_sensor::{Ray, ReturnCounts, Scan};

use crate::checkpoint::{Fused, FusedMap, Fusing, Round, Work};
use crate::config::{Config, MapSource, Run};
use crate::error::EvaluateError;
use crate::frames::{FrameSet, Jobs, Pauses, PlannedFrame, Worker, each_frame_in_parts, jobs_of};
use crate::given::fuse_given;
use crate::memory;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::trails::{TrailBuffers, TrailSummary, Trails};
use crate::watch::{Stage, Watch};

/// Share of the memory that the maps under construction may take.
pub(crate) const FUSE_SHARE: f64 = 0.6;

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
/// `trails` are left out of all. What an earlier process kept is taken up.
#[expect(clippy::too_many_arguments, reason = "everything there is goes into a map")]
pub(crate) fn maps_of(
    log: &dyn ScanLog,
    plan: &Plan<'_>,
    runs: &[Run],
    stores: Vec<Option<Store>>,
    trails: Option<&Trails>,
    config: &Config,
    work: &Work,
    watch: &dyn Watch,
) -> Result<Maps, EvaluateError> {
    let round = if trails.is_some() { Round::WithoutTrails } else { Round::First };
    if let Some(fused) = work.load::<Fused>(round)? {
        return reopen(fused, runs, stores);
    }
    let mut fusing = work.load::<Fusing>(round)?;
    let places = Places { runs, work, round, config };
    let lattice = Lattice::new(plan.voxel.voxel_m).map_err(EvaluateError::Work)?;
    let to_fuse = runs.iter().filter(|run| run.map == MapSource::Fused).count().max(1);
    let budget_bytes = work.budget().share(FUSE_SHARE) / to_fuse;
    let new_fuser = |run: &Run| {
        let fuser = if work.every().is_some() {
            MapFuser::with_scratch(lattice, budget_bytes, &places.scratch(run))
        } else {
            MapFuser::new(lattice, budget_bytes, work.path())
        };
        fuser.map_err(EvaluateError::map_of(&run.name))
    };
    let mut states =
        fusing.as_mut().map_or(Vec::new(), |fusing| std::mem::take(&mut fusing.fusers)).into_iter();
    let mut fuser_of = |run: &Run| match states.next().flatten() {
        Some(state) => MapFuser::resume(lattice, budget_bytes, &places.scratch(run), &state)
            .map_err(EvaluateError::map_of(&run.name)),
        None => new_fuser(run),
    };

    let fusers = runs
        .iter()
        .map(|run| if run.map == MapSource::Fused { fuser_of(run).map(Some) } else { Ok(None) })
        .collect::<Result<Vec<_>, _>>()?;
    let fused = if fusers.iter().any(Option::is_some) {
        let pass = FusePass { log, plan, runs, config, fusers: &fusers, trails, work, round, watch };
        Some(pass.run(fusing)?)
    } else {
        None
    };
    let (counts, left_out) = fused.unzip();

    let mut scratch_bytes = 0;
    let mut maps = Vec::new();
    let mut notes = vec![Vec::new(); runs.len()];
    for ((((run, own_from_world), fuser), store), notes) in
        runs.iter().zip(&plan.own_from_world).zip(fusers).zip(stores).zip(&mut notes)
    {
        let origin = |text| Origin { text, own_from_world: *own_from_world };
        let map_error = EvaluateError::map_of(&run.name);
        maps.push(match (fuser, store, &run.map) {
            (Some(fuser), ..) => {
                scratch_bytes += fuser.scratch_bytes();
                let (path, keep) = places.map(run);
                let (store, thin_voxels) =
                    finish(fuser, &path, &origin(provenance(log, run, plan)), keep, watch)
                        .map_err(map_error)?;
                RunMap { store, fused: true, thin_voxels: Some(thin_voxels), points_dropped: 0 }
            }
            (None, Some(store), _) => RunMap { store, fused: false, thin_voxels: None, points_dropped: 0 },
            (None, None, MapSource::Given(given)) => {
                let fuser = new_fuser(run)?;
                let world_from_own = own_from_world.inverse();
                let found = fuse_given(given, &run.name, config.map_unit, &fuser, &world_from_own, watch)?;
                *notes = found.notes;
                let text = format!("fused from {}", given.display());
                let path = work.file(&format!("given-{}.dmpmap", file_stem(runs, run)));
                let (store, thin_voxels) =
                    finish(fuser, &path, &origin(text), places.keep(), watch).map_err(map_error)?;
                RunMap { store, fused: false, thin_voxels: Some(thin_voxels), points_dropped: found.dropped }
            }
            (None, None, MapSource::Fused) => continue,
        });
        memory::look();
    }
    let left_out = left_out.unwrap_or(0);
    Ok(Maps { of_runs: maps, counts, left_out, trails: None, scratch_bytes, notes })
}

/// Bytes of the tiles of maps that were fused.
pub(crate) fn fused_bytes(maps: &[RunMap]) -> u64 {
    let tiles = maps.iter().filter(|map| map.fused).flat_map(|map| map.store.entries());
    tiles.map(|tile| u64::from(tile.own.bytes) + u64::from(tile.borders.bytes)).sum()
}

/// How long a finished map is to live.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Life {
    /// Until nobody reads it any more.
    Reader,
    /// As long as the work folder.
    Work,
    /// It is the user's.
    User,
}

/// Where files go.
struct Places<'a> {
    runs: &'a [Run],
    work: &'a Work,
    round: Round,
    config: &'a Config,
}

impl Places<'_> {
    fn scratch(&self, run: &Run) -> PathBuf {
        self.work.file(&format!("{}.{}", file_stem(self.runs, run), scratch_extension(self.round)))
    }

    fn keep(&self) -> Life {
        if self.work.every().is_some() { Life::Work } else { Life::Reader }
    }

    fn map(&self, run: &Run) -> (PathBuf, Life) {
        let stem = file_stem(self.runs, run);
        match (&self.config.save_maps, self.round) {
            // Maps that are fused once more without trails are saved then.
            (Some(folder), Round::WithoutTrails) => (folder.join(format!("{stem}.dmpmap")), Life::User),
            (Some(folder), Round::First) if !self.config.free_space => {
                (folder.join(format!("{stem}.dmpmap")), Life::User)
            }
            (_, Round::First) => (self.work.file(&format!("{stem}.dmpmap")), self.keep()),
            (_, Round::WithoutTrails) => {
                (self.work.file(&format!("{stem}.without-trails.dmpmap")), self.keep())
            }
        }
    }
}

/// Ends the names of scratch files.
fn scratch_extension(round: Round) -> &'static str {
    match round {
        Round::First => "scratch",
        Round::WithoutTrails => "scratch-without-trails",
    }
}

/// What an earlier process kept of finished maps.
fn reopen(fused: Fused, runs: &[Run], stores: Vec<Option<Store>>) -> Result<Maps, EvaluateError> {
    let (mut of_runs, mut notes) = (Vec::new(), Vec::new());
    for ((map, run), given) in fused.maps.into_iter().zip(runs).zip(stores) {
        let store = match (given, &map.path) {
            (Some(store), _) => store,
            (None, Some(path)) => Store::open(path).map_err(EvaluateError::map_of(&run.name))?,
            (None, None) => continue,
        };
        let FusedMap { fused, thin_voxels, points_dropped, .. } = map;
        of_runs.push(RunMap { store, fused, thin_voxels, points_dropped });
        notes.push(map.notes);
    }
    let Fused { counts, left_out, scratch_bytes, trails, .. } = fused;
    Ok(Maps { of_runs, counts, left_out, trails, scratch_bytes, notes })
}

/// The maps as they were finished without the returns on trails by an earlier process.
pub(crate) fn reopen_without_trails(work: &Work, runs: &[Run]) -> Result<Option<Maps>, EvaluateError> {
    let Some(fused) = work.load::<Fused>(Round::WithoutTrails)? else { return Ok(None) };
    reopen(fused, runs, runs.iter().map(|_| None).collect()).map(Some)
}

/// Finished maps as another process finds them, and the round they are of.
fn to_keep(maps: &Maps) -> (Round, Fused) {
    let kept = |(map, notes): (&RunMap, &Vec<String>)| FusedMap {
        // A store that was given is opened again where it was given.
        path: map.thin_voxels.map(|_| map.store.path().to_path_buf()),
        fused: map.fused,
        thin_voxels: map.thin_voxels,
        points_dropped: map.points_dropped,
        notes: notes.clone(),
    };
    let round = if maps.trails.is_some() { Round::WithoutTrails } else { Round::First };
    let fused = Fused {
        counts: maps.counts,
        left_out: maps.left_out,
        scratch_bytes: maps.scratch_bytes,
        trails: maps.trails.clone(),
        maps: maps.of_runs.iter().zip(&maps.notes).map(kept).collect(),
    };
    (round, fused)
}

/// Keeps finished maps where it is time to; tells how they are kept.
pub(crate) fn keep_if_due(work: &Work, maps: &Maps) -> Result<(Round, Fused), EvaluateError> {
    let (round, fused) = to_keep(maps);
    if work.due() && !work.holds::<Fused>(round) {
        keep(work, round, &fused)?;
    }
    Ok((round, fused))
}

/// Keeps finished maps, and forgets what they were made of.
pub(crate) fn keep(work: &Work, round: Round, fused: &Fused) -> Result<(), EvaluateError> {
    for map in &fused.maps {
        map.path.as_ref().map_or(Ok(()), |path| work.sync(path))?;
    }
    work.save(round, fused)?;
    work.forget::<Fusing>(round);
    work.remove_files(scratch_extension(round));
    Ok(())
}

pub(crate) fn finish(
    fuser: MapFuser,
    path: &Path,
    origin: &Origin,
    life: Life,
    watch: &dyn Watch,
) -> Result<(Store, u64), dmp_map::MapError> {
    let done = std::sync::atomic::AtomicU64::new(0);
    let durability = if life == Life::User { Durability::Durable } else { Durability::Temporary };
    let summary = fuser.finish(path, origin, durability, &|tiles, total| {
        let before = done.swap(tiles, std::sync::atomic::Ordering::Relaxed);
        if before == 0 {
            watch.begin(Stage::Surfels, total);
        }
        watch.advance(tiles - before);
    })?;
    let store = match life {
        Life::Reader => Store::open_once(&summary.path)?,
        Life::Work | Life::User => Store::open(&summary.path)?,
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

/// A run's name as a file name.
fn file_stem(runs: &[Run], run: &Run) -> String {
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    file_stem_of(&names, &run.name)
}

/// The name of a run as a file name, `names` being those of all runs: what file systems or shells take amiss becomes
/// `_`, and where that makes two runs alike, they get their numbers.
pub fn file_stem_of(names: &[&str], name: &str) -> String {
    let harmless = |name: &str| -> String {
        name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
    };
    let stem = harmless(name);
    let alike: Vec<&&str> =
        names.iter().filter(|other| harmless(other).eq_ignore_ascii_case(&stem)).collect();
    match alike.iter().position(|&&other| other == name) {
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
    buffers: FuseBuffers,
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

/// One pass over the log in which maps are fused.
struct FusePass<'a> {
    log: &'a dyn ScanLog,
    plan: &'a Plan<'a>,
    runs: &'a [Run],
    config: &'a Config,
    fusers: &'a [Option<MapFuser>],
    trails: Option<&'a Trails>,
    work: &'a Work,
    round: Round,
    watch: &'a dyn Watch,
}

impl<'a> FusePass<'a> {
    /// Goes on from `before`, and tells where the returns went and how many of them are in no map.
    fn run(&self, before: Option<Fusing>) -> Result<(ReturnCounts, u64), EvaluateError> {
        self.watch.begin(Stage::Fuse, self.plan.returns());
        let before = before.unwrap_or_default();
        self.watch.advance(before.counts.total());
        let state = |workers: &[FuseWorker<'_>]| {
            let (mut counts, mut left_out) = (before.counts, before.left_out);
            for worker in workers {
                counts.merge(&worker.counts);
                left_out += worker.left_out;
            }
            (counts, left_out)
        };
        let put_down = |workers: &[FuseWorker<'_>], done: &FrameSet| {
            let fusers = self.fusers.iter().zip(self.runs).map(|(fuser, run)| {
                let state = fuser.as_ref().map(MapFuser::put_down).transpose();
                state.map_err(EvaluateError::map_of(&run.name))
            });
            let fusers = fusers.collect::<Result<_, _>>()?;
            let (counts, left_out) = state(workers);
            self.work.save(self.round, &Fusing { done: done.clone(), counts, left_out, fusers })
        };
        let workers = (0..self.config.threads).map(|_| self.worker()).collect();
        let pauses = Pauses {
            every: self.work.every(),
            done: before.done.clone(),
            keep: &mut |w, done| put_down(w, done),
            ahead: &|_| (),
        };
        let reading = self.plan.reading(self.log, self.config, self.watch);
        let jobs = Jobs { first: 0, jobs: jobs_of(reading, |ordinal| !pauses.done.contains(ordinal)) };
        let (workers, done) = each_frame_in_parts(reading, jobs, workers, pauses)?;
        if self.work.due() {
            put_down(&workers, &done)?;
        }
        Ok(state(&workers))
    }

    fn worker(&self) -> FuseWorker<'a> {
        FuseWorker {
            poser: Poser::new(&self.plan.poses, &self.plan.filter),
            runs: self.runs,
            fusers: self.fusers,
            trails: self.trails,
            on_trail: Vec::new(),
            trail_buffers: TrailBuffers::default(),
            left_out: 0,
            watch: self.watch,
            buffers: FuseBuffers::default(),
            points: Vec::new(),
            counts: ReturnCounts::default(),
        }
    }
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
