//! Decisions from a few scans: the vehicle's own returns and the voxel edge.

use std::sync::{Mutex, PoisonError};

use dmp_log::ScanLog;
use dmp_map::{DensityProbe, Lattice, MapError};
use dmp_sensor::{EgoMask, EgoVotes, Ray, ReturnFilter, Scan};

use crate::config::FrameOrder;
use crate::ego::Ego;
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Reading, Worker, each_frame_of};
use crate::peak;
use crate::poser::Poser;
use crate::progress::{Progress, Stage};
use crate::run_state::RunState;
use crate::settings::Settings;

/// Scans that vote on the vehicle, spread evenly over the log.
const EGO_SCANS: usize = 50;
/// Number of blocks of successive scans for the density, scans per block, and the largest extent of a block.
pub(crate) const BLOCKS: usize = 5;
pub(crate) const BLOCK_SCANS: usize = 20;
pub(crate) const BLOCK_RETURNS: u64 = 1_000_000;
/// The share of returns in filled voxels that suffices for a voxel edge.
const FILLED_SHARE: f64 = 0.7;

/// The voxel edge and its reason.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct VoxelChoice {
    /// The edge v, metres.
    pub(crate) voxel_m: f64,
    /// Share of returns in voxels with three or more in the sampled blocks; `None` if the edge was given.
    pub(crate) filled_share: Option<f64>,
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
    /// Which returns are used: the ranges, and the vehicle as given or as some `voters`, scans along the
    /// whole path, detect it.
    pub(crate) fn filter(
        &self,
        voters: &[PlannedFrame],
        travel_m: f64,
    ) -> Result<ReturnFilter, EvaluateError> {
        let Settings { min_range_m, max_range_m, scales, ego, .. } = *self.settings;
        let mut filter = ReturnFilter { min_range_m, max_range_m, ego: EgoMask::default() };
        match ego {
            Ego::None => {}
            Ego::BoxMm(min, max) => filter.ego = EgoMask::from_box_mm(min, max),
            Ego::Auto if scales.lengths().ego_travel_m.is_none_or(|least_m| travel_m < least_m) => {}
            Ego::Auto => {
                let chosen = spread(voters.len(), EGO_SCANS);
                self.progress.begin(Stage::Survey, chosen.len() as u64);
                let votes = Mutex::new(EgoVotes::default());
                let voter = || Voter { filter: &filter, votes: &votes, progress: self.progress };
                self.each_frame(voters, |voter| chosen.binary_search(&voter).is_ok(), voter)?;
                filter.ego = votes.into_inner().unwrap_or_else(PoisonError::into_inner).mask();
            }
        }
        Ok(filter)
    }

    /// The given voxel edge, or the smallest at which enough returns of some run share a voxel with two
    /// others. The best run decides: a poor trajectory scatters returns, but density depends on the sensor
    /// and the drive. Tries one run and one edge at a time, since each needs memory for a whole block of
    /// scans.
    pub(crate) fn voxel<M>(
        &self,
        asked_m: Option<f64>,
        blocks: &[&[PlannedFrame]],
        runs: &[RunState<'_, M>],
        filter: &ReturnFilter,
    ) -> Result<VoxelChoice, EvaluateError> {
        if let Some(voxel_m) = asked_m {
            return Ok(VoxelChoice { voxel_m, filled_share: None });
        }
        let scans: usize = blocks.iter().map(|block| block.len()).sum();
        let voxels_m = self.settings.scales.lengths().voxels_m;
        let mut choice = VoxelChoice { voxel_m: voxels_m[0], filled_share: None };
        'edges: for (k, &voxel_m) in voxels_m.iter().enumerate() {
            let lattice = Lattice::new(voxel_m)?;
            let mut best: f64 = 0.0;
            for run in runs {
                self.progress.begin(Stage::Survey, scans as u64);
                let share = match self.filled_share(blocks, lattice, run, filter) {
                    // Small voxels span a small world.
                    Err(EvaluateError::Map { source: MapError::OutOfWorld { .. }, .. })
                        if k + 1 < voxels_m.len() =>
                    {
                        continue 'edges;
                    }
                    share => share?,
                };
                best = best.max(share);
                if best >= FILLED_SHARE {
                    return Ok(VoxelChoice { voxel_m, filled_share: Some(best) });
                }
            }
            choice = VoxelChoice { voxel_m, filled_share: Some(best) };
        }
        Ok(choice)
    }

    /// Share of one run's returns that lie in filled voxels of `lattice`.
    fn filled_share<M>(
        &self,
        blocks: &[&[PlannedFrame]],
        lattice: Lattice,
        run: &RunState<'_, M>,
        filter: &ReturnFilter,
    ) -> Result<f64, EvaluateError> {
        let returns = |block: &&[PlannedFrame]| block.iter().map(|frame| frame.returns as usize).sum();
        let mut probe = DensityProbe::new(lattice, blocks.iter().map(returns).max().unwrap_or(0));
        for block in blocks {
            let locator = || Locator {
                poser: Poser::new([&run.poses], filter),
                probe: &probe,
                run: run.name(),
                progress: self.progress,
            };
            self.each_frame(block, |_| true, locator)?;
            self.pool.install(|| probe.end_block());
            peak::look();
        }
        Ok(probe.filled_share())
    }

    /// Hands the `wanted` returns of some frames to workers: one per thread of the pool, at most one per
    /// frame.
    fn each_frame<W: Worker>(
        &self,
        frames: &[PlannedFrame],
        wanted: impl Fn(usize) -> bool,
        worker: impl Fn() -> W,
    ) -> Result<(), EvaluateError> {
        let reading = Reading { log: self.log, frames, order: FrameOrder::Log, progress: self.progress };
        let threads = self.pool.current_num_threads().min(frames.len());
        let workers = (0..threads).map(|_| worker()).collect();
        each_frame_of(reading, wanted, workers)?;
        Ok(())
    }
}

