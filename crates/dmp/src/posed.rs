//! Provides the used returns of a log as rays, for purposes other than scores.

use std::sync::{Mutex, PoisonError};

use dmp_log::ScanLog;
use dmp_runs::{
    Config, EvaluateError, Heads, Means, PlannedFrame, PosedRun, Poser, Progress, Run, RunPath, RunPoses,
    Selection, Settings, Stage, Watch, on_log_clock, posed,
};
use dmp_sensor::{DropReason, Isometry3, Ray, ReturnCounts, Scan};

use crate::means::peak;
use crate::passes::{Evaluation, Task, Worker, each_frame};

/// A log with one run's poses. Scans and returns are selected as by [`evaluate`](crate::evaluate); the poses
/// are used as given.
pub struct PosedLog<'a> {
    /// Its scans in use are those with a pose.
    evaluation: Evaluation<'a, ()>,
    /// Returns of the others.
    unposed_returns: u64,
}

/// A used scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PosedScan {
    /// Its number in the log.
    pub number: usize,
    /// Its stamp with the time offset, nanoseconds; `None` if the log has none.
    pub stamp_ns: Option<i64>,
    /// Returns in it, used or not.
    pub returns: u64,
}

impl<'a> PosedLog<'a> {
    /// Selects scans, returns and the voxel edge. Reads a sample of scans.
    ///
    /// # Errors
    /// As [`evaluate`](crate::evaluate) before it reads the log.
    pub fn new(
        log: &'a dyn ScanLog,
        run: &'a Run,
        config: &Config,
        watch: impl Into<Watch<'a>>,
    ) -> Result<Self, EvaluateError> {
        let runs = std::slice::from_ref(run);
        // Nothing is resumed or checkpointed. Scans between keyframes are interpolated over any gap: the
        // compared graphs all have the same keyframes.
        let max_time_gap_ns = config.max_time_gap_ns.unwrap_or_else(|| run.trajectory.usual_gap_ns());
        let config = Config {
            checkpoint_every: None,
            resume: false,
            max_time_gap_ns: Some(max_time_gap_ns),
            ..config.clone()
        };
        let task = Task::open(log, runs, &config, watch.into())?;
        let on_clock = on_log_clock(Heads::Log(log), run, run.trajectory.clone(), &task.settings)?;
        let poses = RunPoses::new(run, on_clock, &task.settings);
        let mut selection = Selection::new(Heads::Log(log), &task.settings)?;
        let path = RunPath::new(Heads::Log(log), &selection.frames, (run, &poses), &task.settings)?;
        let all = std::mem::take(&mut selection.frames).into_iter().enumerate();
        let (kept, unposed): (Vec<_>, Vec<_>) = all.partition(|(ordinal, _)| path.has(*ordinal));
        selection.frames = kept.into_iter().map(|(_, frame)| frame).collect();
        let unposed_returns = unposed.iter().map(|(_, frame)| frame.returns).sum();
        let voxel_m = task.settings.voxel_m;
        let runs = vec![PosedRun::new(runs, 0, (poses, path.posed_only()), ())];
        Ok(Self { evaluation: task.plan_placed(selection, runs, voxel_m)?, unposed_returns })
    }

    /// The resolved settings on this log.
    pub fn settings(&self) -> &Settings {
        &self.evaluation.settings
    }

    /// The resources.
    pub fn means(&self) -> &Means {
        &self.evaluation.means
    }

    /// Edge of the voxels for maps of this log, metres.
    pub fn voxel_m(&self) -> f64 {
        self.evaluation.plan.surveyed.voxel_m
    }

    /// The scans in use, in order of time.
    pub fn scans(&self) -> impl ExactSizeIterator<Item = PosedScan> {
        self.evaluation.plan.frames().iter().map(posed_scan)
    }

    /// The path length up to each of them, metres.
    pub fn along_m(&self) -> &[f64] {
        &self.evaluation.runs[0].path.along_m
    }

    /// The body's pose in the run's own world at one of [`Self::scans`], and its position among the run's own
    /// poses: the number of a pose, with a fraction between two. `None` without a pose.
    pub fn body_at(&self, ordinal: usize) -> Option<(f64, Isometry3<f64>)> {
        let frame = self.evaluation.plan.frames().get(ordinal)?;
        self.evaluation.runs.first()?.poses.body_of_frame(frame)
    }

    /// Reads the log once and passes `take` the rays of every scan in use with its index in [`Self::scans`],
    /// from several threads at once. Returns the counts of all returns.
    ///
    /// # Errors
    /// When the log cannot be read, and the first error of `take`.
    pub fn each<E: From<EvaluateError> + Send>(&self, take: &Take<'_, E>) -> Result<ReturnCounts, E> {
        let Evaluation { log, means, plan, runs, progress, .. } = &self.evaluation;
        progress.begin(Stage::Fuse, self.evaluation.returns());
        let failed = Mutex::new(None);
        let worker = |_| Taker {
            poser: Poser::new(posed(runs), &plan.filter),
            rays: Vec::new(),
            take,
            failed: &failed,
            counts: ReturnCounts::default(),
            progress: *progress,
        };
        let workers = (0..means.threads).map(worker).collect();
        let workers = each_frame(plan.reading(*log, means, *progress), workers);
        if let Some(error) = failed.lock().unwrap_or_else(PoisonError::into_inner).take() {
            return Err(error);
        }
        let mut counts = ReturnCounts::default();
        workers?.iter().for_each(|worker| counts.merge(&worker.counts));
        counts.add_dropped(DropReason::ScanNotSelected, plan.selection.unselected_returns);
        counts.add_dropped(DropReason::ScanWithoutPose, self.unposed_returns);
        peak::look();
        Ok(counts)
    }
}

impl std::fmt::Debug for PosedLog<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PosedLog").field("settings", &self.evaluation.settings).finish_non_exhaustive()
    }
}

fn posed_scan(frame: &PlannedFrame) -> PosedScan {
    PosedScan { number: frame.number, stamp_ns: frame.stamp_ns, returns: frame.returns }
}

/// Called with a scan's index and its rays.
type Take<'a, E> = dyn Fn(usize, &[Ray]) -> Result<(), E> + Sync + 'a;

/// Work of a thread on a scan.
struct Taker<'a, E> {
    poser: Poser<'a>,
    rays: Vec<Ray>,
    take: &'a Take<'a, E>,
    /// The first error of `take`.
    failed: &'a Mutex<Option<E>>,
    counts: ReturnCounts,
    progress: &'a dyn Progress,
}

impl<E: From<EvaluateError> + Send> Worker for Taker<'_, E> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, rays, .. } = self;
        rays.clear();
        let mut counts = poser.blocks((ordinal, frame), scan, |block| {
            rays.extend(block.posed(0).map(|(_, ray)| *ray));
            Ok::<(), EvaluateError>(())
        })?;
        counts.drop_used(DropReason::NoPose, counts.used() - rays.len() as u64);
        if let Err(error) = (self.take)(ordinal, rays) {
            self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            // The caller gets the original error.
            return Err(EvaluateError::Cancelled);
        }
        self.counts.merge(&counts);
        self.progress.advance(counts.total());
        Ok(())
    }
}
