//! What is decided before anything is scored: which scans, which returns, which voxels and segments.

mod drive;
mod segments;
mod select;
mod survey;

use dmp_log::ScanLog;
use dmp_reduce::FrameSet;
use dmp_sensor::ReturnFilter;

use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Reading};
use crate::heads::Heads;
use crate::progress::Progress;
use crate::run_state::RunState;
use crate::sample::Looks;
use crate::settings::{Means, Settings};
pub(crate) use drive::Drive;
pub(crate) use segments::Segments;
pub(crate) use select::Selection;
pub(crate) use survey::{BLOCK_RETURNS, BLOCK_SCANS, BLOCKS, Survey, VoxelChoice, block_of, spread};

/// What is decided before anything is scored, once for all runs.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Which scans, and what became of the others.
    pub(crate) selection: Selection,
    /// How the drive is cut.
    pub(crate) segments: Segments,
    /// For each scan in use the way up to it, metres.
    pub(crate) along_m: Vec<f64>,
    /// Which returns are used.
    pub(crate) filter: ReturnFilter,
    /// The voxel edge and how it was chosen.
    pub(crate) voxel: VoxelChoice,
    /// Which of the scans are scored.
    pub(crate) looks: Looks,
}

impl Plan {
    /// Looks at log and runs and decides; `voxel_m` is the edge of voxels where that is decided already. Reads a sample of
    /// scans.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or nothing is left.
    pub(crate) fn new<M>(
        log: &dyn ScanLog,
        runs: &mut [RunState<'_, M>],
        voxel_m: Option<f64>,
        settings: &Settings,
        pool: &rayon::ThreadPool,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluateError> {
        let drive = Drive::new(Heads::Log(log), runs, settings)?;
        let (frames, segments) = (drive.frames(), &drive.segments);
        let survey = Survey { log, settings, pool, progress };
        // At equal steps of the way, not of time: a vehicle that stands sees everything keep its place.
        let starts = segments.starts.iter().map(|&ordinal| frames[ordinal]);
        let filter = survey.filter(&starts.collect::<Vec<_>>(), segments.travel_m)?;
        let voxel = survey.voxel(voxel_m, &survey::blocks_of(frames), runs, &filter)?;
        Ok(Self::surveyed(drive, filter, voxel, settings))
    }

    /// The plan of a drive of which scans were looked at.
    pub(crate) fn surveyed(
        drive: Drive,
        filter: ReturnFilter,
        voxel: VoxelChoice,
        settings: &Settings,
    ) -> Self {
        let Drive { selection, segments, along_m } = drive;
        let all = selection.frames.len() as u64;
        let looks = Looks::new(all, settings.sample, settings.seed, settings.decide.is_some());
        Self { selection, segments, along_m, filter, voxel, looks }
    }

    /// The scans in use, in order of time.
    pub(crate) fn frames(&self) -> &[PlannedFrame] {
        &self.selection.frames
    }

    /// One reading of the planned scans.
    pub(crate) fn reading<'b>(
        &'b self,
        log: &'b dyn ScanLog,
        means: &Means,
        progress: &'b dyn Progress,
    ) -> Reading<'b> {
        Reading { log, frames: self.frames(), order: means.order, progress }
    }

    /// Returns of some of them.
    pub(crate) fn returns_of(&self, frames: &FrameSet) -> u64 {
        frames.iter().map(|ordinal| self.frames()[ordinal].returns).sum()
    }

    /// Returns of all planned scans, used or not.
    pub(crate) fn returns(&self) -> u64 {
        self.frames().iter().map(|frame| frame.returns).sum()
    }
}
