mod drive;
mod heads;
mod segments;
mod select;
pub(crate) mod survey;

use dmp_log::ScanLog;
use dmp_sensor::{Isometry3, ReturnFilter};

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Reading};
use crate::pose::RunPoses;
use crate::sample::Looks;
use crate::watch::Watch;
pub(crate) use drive::Drive;
pub(crate) use heads::Heads;
pub(crate) use segments::Segments;
pub(crate) use select::Selection;

/// What is decided before anything is scored, once for all runs: the scans, the returns, the voxel, the
/// segments.
#[derive(Debug, Clone)]
pub(crate) struct Plan<'a> {
    /// Which scans, and what became of the others.
    pub(crate) selection: Selection,
    /// Where the sensor was, for each run.
    pub(crate) poses: Vec<RunPoses<'a>>,
    /// How the drive is cut.
    pub(crate) segments: Segments,
    /// Which returns are used.
    pub(crate) filter: ReturnFilter,
    /// The voxel edge and how it was chosen.
    pub(crate) voxel: VoxelChoice,
    /// Which of the scans are scored.
    pub(crate) looks: Looks,
    /// For every run, the frame that its trajectory was given in.
    pub(crate) own_from_world: Vec<Isometry3<f64>>,
}

/// The voxel edge and why it is that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VoxelChoice {
    /// The edge v, metres.
    pub(crate) voxel_m: f64,
    /// Share of returns in voxels with three or more in the sampled blocks; `None` where it was given.
    pub(crate) filled_share: Option<f64>,
}

impl<'a> Plan<'a> {
    /// Looks at log and runs and decides, for settings that were checked. Reads a sample of scans.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or nothing is left.
    pub(crate) fn new(
        log: &dyn ScanLog,
        runs: &'a [Run],
        own_from_world: &[Isometry3<f64>],
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<Self, EvaluateError> {
        let Drive { selection, poses, segments, .. } = Drive::new(Heads::Log(log), runs, config)?;
        let frames = selection.frames.as_slice();
        // At equal steps of the way, not of time: a vehicle that stands sees everything keep its place.
        let starts = segments.starts.iter().map(|&ordinal| frames[ordinal]);
        let filter = survey::filter(log, &starts.collect::<Vec<_>>(), segments.travel_m, config, watch)?;
        let voxel = survey::voxel(log, &survey::blocks_of(frames), runs, &poses, &filter, config, watch)?;
        let all = selection.frames.len() as u64;
        let looks = Looks::new(all, config.sample, config.seed, config.decide.is_some());
        let own_from_world = own_from_world.to_vec();
        Ok(Self { selection, poses, segments, filter, voxel, looks, own_from_world })
    }

    /// The scans to be scored.
    pub(crate) fn frames(&self) -> &[PlannedFrame] {
        &self.selection.frames
    }

    /// One reading of the planned scans.
    pub(crate) fn reading<'b>(
        &'b self,
        log: &'b dyn ScanLog,
        config: &Config,
        watch: &'b dyn Watch,
    ) -> Reading<'b> {
        Reading { log, frames: self.frames(), order: config.order, watch }
    }

    /// Returns of all planned scans, used or not.
    pub(crate) fn returns(&self) -> u64 {
        self.frames().iter().map(|frame| frame.returns).sum()
    }
}
