//! Decisions before scoring: which scans, returns, voxels and segments are used.

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

/// The decisions before scoring, made once for all runs.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Which scans are in use, and why the others are not.
    pub(crate) selection: Selection,
    /// The segments.
    pub(crate) segments: Segments,
    /// For each scan in use the path length up to it, metres.
    pub(crate) along_m: Vec<f64>,
    /// Which returns are used.
    pub(crate) filter: ReturnFilter,
    /// The voxel edge and its origin.
    pub(crate) voxel: VoxelChoice,
    /// Which of the scans are scored.
    pub(crate) looks: Looks,
}

impl Plan {
    /// Plans from log and runs; `voxel_m` is the voxel edge if it is already known. Reads a sample of scans.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or no scan remains.
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
        // At equal steps of distance, not of time: while a vehicle stands, static returns look like its own
        // body.
        let starts = segments.starts.iter().map(|&ordinal| frames[ordinal]);
        let filter = survey.filter(&starts.collect::<Vec<_>>(), segments.travel_m)?;
        let voxel = survey.voxel(voxel_m, &survey::blocks_of(frames), runs, &filter)?;
        Ok(Self::surveyed(drive, filter, voxel, settings))
    }

    /// The plan of a drive whose scans were surveyed.
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

    /// Number of returns of some of them.
    pub(crate) fn returns_of(&self, frames: &FrameSet) -> u64 {
        frames.iter().map(|ordinal| self.frames()[ordinal].returns).sum()
    }

    /// Returns of all planned scans, used or not.
    pub(crate) fn returns(&self) -> u64 {
        self.frames().iter().map(|frame| frame.returns).sum()
    }
}
