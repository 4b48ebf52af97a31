//! A plan opened by a process that does a part of it.

use std::path::Path;

use dmp_log::ScanLog;
use dmp_map::{Lattice, Store};
use dmp_reduce::FrameSet;

use super::document::ShardPlan;
use super::error::ShardError;
use super::folder::PlanFolder;
use super::part::Part;
use super::stage::Stage;
use crate::config::{Config, Run};
use crate::evaluation::{Evaluation, Task};
use crate::frames::jobs_of;
use crate::heads::Heads;
use crate::own_frame;
use crate::plan::{Plan, Selection};
use crate::report::{SegmentReport, segment_report};
use crate::settings::Means;
use crate::watch::Watch;

/// A plan with its runs and its log, in the folder of its parts.
#[derive(Clone, Copy)]
pub struct Shard<'a> {
    pub(super) plan: &'a ShardPlan,
    pub(super) runs: &'a [Run],
    pub(super) log: &'a dyn ScanLog,
    pub(super) folder: PlanFolder<'a>,
    means: &'a Means,
    pub(super) watch: Watch<'a>,
}

impl std::fmt::Debug for Shard<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shard")
            .field("plan", &self.plan.hash())
            .field("folder", &self.folder)
            .finish_non_exhaustive()
    }
}

impl<'a> Shard<'a> {
    /// Opens a plan that was [checked](ShardPlan::check). `log` is the log that its [index](ShardPlan::index)
    /// opened, or the log [without its files](dmp_log::LogIndex::unopened) if no scan is read. The files of
    /// parts are in `folder`.
    pub fn new(
        plan: &'a ShardPlan,
        runs: &'a [Run],
        log: &'a dyn ScanLog,
        folder: &'a Path,
        means: &'a Means,
        watch: impl Into<Watch<'a>>,
    ) -> Self {
        let folder = PlanFolder { path: folder, plan: plan.hash() };
        Self { plan, runs, log, folder, means, watch: watch.into() }
    }

    /// The resources of a part, from the configuration of a score.
    pub fn means(config: &Config) -> Means {
        Means {
            memory_bytes: config.memory_bytes,
            threads: config.threads,
            work_folder: config.work_folder.clone(),
            save_maps: None,
            per_tile: false,
            checkpoint_every: None,
            resume: false,
            order: config.order,
        }
    }

    /// The evaluation as planned. What need not be read is computed again, with the same result.
    pub(super) fn planned(&self) -> Result<Evaluation<'a, Option<Store>>, ShardError> {
        let content = &self.plan.content;
        let settings = content.settings.clone();
        let task = Task::with(self.log, self.runs, settings, self.means.clone(), self.watch)?;
        let stores = self.runs.iter().map(|_| None).collect();
        let selection = Selection::new(Heads::Log(self.log), &task.settings)?;
        let placed =
            own_frame::place(Heads::Log(self.log), &selection.frames, self.runs, stores, &task.settings)?;
        let plan = Plan::surveyed(selection, content.filter.clone(), content.voxel, &task.settings);
        let segments: Vec<SegmentReport> =
            placed.iter().map(|run| segment_report(&run.path, plan.frames())).collect();
        if segments != content.segments || plan.frames().len() as u64 != content.scans {
            return Err(ShardError::OtherSegments);
        }
        Ok(task.planned(plan, placed))
    }

    pub(super) fn lattice(&self) -> Result<Lattice, ShardError> {
        Ok(Lattice::new(self.plan.content.voxel.voxel_m)?)
    }

    /// The frames of a part: the wanted ones divided by their returns; frames that are read together stay
    /// together.
    pub(super) fn share<M>(
        &self,
        planned: &Evaluation<'_, M>,
        part: Part,
        wanted: impl Fn(usize) -> bool,
    ) -> FrameSet {
        let plan = &planned.plan;
        let jobs = jobs_of(plan.reading(self.log, self.means, self.watch.progress), |ordinal| {
            planned.uses(ordinal) && wanted(ordinal)
        });
        let returns =
            |job: &Vec<usize>| job.iter().map(|&ordinal| plan.frames()[ordinal].returns).sum::<u64>();
        let share = part.share(&jobs.iter().map(returns).collect::<Vec<_>>());
        jobs[share].iter().flatten().copied().collect()
    }
}

/// Checks that the parts have every frame exactly once.
pub(super) fn check_frames<'f>(
    stage: Stage,
    parts: impl IntoIterator<Item = &'f FrameSet>,
    wanted: &FrameSet,
) -> Result<(), ShardError> {
    let mut all = FrameSet::default();
    for frames in parts {
        if let Some(scan) = all.first_in_common(frames) {
            return Err(ShardError::ScanTwice { stage, scan });
        }
        all.merge(frames);
    }
    if all != *wanted {
        let there = wanted.iter().filter(|&ordinal| all.contains(ordinal)).count() as u64;
        let scans = wanted.len();
        return Err(ShardError::ScansMissing { stage, missing: scans - there, scans });
    }
    Ok(())
}
