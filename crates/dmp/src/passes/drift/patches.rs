//! Builds the surfaces of a run's visits from their scans.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, PoisonError};

use dmp_log::ScanLog;
use dmp_map::{Lattice, PatchBuilder};
use dmp_revisit::align::Pyramid;
use dmp_runs::{EvaluateError, Means, PlannedFrame, PosedRun, Poser, Progress, Settings};
use dmp_sensor::{Isometry3, Scan};

use super::visits::{RETURNS, Visit};
use crate::passes::frames::{Worker, each_frame_of_jobs, jobs_of};
use crate::passes::plan::Plan;

/// Edge of the voxels of a patch, metres of a drive.
const VOXEL_M: f64 = 0.5;
/// Radius of a visit's surfaces, metres of a drive: farther ones are sampled sparsely.
const REACH_M: f64 = 40.0;

/// The surfaces of visits, by the number of the visit: each in the frame of its place.
pub(super) type Pyramids = BTreeMap<usize, Pyramid>;

/// Visits by number, each with `place_from_world`.
pub(super) type Visits<'v> = BTreeMap<usize, (&'v Visit, Isometry3<f64>)>;

/// Some scans of a visit.
struct Part {
    /// Number of the visit.
    number: usize,
    scans: usize,
    patch: PatchBuilder,
}

/// What scans of visits are read from, and how.
#[derive(Clone, Copy)]
pub(super) struct Source<'e> {
    pub(super) log: &'e dyn ScanLog,
    pub(super) settings: &'e Settings,
    pub(super) means: &'e Means,
    pub(super) plan: &'e Plan,
    pub(super) progress: &'e dyn Progress,
}

/// Reads the scans of some visits of a run, given by number with `place_from_world`, and builds the surfaces of each.
pub(super) fn pyramids(
    source: Source<'_>,
    run: &PosedRun<'_, ()>,
    visits: &Visits<'_>,
) -> Result<Pyramids, EvaluateError> {
    let Source { log, settings, means, plan, progress } = source;
    let frames = plan.frames();
    let lattice = Lattice::new(voxel_m(settings))?;
    let scans = visits
        .iter()
        .flat_map(|(&number, (visit, _))| visit.scans.iter().map(move |&ordinal| (ordinal, number)));
    let of_scan = scans.collect();
    let share_of = |visit: &Visit| {
        let returns: u64 = visit.scans.iter().map(|&ordinal| frames[ordinal].returns).sum();
        (RETURNS as f64 / returns.max(1) as f64).min(1.0)
    };
    let shared = Shared {
        of_scan,
        shares: visits.iter().map(|(&number, (visit, _))| (number, share_of(visit))).collect(),
        visits,
        reach_m: REACH_M * settings.metre_m(),
        lattice,
        open: Mutex::default(),
        done: Mutex::default(),
        used: Mutex::default(),
    };
    let worker = |_| PatchWorker {
        poser: Poser::new([(&run.poses, &*run.path)], &plan.filter),
        shared: &shared,
        name: run.name(),
        points: Vec::new(),
        visit: None,
    };
    let workers = (0..means.threads).map(worker).collect();
    let reading = plan.reading(log, means, progress);
    let jobs = jobs_of(reading, |ordinal| shared.of_scan.contains_key(&ordinal));
    let workers = each_frame_of_jobs(reading, of_visits(jobs, &shared.of_scan), workers)?;
    workers.into_iter().filter_map(|worker| worker.visit).for_each(|part| shared.put(part));
    Ok(shared.done.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Merges consecutive jobs of the same visit, so that one thread has all of it.
fn of_visits(jobs: Vec<Vec<usize>>, of_scan: &HashMap<usize, usize>) -> Vec<Vec<usize>> {
    let visit_of = |job: &[usize]| {
        let first = of_scan.get(job.first()?)?;
        job.iter().all(|ordinal| of_scan.get(ordinal) == Some(first)).then_some(*first)
    };
    let mut joined: Vec<Vec<usize>> = Vec::with_capacity(jobs.len());
    for job in jobs {
        match joined.last_mut() {
            Some(last) if visit_of(last).is_some_and(|visit| visit_of(&job) == Some(visit)) => {
                last.extend(job);
            }
            _ => joined.push(job),
        }
    }
    joined
}

/// Edge of the voxels of a patch, metres.
pub(super) fn voxel_m(settings: &Settings) -> f64 {
    VOXEL_M * settings.metre_m()
}

/// State shared by the threads.
struct Shared<'v> {
    /// From a scan's ordinal to the number of its visit.
    of_scan: HashMap<usize, usize>,
    /// The share of the returns used on each visit.
    shares: HashMap<usize, f64>,
    visits: &'v Visits<'v>,
    reach_m: f64,
    lattice: Lattice,
    /// Visits with scans on several threads.
    open: Mutex<HashMap<usize, Part>>,
    done: Mutex<Pyramids>,
    /// Patches of finished visits: their memory is reused.
    used: Mutex<Vec<PatchBuilder>>,
}

/// Work of a thread on a scan: adds its returns to the patch of its visit.
struct PatchWorker<'a> {
    poser: Poser<'a>,
    shared: &'a Shared<'a>,
    name: &'a str,
    points: Vec<[f64; 3]>,
    /// The visit of the last scan.
    visit: Option<Part>,
}

