//! A plan opened by a process that does a part of it.

use std::path::Path;

use dmp::{Config, Means, PlannedScore, Run, Watch};
use dmp_log::ScanLog;
use dmp_reduce::FrameSet;

use super::document::ShardPlan;
use super::error::ShardError;
use super::folder::PlanFolder;
use super::part::Part;
use super::stage::Stage;
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
        let alone = Config {
            save_maps: None,
            per_tile: false,
            checkpoint_every: None,
            resume: false,
            ..config.clone()
        };
        alone.means()
    }

    /// The score as planned. What need not be read is computed again, with the same result.
    pub(super) fn planned(&self) -> Result<PlannedScore<'a>, ShardError> {
        let content = &self.plan.content;
        let with = (content.settings.clone(), self.means.clone());
        let decided = (content.filter.clone(), content.voxel);
        let planned = PlannedScore::again(self.log, self.runs, with, decided, self.watch)?;
        if planned.segments() != content.segments || planned.scans() as u64 != content.scans {
            return Err(ShardError::OtherSegments);
        }
        Ok(planned)
    }

    /// The frames of a part: the wanted ones divided by their returns; frames that are read together stay
    /// together.
    pub(super) fn share(planned: &PlannedScore<'_>, part: Part, wanted: &FrameSet) -> FrameSet {
        let jobs = planned.jobs(wanted);
        let returns = |job: &Vec<usize>| job.iter().map(|&scan| planned.returns_of(scan)).sum::<u64>();
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
