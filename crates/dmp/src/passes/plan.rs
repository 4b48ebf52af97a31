//! Decisions before scoring: which scans, returns, voxels and segments are used.
//!
//! A [`Plan`] follows from the log and the settings alone, and is the same for all runs. A [`RunPath`] is one run's own.

use dmp_log::{LogSummary, ScanLog};
use dmp_reduce::FrameSet;
use dmp_revisit::apart::Ruler;
use dmp_runs::{EvaluateError, Means, PlannedFrame, Progress, ReturnDraw, Selection, Settings};
use dmp_sensor::ReturnFilter;

use crate::passes::frames::Reading;
use crate::passes::survey::{Survey, Surveyed};

/// The decisions before scoring that follow from the log.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Which scans are in use, and why the others are not.
    pub(crate) selection: Selection,
    /// Which returns are used.
    pub(crate) filter: ReturnFilter,
    /// The voxel edge, and where returns lie.
    pub(crate) surveyed: Surveyed,
    /// Which of their returns are cast.
    pub(crate) draw: ReturnDraw,
}

impl Plan {
    /// Plans the score of some scans of a log; `voxel_m` is the voxel edge if it is already known. Reads a sample of
    /// scans.
    ///
    /// # Errors
    /// When the log cannot be read.
    pub(crate) fn new(
        log: &dyn ScanLog,
        selection: Selection,
        voxel_m: Option<f64>,
        settings: &Settings,
        pool: &rayon::ThreadPool,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluateError> {
        let survey = Survey { log, settings, pool, progress };
        let (filter, surveyed) = survey.look(&selection.frames, voxel_m)?;
        Ok(Self::surveyed(selection, filter, surveyed, settings))
    }

    /// The plan where the survey was made before.
    pub(crate) fn surveyed(
        selection: Selection,
        filter: ReturnFilter,
        surveyed: Surveyed,
        settings: &Settings,
    ) -> Self {
        let returns = selection.frames.iter().map(|frame| frame.returns).sum();
        let draw = settings.returns.draw((returns, selection.frames.len()), settings.seed);
        Self { selection, filter, surveyed, draw }
    }

    /// With what runs are laid against each other.
    pub(crate) fn ruler(&self, log: &LogSummary, settings: &Settings) -> Ruler {
        Ruler::of(settings.scales, log.camera.is_some(), self.surveyed.returns)
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
        Reading { log, drawn: None, frames: self.frames(), order: means.order, progress }
    }

    /// Number of returns of some of them.
    pub(crate) fn returns_of(&self, frames: &FrameSet) -> u64 {
        frames.iter().map(|ordinal| self.frames()[ordinal].returns).sum()
    }
}