impl Worker for PatchWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Some(&number) = self.shared.of_scan.get(&ordinal) else { return Ok(()) };
        if let Some(other) = self.visit.take_if(|part| part.number != number) {
            self.shared.put(other);
        }
        let Self { poser, shared, name, points, visit } = self;
        let (_, place_from_world) = &shared.visits[&number];
        let (share, reach_m2) = (shared.shares[&number], shared.reach_m * shared.reach_m);
        points.clear();
        poser.endpoints(
            (ordinal, frame),
            scan,
            &[Some(*place_from_world)],
            |index| is_drawn(index, share),
            |_, [x, y, z]| {
                if x * x + y * y + z * z <= reach_m2 {
                    points.push([x, y, z]);
                }
            },
        );
        let part = visit.get_or_insert_with(|| shared.begun(number));
        part.patch.add(points).map_err(EvaluateError::map_of(name))?;
        part.scans += 1;
        let is_whole = |part: &mut Part| part.scans == shared.visits[&number].0.scans.len();
        if let Some(whole) = visit.take_if(is_whole) {
            shared.put(whole);
        }
        Ok(())
    }
}

impl Shared<'_> {
    fn begun(&self, number: usize) -> Part {
        let used = self.used.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Part { number, scans: 0, patch: used.unwrap_or_else(|| PatchBuilder::new(self.lattice)) }
    }

    /// Adds some scans of a visit; the last ones complete its surfaces.
    fn put(&self, mut part: Part) {
        let scans = self.visits[&part.number].0.scans.len();
        if part.scans < scans {
            let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(other) = open.remove(&part.number) {
                part.merge(other);
            }
            if part.scans < scans {
                open.insert(part.number, part);
                return;
            }
        }
        let pyramid = Pyramid::new(&part.patch);
        self.done.lock().unwrap_or_else(PoisonError::into_inner).insert(part.number, pyramid);
        part.patch.clear();
        self.used.lock().unwrap_or_else(PoisonError::into_inner).push(part.patch);
    }
}

impl Part {
    fn merge(&mut self, other: Self) {
        self.scans += other.scans;
        self.patch.merge(other.patch);
    }
}

/// Whether the return of this index belongs to the share: spread evenly by the golden ratio, so the order of
/// beams has no influence.
fn is_drawn(index: usize, share: f64) -> bool {
    let part = (index as u32).wrapping_mul(2_654_435_769);
    f64::from(part) < share * 4_294_967_296.0
}
