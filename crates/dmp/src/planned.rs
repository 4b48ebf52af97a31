//! A score whose passes are run apart, by another program or on another machine: what such a program needs of them.

use std::path::{Path, PathBuf};

use dmp_log::ScanLog;
use dmp_map::{Lattice, Store, SumsList};
use dmp_reduce::FrameSet;
use dmp_report::{MapReport, PassTimes, Report, SegmentReport};
use dmp_revisit::drift::{DriftReport, VisitPairReport};
use dmp_runs::{Config, EvaluateError, Heads, Means, Run, Selection, Settings, Watch, own_frame};
use dmp_sensor::{Isometry3, ReturnCounts, ReturnFilter};

use crate::passes::{
    Casting, Evaluation, FuseTotals, MapFacts, Plan, Revisits, RunMap, Surveyed, Task, TilesInReach, jobs_of,
};
use crate::results::{Findings, MapSummary, segment_report};

/// A score that is planned and not yet made. Runs go by their numbers, scans by their ordinals among those in use, in order
/// of time.
pub struct PlannedScore<'a>(Evaluation<'a, Option<Store>>);

/// A run of a [`PlannedScore`].
#[derive(Debug, Clone, Copy)]
pub struct PlacedRun<'s> {
    /// Its name.
    pub name: &'s str,
    /// Its name as a file name.
    pub file_stem: &'s str,
    /// From the world in which it is scored to the frame of its trajectory.
    pub own_from_world: Isometry3<f64>,
}

impl std::fmt::Debug for PlannedScore<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PlannedScore").field("settings", &self.0.settings).finish_non_exhaustive()
    }
}

impl<'a> PlannedScore<'a> {
    /// Makes every decision that [`evaluate`](crate::evaluate) makes before it fuses, from the same scans.
    ///
    /// # Errors
    /// As [`evaluate`](crate::evaluate).
    pub fn new(
        log: &'a dyn ScanLog,
        runs: &'a [Run],
        config: &Config,
        watch: impl Into<Watch<'a>>,
    ) -> Result<Self, EvaluateError> {
        let config = Config { checkpoint_every: None, resume: false, ..config.clone() };
        Ok(Self(Task::open(log, runs, &config, watch.into())?.plan(runs)?))
    }

    /// The same again with what was decided from scans, [`Self::filter`] and [`Self::voxel`]: no scan is read.
    ///
    /// # Errors
    /// When log and runs do not belong together.
    pub fn again(
        log: &'a dyn ScanLog,
        runs: &'a [Run],
        (settings, means): (Settings, Means),
        (filter, surveyed): (ReturnFilter, Surveyed),
        watch: impl Into<Watch<'a>>,
    ) -> Result<Self, EvaluateError> {
        let task = Task::with(log, runs, settings, means, watch.into())?;
        let stores = runs.iter().map(|_| None).collect();
        let selection = Selection::new(Heads::Log(log), &task.settings)?;
        let placed = own_frame::place(Heads::Log(log), &selection.frames, runs, stores, &task.settings)?;
        let plan = Plan::surveyed(selection, filter, surveyed, &task.settings);
        Ok(Self(task.planned(plan, placed)))
    }

    /// The settings, resolved on the log.
    pub fn settings(&self) -> &Settings {
        &self.0.settings
    }

    /// Which returns are used.
    pub fn filter(&self) -> &ReturnFilter {
        &self.0.plan.filter
    }

    /// The voxel edge and its reason.
    pub fn voxel(&self) -> Surveyed {
        self.0.plan.surveyed
    }

    /// The segments of each run's path.
    pub fn segments(&self) -> Vec<SegmentReport> {
        self.0.runs.iter().map(|run| segment_report(&run.path, self.0.plan.frames())).collect()
    }

