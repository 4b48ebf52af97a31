//! Decisions from a few scans, by nothing else: the vehicle's own returns, the voxel edge, and where returns lie.

use std::sync::{Mutex, PoisonError};

use dmp_log::ScanLog;
use dmp_report::Ego;
use dmp_revisit::apart::{MomentSums, Moments};
use dmp_runs::{EvaluateError, FrameOrder, PlannedFrame, Progress, Settings, Stage};
use dmp_sensor::{EgoMask, EgoVotes, ReturnFilter, Scan};

use crate::drawn::spread;
use crate::means::peak;
use crate::passes::frames::{Reading, Worker, each_frame_of};

/// Scans that are read, spread evenly over the log.
pub(crate) const SURVEYED_SCANS: usize = 50;
/// The share of returns that suffices for a voxel edge: of those with two others of their scan in their voxel.
/// `docs/accuracy.md` has the shares of some sensors.
const FILLED_SHARE: f64 = 0.3;
/// Returns that a voxel needs for a surfel.
const FILLED: usize = 3;
/// The vehicle is looked for in cells of this edge, metres, within this distance.
const NEAR_CELL_M: f32 = 0.1;
const NEAR_M: f32 = 5.0;
/// Whether the sensor moved shows in the cells of this edge between these distances, metres: of a sensor that stands, more
/// than this share of two scans is the same. Scans with fewer cells show nothing.
const FAR_CELL_M: f32 = 0.5;
const FAR_M: f32 = 40.0;
const STANDS: f64 = 0.75;
const FEWEST_CELLS: usize = 20;

/// What a few scans show.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Surveyed {
    /// The edge v, metres.
    pub(crate) voxel_m: f64,
    /// Share of returns in voxels with three or more of their scan; `None` if the edge was given.
    pub(crate) filled_share: Option<f64>,
    /// Where the returns of a scan lie.
    pub(crate) returns: Moments,
}

/// Surveys scans of a log.
#[derive(Clone, Copy)]
pub(crate) struct Survey<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) settings: &'a Settings,
    /// Its number of threads is used.
    pub(crate) pool: &'a rayon::ThreadPool,
    pub(crate) progress: &'a dyn Progress,
}

impl Survey<'_> {
    /// Which returns are used: the ranges, and the vehicle as given or as the scans show it; and the given voxel edge, or
    /// the smallest that enough returns fill.
    pub(crate) fn look(
        &self,
        frames: &[PlannedFrame],
        voxel_m: Option<f64>,
    ) -> Result<(ReturnFilter, Surveyed), EvaluateError> {
        let Settings { min_range_m, max_range_m, scales, ego, .. } = *self.settings;
        let lengths = scales.lengths();
        let mut filter = ReturnFilter { min_range_m, max_range_m, ego: EgoMask::default() };
        let finds_vehicle = ego == Ego::Auto && lengths.has_vehicle;
        if let Ego::BoxMm(min, max) = ego {
            filter.ego = EgoMask::from_box_mm(min, max);
        }
        let looked = self.scans(frames, &filter, &lengths.voxels_m)?;
        if finds_vehicle {
            filter.ego = vehicle(&looked);
        }
        let mut sums = MomentSums::default();
        looked.iter().for_each(|scan| sums.merge(&scan.moments));
        let moments = sums.moments();
        let chosen = || {
            let returns: u64 = looked.iter().map(|scan| scan.returns).sum();
            let filled = |k: usize| looked.iter().map(|scan| scan.filled[k]).sum::<u64>();
            let shares = lengths.voxels_m.iter().enumerate();
            let mut shares = shares.map(|(k, &m)| (m, filled(k) as f64 / returns.max(1) as f64)).peekable();
            while let Some((voxel_m, share)) = shares.next() {
                if share >= FILLED_SHARE || shares.peek().is_none() {
                    return (voxel_m, Some(share));
                }
            }
            (lengths.voxels_m[0], None)
        };
        let (voxel_m, filled_share) = voxel_m.map_or_else(chosen, |voxel_m| (voxel_m, None));
        Ok((filter, Surveyed { voxel_m, filled_share, returns: moments }))
    }

    /// Looks at scans along the whole log, in order of time.
    fn scans(
        &self,
        frames: &[PlannedFrame],
        filter: &ReturnFilter,
        voxels_m: &[f64],
    ) -> Result<Vec<Looked>, EvaluateError> {
        let wanted = spread(frames.len(), SURVEYED_SCANS);
        self.progress.begin(Stage::Survey, wanted.len() as u64);
        let looked = Mutex::new(Vec::with_capacity(wanted.len()));
        let worker = || Look { filter, voxels_m, looked: &looked, progress: self.progress };
        let threads = self.pool.current_num_threads().min(wanted.len());
        let reading =
            Reading { log: self.log, drawn: None, frames, order: FrameOrder::Log, progress: self.progress };
        let is_wanted = |ordinal: usize| wanted.binary_search(&ordinal).is_ok();
        each_frame_of(reading, is_wanted, (0..threads).map(|_| worker()).collect())?;
        peak::look();
        let mut looked: Vec<Looked> = looked.into_inner().unwrap_or_else(PoisonError::into_inner);
        looked.sort_by_key(|scan| scan.ordinal);
        Ok(looked)
    }
}

