//! The state of an evaluation between its passes. Each pass is a method in a file of its own.

use std::sync::Arc;

use dmp_log::ScanLog;
use dmp_map::Store;
use dmp_runs::{
    Config, EvaluateError, Heads, Means, PosedRun, Progress, Run, Selection, Settings, Sink, Watch,
    check_runs, own_frame,
};
use dmp_sensor::ReturnCounts;

use crate::drawn::KeptReturns;
use crate::means::{Extent, Work};
use crate::passes::given;
use crate::passes::plan::Plan;

/// A log, the runs to score on it, and the progress so far: `M` is the type of each run's map at this stage.
/// A pass takes an evaluation and returns one at the next stage.
pub(crate) struct Evaluation<'a, M> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) settings: Settings,
    pub(crate) means: Means,
    pub(crate) progress: &'a dyn Progress,
    pub(crate) sink: &'a dyn Sink,
    pub(crate) plan: Plan,
    pub(crate) runs: Vec<PosedRun<'a, M>>,
    pub(crate) fused: FuseTotals,
    pub(crate) kept: KeptReturns,
    /// Dropped last: the maps of the runs lie in its folder.
    pub(crate) work: Arc<Work>,
}

/// Totals of fusing all maps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FuseTotals {
    /// The return counts; `None` when no map had to be fused.
    pub(crate) counts: Option<ReturnCounts>,
    /// Bytes spilled to disk.
    pub(crate) scratch_bytes: u64,
}

/// An evaluation before it has a plan.
pub(crate) struct Task<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) settings: Settings,
    pub(crate) means: Means,
    pub(crate) work: Arc<Work>,
    pub(crate) watch: Watch<'a>,
}

impl<'a> Task<'a> {
    /// Resolves the settings for a log and creates a work folder.
    ///
    /// # Errors
    /// When a setting is invalid, alone or with the others.
    pub(crate) fn open(
        log: &'a dyn ScanLog,
        runs: &[Run],
        config: &Config,
        watch: Watch<'a>,
    ) -> Result<Self, EvaluateError> {
        let (settings, means) = config.on(log.summary())?;
        Self::with(log, runs, settings, means, watch)
    }

    /// The same with resolved settings.
    ///
    /// # Errors
    /// When the settings do not fit the runs.
    pub(crate) fn with(
        log: &'a dyn ScanLog,
        runs: &[Run],
        settings: Settings,
        means: Means,
        watch: Watch<'a>,
    ) -> Result<Self, EvaluateError> {
        check_runs(runs)?;
        let extent = Extent::of_runs(runs, &settings, &means)?;
        let work = Arc::new(Work::open(log, runs, &settings, &means, extent)?);
        Ok(Self { log, settings, means, work, watch })
    }

    /// Runs `task`. If it fails, the checkpoint stays for another process, and the watcher receives its path.
    pub(crate) fn keeping<T>(
        self,
        what: impl FnOnce(Self) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        let (work, progress) = (Arc::clone(&self.work), self.watch.progress);
        if work.is_resumed() {
            let text = format!("resuming from {}", work.path().display());
            progress.note(&text.into());
        }
        what(self).inspect_err(|_| {
            if let Some(work) = Arc::into_inner(work) {
                work.leave(progress);
            }
        })
    }

    /// Selects scans, returns and voxels by the log, and segments and canonical frame of each run by its own path.
    ///
    /// # Errors
    /// When log and runs do not belong together.
    pub(crate) fn plan(self, runs: &'a [Run]) -> Result<Evaluation<'a, Option<Store>>, EvaluateError> {
        let stores = given::given_stores(runs)?;
        let voxel_m = given::voxel_of_stores(runs, &stores, self.settings.voxel_m)?;
        let selection = Selection::new(Heads::Log(self.log), &self.settings)?;
        let runs = own_frame::place(Heads::Log(self.log), &selection.frames, runs, stores, &self.settings)?;
        let voxel_m = voxel_m.or(self.settings.voxel_m);
        self.plan_placed(selection, runs, voxel_m)
    }

    /// The same for runs that already have their frames; `voxel_m` is the voxel edge if it is already known.
    pub(crate) fn plan_placed<M>(
        self,
        selection: Selection,
        runs: Vec<PosedRun<'a, M>>,
        voxel_m: Option<f64>,
    ) -> Result<Evaluation<'a, M>, EvaluateError> {
        let (settings, progress) = (&self.settings, self.watch.progress);
        let plan = Plan::new(self.log, selection, voxel_m, settings, self.work.pool(), progress)?;
        Ok(self.planned(plan, runs))
    }

    /// The evaluation with this plan.
    pub(crate) fn planned<M>(self, plan: Plan, runs: Vec<PosedRun<'a, M>>) -> Evaluation<'a, M> {
        let Self { log, settings, means, work, watch: Watch { progress, sink } } = self;
        let (fused, kept) = (FuseTotals::default(), KeptReturns::default());
        Evaluation { log, settings, means, progress, sink, plan, runs, fused, kept, work }
    }
}

impl<'a, M> Evaluation<'a, M> {
    /// Whether some run has a pose for a scan.
    pub(crate) fn uses(&self, ordinal: usize) -> bool {
        self.runs.iter().any(|run| run.path.has(ordinal))
    }

    /// Returns of all scans that some run has a pose for, used or not.
    pub(crate) fn returns(&self) -> u64 {
        let frames = self.plan.frames().iter().enumerate();
        frames.filter(|(ordinal, _)| self.uses(*ordinal)).map(|(_, frame)| frame.returns).sum()
    }

    /// The same evaluation with runs whose maps are at another stage.
    pub(crate) fn with_runs<N>(self, runs: Vec<PosedRun<'a, N>>) -> Evaluation<'a, N> {
        let Self { log, settings, means, work, progress, sink, plan, fused, kept, .. } = self;
        Evaluation { log, settings, means, progress, sink, plan, runs, fused, kept, work }
    }
}