    /// The runs.
    pub fn runs(&self) -> impl ExactSizeIterator<Item = PlacedRun<'_>> {
        (0..self.0.runs.len()).map(|number| self.run(number))
    }

    /// The run of this number.
    pub fn run(&self, number: usize) -> PlacedRun<'_> {
        let run = &self.0.runs[number];
        PlacedRun { name: run.name(), file_stem: &run.file_stem, own_from_world: run.own_from_world }
    }

    /// Number of scans in use.
    pub fn scans(&self) -> usize {
        self.0.plan.frames().len()
    }

    /// Number of returns of the scans that some run has a pose for, used or not.
    pub fn returns(&self) -> u64 {
        self.0.returns()
    }

    /// The place of a scan in the log.
    pub fn frame_in_log(&self, scan: usize) -> usize {
        self.0.plan.frames()[scan].frame
    }

    /// Returns of a scan, used or not.
    pub fn returns_of(&self, scan: usize) -> u64 {
        self.0.plan.frames()[scan].returns
    }

    /// The scans that are fused and cast: some run has a pose for each.
    pub fn used_scans(&self) -> FrameSet {
        (0..self.scans()).filter(|&scan| self.0.uses(scan)).collect()
    }

    /// Some scans, those together that are cheapest read together.
    pub fn jobs(&self, wanted: &FrameSet) -> Vec<Vec<usize>> {
        let Evaluation { plan, log, means, progress, .. } = &self.0;
        jobs_of(plan.reading(*log, means, *progress), |scan| wanted.contains(scan))
    }

    /// The grid of the maps.
    ///
    /// # Errors
    /// When the voxel edge is none.
    pub fn lattice(&self) -> Result<Lattice, EvaluateError> {
        Ok(Lattice::new(self.voxel().voxel_m)?)
    }

    /// Memory for one map that is fused, bytes.
    pub fn map_bytes(&self) -> usize {
        self.0.work.budget().map_bytes(1)
    }

    /// Least memory of a process that runs a pass, bytes.
    pub fn least_memory_bytes(&self) -> u64 {
        self.0.work.budget().memory_for_tiles(0)
    }

    /// Runs `what` on its threads.
    pub fn install<R: Send>(&self, what: impl FnOnce() -> R + Send) -> R {
        self.0.work.install(what)
    }

    /// Fuses some scans with the poses of every run and writes each run's sums to the file that `path` names for its file
    /// stem. Returns the counts of all their returns, and the content of each file.
    ///
    /// # Errors
    /// When the log cannot be read, or a file not be written.
    pub fn fuse(
        self,
        scans: &FrameSet,
        path: impl Fn(&str) -> PathBuf,
    ) -> Result<(ReturnCounts, Vec<SumsList>), EvaluateError> {
        self.0.fuse_part(scans, path)
    }

    /// The tiles of a run's map that casting some scans needs.
    ///
    /// # Errors
    /// When the voxel edge is none.
    pub fn reach(&self, run: usize, scans: &FrameSet) -> Result<TilesInReach, EvaluateError> {
        self.0.reach(run, scans)
    }

    /// The scans that casting some scans reads: these, and those whose rays show what moved around them.
    ///
    /// # Errors
    /// When the voxel edge is none.
    pub fn scans_to_cast(&self, scans: &FrameSet) -> Result<FrameSet, EvaluateError> {
        let mut all = self.0.followed_around(scans)?;
        all.merge(scans);
        Ok(all)
    }

    /// Casts the drawn returns of some scans into every run's map without what moved, which `map` opens or makes at a path where it may lie.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub fn cast<E: From<EvaluateError>>(
        mut self,
        scans: &FrameSet,
        map: impl Fn(&Self, usize, &Path) -> Result<Store, E>,
    ) -> Result<Casting, E> {
        let open = |number: usize| {
            let (path, _) = self.0.fused_file(&self.0.runs[number]);
            Ok(RunMap { store: map(&self, number, &path)?, facts: fused_facts(None) })
        };
        let maps: Vec<RunMap> = (0..self.0.runs.len()).map(open).collect::<Result<_, E>>()?;
        let runs = std::mem::take(&mut self.0.runs).into_iter().zip(maps);
        let runs = runs.map(|(run, map)| run.with_map(map).0).collect();
        let (maps, tiles) = self.0.with_runs(runs).without_trails_around(scans)?.casters();
        Ok(maps.cast_part(&tiles, scans)?)
    }

    /// The visits of a run to places that it had seen before.
    pub fn revisits(&self, run: usize) -> Revisits<'_> {
        Revisits::new(&self.0, run)
    }

    /// Whether drift is asked for.
    pub fn measures_drift(&self) -> bool {
        self.0.measures_drift()
    }

    /// The drift of all runs, given for each its [`Self::revisits`] and what was measured on the pairs of these.
    pub fn drift(&self, measured: Vec<(Vec<VisitPairReport>, Revisits<'_>)>) -> DriftReport {
        self.0.drift_report(measured)
    }

    /// The report of what all parts of the passes found. It equals that of [`evaluate`](crate::evaluate) to the bit, except
    /// for `timing`, `memory` and sums by tile, which it lacks.
    ///
    /// # Errors
    /// When parts share a scan, or are of other runs.
    pub fn report(
        mut self,
        fused: ReturnCounts,
        maps: Vec<MapReport>,
        cast: Vec<Casting>,
        total_s: f64,
    ) -> Result<Report, EvaluateError> {
        self.0.fused = FuseTotals { counts: Some(fused), scratch_bytes: 0 };
        let mut scored = self.0.put_together(cast)?;
        self.0.account(&mut scored)?;
        let Evaluation { log, settings, means, plan, runs, fused, .. } = &self.0;
        let summary = |report: MapReport| MapSummary { facts: fused_facts(report.thin_voxels), report };
        let runs: Vec<_> = runs.iter().zip(maps).map(|(run, map)| run.like(summary(map))).collect();
        let findings = Findings {
            heads: Heads::Log(*log),
            damage: &log.summary().damage,
            settings,
            means,
            plan,
            runs: &runs,
            fused: *fused,
            scored: &scored,
            timing: PassTimes { total_s, threads: means.threads, ..PassTimes::default() },
        };
        Ok(findings.report())
    }
}

fn fused_facts(thin_voxels: Option<u64>) -> MapFacts {
    MapFacts { fused: true, thin_voxels, ..MapFacts::default() }
}
