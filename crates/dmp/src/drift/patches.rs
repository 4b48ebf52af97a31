//! What each run makes of the scans of some visits.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, PoisonError};

use dmp_align::Pyramid;
use dmp_map::{Lattice, PatchBuilder};
use dmp_sensor::{Isometry3, Scan};

use super::visits::Visit;
use crate::error::EvaluateError;
use crate::evaluation::Evaluation;
use crate::frames::{PlannedFrame, Worker, each_frame_of};
use crate::pose::Poser;
use crate::run_state::{RunState, poses_of};
use crate::settings::Settings;

/// Edge of the voxels of a patch, metres of a drive.
const VOXEL_M: f64 = 0.5;
/// How far from the visit its surfaces are looked at, metres of a drive: what is further off is seen sparsely.
const REACH_M: f64 = 40.0;
/// Returns of a visit that are looked at, about: of more, some of each scan.
const RETURNS: u64 = 240_000;

/// The surfaces of visits as each run has them, by the number of the visit: each in the frame of its place, a run after the
/// other. A run without a pose there has none.
pub(super) type Pyramids = BTreeMap<usize, Vec<Option<Pyramid>>>;

/// Visits by number, each with `place_from_world` of every run.
pub(super) type Visits<'v> = BTreeMap<usize, (&'v Visit, Vec<Option<Isometry3<f64>>>)>;

/// A visit whose scans are not all there yet.
struct Open {
    scans_left: usize,
    patches: Vec<Option<PatchBuilder>>,
}

/// Reads the scans of some visits, given by number with `place_from_world` of each run, and gives the surfaces of each.
pub(super) fn pyramids<M: Sync>(
    evaluation: &Evaluation<'_, M>,
    visits: &Visits<'_>,
) -> Result<Pyramids, EvaluateError> {
    let Evaluation { log, settings, means, plan, runs, progress, .. } = evaluation;
    let frames = plan.frames();
    let lattice = Lattice::new(voxel_m(settings))?;
    let mut of_scan = HashMap::new();
    let mut open = BTreeMap::new();
    for (&number, (visit, place_from_world)) in visits {
        of_scan.extend(visit.scans.iter().map(|&ordinal| (ordinal, number)));
        let patches = place_from_world.iter().map(|run| run.map(|_| PatchBuilder::new(lattice))).collect();
        open.insert(number, Open { scans_left: visit.scans.len(), patches });
    }
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
        open: Mutex::new(open),
        done: Mutex::default(),
    };
    let worker = |_| PatchWorker {
        poser: Poser::new(poses_of(runs), &plan.filter),
        shared: &shared,
        names: runs.iter().map(RunState::name).collect(),
        points: vec![Vec::new(); runs.len()],
    };
    let workers = (0..means.threads).map(worker).collect();
    let reading = plan.reading(*log, means, *progress);
    each_frame_of(reading, |ordinal| shared.of_scan.contains_key(&ordinal), workers)?;
    Ok(shared.done.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Edge of the voxels of a patch, metres.
pub(super) fn voxel_m(settings: &Settings) -> f64 {
    VOXEL_M * settings.metre_m()
}

/// What threads share.
struct Shared<'v> {
    /// By the ordinal of a scan the number of its visit.
    of_scan: HashMap<usize, usize>,
    /// What share of the returns is looked at on each visit.
    shares: HashMap<usize, f64>,
    visits: &'v Visits<'v>,
    reach_m: f64,
    lattice: Lattice,
    open: Mutex<BTreeMap<usize, Open>>,
    done: Mutex<Pyramids>,
}

/// What a thread does with a scan: adds its returns to the patch of its visit, as every run has them.
struct PatchWorker<'a> {
    poser: Poser<'a>,
    shared: &'a Shared<'a>,
    names: Vec<&'a str>,
    points: Vec<Vec<[f64; 3]>>,
}

impl Worker for PatchWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, shared, names, points } = self;
        let Some(number) = shared.of_scan.get(&ordinal) else { return Ok(()) };
        let (_, place_from_world) = &shared.visits[number];
        let (share, reach_m2) = (shared.shares[number], shared.reach_m * shared.reach_m);
        points.iter_mut().for_each(Vec::clear);
        let mut index = 0;
        poser.blocks(frame, scan, |block| {
            for (run, place_from_world) in place_from_world.iter().enumerate() {
                let Some(place_from_world) = place_from_world else { continue };
                let drawn = |&(k, _): &(usize, &dmp_sensor::Ray)| is_drawn(index + k as u64, share);
                let in_place = block.rays(run).iter().enumerate().filter(drawn).map(|(_, ray)| {
                    let place: [f64; 3] =
                        (place_from_world * dmp_sensor::Point3::from(ray.endpoint_in_world())).into();
                    place
                });
                points[run].extend(in_place.filter(|[x, y, z]| x * x + y * y + z * z <= reach_m2));
            }
            index += block.len() as u64;
            Ok::<(), EvaluateError>(())
        })?;
        let mut of_scan = Vec::with_capacity(points.len());
        for (points, name) in points.iter().zip(names) {
            let mut patch = PatchBuilder::new(shared.lattice);
            patch.add(points.iter().copied()).map_err(EvaluateError::map_of(name))?;
            of_scan.push(patch);
        }
        let finished = {
            let mut open = shared.open.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(visit) = open.get_mut(number) else { return Ok(()) };
            for (patch, of_scan) in visit.patches.iter_mut().zip(of_scan) {
                if let Some(patch) = patch {
                    patch.merge(of_scan);
                }
            }
            visit.scans_left -= 1;
            if visit.scans_left == 0 { open.remove(number) } else { None }
        };
        if let Some(Open { patches, .. }) = finished {
            let pyramids = patches.iter().map(|patch| patch.as_ref().map(Pyramid::new)).collect();
            shared.done.lock().unwrap_or_else(PoisonError::into_inner).insert(*number, pyramids);
        }
        Ok(())
    }
}

/// Whether a return of this index is one of a share of all: evenly, by the golden ratio, so that no order of beams matters.
fn is_drawn(index: u64, share: f64) -> bool {
    let part = (index as u32).wrapping_mul(2_654_435_769);
    f64::from(part) < share * 4_294_967_296.0
}