/// Lets scans vote on the vehicle.
struct Voter<'s> {
    filter: &'s ReturnFilter,
    votes: &'s Mutex<EgoVotes>,
    progress: &'s dyn Progress,
}

impl Worker for Voter<'_> {
    fn frame(&mut self, _: usize, _: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let points = scan.points_in_sensor_m.iter().copied();
        let used: Vec<[f32; 3]> = points.filter(|&point| self.filter.check(point).is_ok()).collect();
        self.votes.lock().unwrap_or_else(PoisonError::into_inner).add_scan(used.into_iter());
        self.progress.advance(1);
        Ok(())
    }
}

/// Transforms the returns of scans into a run's world.
struct Locator<'s> {
    poser: Poser<'s>,
    probe: &'s DensityProbe,
    run: &'s str,
    progress: &'s dyn Progress,
}

impl Worker for Locator<'_> {
    fn frame(&mut self, _: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, probe, run, progress } = self;
        poser.blocks(frame, scan, |block| {
            let points = block.rays(0).iter().map(Ray::endpoint_in_world);
            probe.add(points).map_err(EvaluateError::map_of(run))
        })?;
        progress.advance(1);
        Ok(())
    }
}

/// Up to `count` of `total` ordinals, evenly spread.
pub(crate) fn spread(total: usize, count: usize) -> Vec<usize> {
    let count = count.min(total);
    (0..count).map(|k| k * total / count).collect()
}

/// Blocks of successive frames, evenly spread over the log, without overlap.
pub(crate) fn blocks_of(frames: &[PlannedFrame]) -> Vec<&[PlannedFrame]> {
    let (mut blocks, mut done) = (Vec::new(), 0);
    for start in spread(frames.len(), BLOCKS) {
        let start = start.max(done);
        let block = block_of(&frames[start..]);
        done = start + block.len();
        if !block.is_empty() {
            blocks.push(block);
        }
    }
    blocks
}

/// The first of these frames, as many as a block has.
pub(crate) fn block_of(frames: &[PlannedFrame]) -> &[PlannedFrame] {
    let (mut end, mut returns) = (0, 0);
    while end < frames.len() && end < BLOCK_SCANS && returns < BLOCK_RETURNS {
        returns += frames[end].returns;
        end += 1;
    }
    &frames[..end]
}