/// What a scan shows.
#[derive(Debug)]
struct Looked {
    ordinal: usize,
    returns: u64,
    moments: MomentSums,
    /// For each voxel edge, returns in voxels with three or more.
    filled: Vec<u64>,
    /// One return of each cell near the sensor.
    near: Vec<[f32; 3]>,
    /// The cells further away, ascending.
    far: Vec<u64>,
}

/// The vehicle, by scans that differ: while a sensor stands, the world looks like its own body.
fn vehicle(looked: &[Looked]) -> EgoMask {
    let mut votes = EgoVotes::default();
    let mut last: Option<&Looked> = None;
    for scan in looked.iter().filter(|scan| scan.far.len() >= FEWEST_CELLS) {
        if last.is_none_or(|last| in_common(&last.far, &scan.far) < STANDS) {
            votes.add_scan(scan.near.iter().copied());
            last = Some(scan);
        }
    }
    votes.mask()
}

/// How much of the smaller of two sorted lists is in the other.
fn in_common(a: &[u64], b: &[u64]) -> f64 {
    let (few, many) = if a.len() < b.len() { (a, b) } else { (b, a) };
    let common = few.iter().filter(|cell| many.binary_search(cell).is_ok()).count();
    common as f64 / few.len().max(1) as f64
}

struct Look<'s> {
    filter: &'s ReturnFilter,
    voxels_m: &'s [f64],
    looked: &'s Mutex<Vec<Looked>>,
    progress: &'s dyn Progress,
}

impl Worker for Look<'_> {
    fn frame(&mut self, ordinal: usize, _: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let points = scan.points_in_sensor_m.iter().copied();
        let used: Vec<[f32; 3]> = points.filter(|&point| self.filter.check(point).is_ok()).collect();
        let filled = |&voxel_m: &f64| {
            let mut cells: Vec<u64> = used.iter().map(|&point| cell_of(point, voxel_m as f32)).collect();
            cells.sort_unstable();
            let filled = cells.chunk_by(|a, b| a == b).filter(|voxel| voxel.len() >= FILLED);
            filled.map(|voxel| voxel.len() as u64).sum()
        };
        let range_m = |point: &[f32; 3]| point.iter().map(|c| c * c).sum::<f32>().sqrt();
        let mut near: Vec<(u64, [f32; 3])> = used
            .iter()
            .filter(|&point| range_m(point) <= NEAR_M)
            .map(|&point| (cell_of(point, NEAR_CELL_M), point))
            .collect();
        near.sort_by_key(|(cell, _)| *cell);
        near.dedup_by_key(|(cell, _)| *cell);
        let is_far = |point: &&[f32; 3]| (NEAR_M..FAR_M).contains(&range_m(point));
        let mut far: Vec<u64> = used.iter().filter(is_far).map(|&point| cell_of(point, FAR_CELL_M)).collect();
        far.sort_unstable();
        far.dedup();
        let looked = Looked {
            ordinal,
            returns: used.len() as u64,
            moments: MomentSums::of(used.iter().copied()),
            filled: self.voxels_m.iter().map(filled).collect(),
            near: near.into_iter().map(|(_, point)| point).collect(),
            far,
        };
        self.looked.lock().unwrap_or_else(PoisonError::into_inner).push(looked);
        self.progress.advance(1);
        Ok(())
    }
}

/// The number of a cell: 21 bits of each coordinate, more than any range has cells.
fn cell_of(point: [f32; 3], edge_m: f32) -> u64 {
    let coordinate = |c: f32| (c / edge_m).floor() as i32 as u32;
    point.iter().fold(0, |number, &c| number << 21 | u64::from(coordinate(c) % (1 << 21)))
}
