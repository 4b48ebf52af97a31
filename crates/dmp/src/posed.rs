//! The used returns of a log as rays: for those who make something else of them than scores.

use std::sync::Mutex;

use dmp_log::ScanLog;
use dmp_sensor::{DropReason, Isometry3, Ray, ReturnCounts, Scan};

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Worker, each_frame};
use crate::memory;
use crate::plan::Plan;
use crate::pose::Poser;
use crate::watch::{Stage, Watch};

/// A log with one run's poses: which scans and returns are used is decided as for [`evaluate`](crate::evaluate).
#[derive(Debug)]
pub struct PosedLog<'a> {
    log: &'a dyn ScanLog,
    plan: Plan<'a>,
    config: Config,
}

/// A scan that is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PosedScan {
    /// Its number in the log.
    pub number: usize,
    /// Its stamp with the time offset, nanoseconds; `None` where the log has none.
    pub stamp_ns: Option<i64>,
    /// Returns in it, used or not.
    pub returns: u64,
}

impl<'a> PosedLog<'a> {
    /// Decides which scans and returns are used, and the edge of voxels. Reads a sample of scans.
    ///
    /// # Errors
    /// As [`evaluate`](crate::evaluate) before it reads the log.
    pub fn new(
        log: &'a dyn ScanLog,
        run: &'a Run,
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<Self, EvaluateError> {
        let config = config.settled(log.summary());
        config.check()?;
        Ok(Self {
            log,
            plan: Plan::new(log, std::slice::from_ref(run), &[Isometry3::identity()], &config, watch)?,
            config,
        })
    }

    /// The settings as they take effect on this log.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Edge of the voxels that maps of this log are to have, metres.
    pub fn voxel_m(&self) -> f64 {
        self.plan.voxel.voxel_m
    }

    /// The scans in use, in order of time.
    pub fn scans(&self) -> impl ExactSizeIterator<Item = PosedScan> {
        self.plan.frames().iter().map(posed_scan)
    }

    /// Reads the log once and gives `take` the rays of every scan in use with the scan's place among
    /// [`Self::scans`], from several threads at once. Says what became of all returns.
    ///
    /// # Errors
    /// When the log cannot be read, and the first that `take` gives.
    pub fn each<E: From<EvaluateError> + Send>(
        &self,
        watch: &dyn Watch,
        take: &Take<'_, E>,
    ) -> Result<ReturnCounts, E> {
        watch.begin(Stage::Fuse, self.plan.returns());
        let failed = Mutex::new(None);
        let reading = self.plan.reading(self.log, &self.config, watch);
        let worker = || Taker {
            poser: Poser::new(&self.plan.poses, &self.plan.filter),
            rays: Vec::new(),
            take,
            failed: &failed,
            counts: ReturnCounts::default(),
            watch,
        };
        let workers = each_frame(reading, (0..self.config.threads).map(|_| worker()).collect());
        if let Some(error) = failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
            return Err(error);
        }
        let mut counts = ReturnCounts::default();
        workers?.iter().for_each(|worker| counts.merge(&worker.counts));
        counts.add_dropped(DropReason::ScanNotSelected, self.plan.selection.unselected_returns);
        counts.add_dropped(DropReason::ScanWithoutPose, self.plan.selection.unposed_returns);
        memory::look();
        Ok(counts)
    }
}

fn posed_scan(frame: &PlannedFrame) -> PosedScan {
    PosedScan { number: frame.number, stamp_ns: frame.stamp_ns, returns: frame.returns }
}

/// Is given a scan's place and rays.
type Take<'a, E> = dyn Fn(usize, &[Ray]) -> Result<(), E> + Sync + 'a;

/// What a thread does with a scan.
struct Taker<'a, E> {
    poser: Poser<'a>,
    rays: Vec<Ray>,
    take: &'a Take<'a, E>,
    /// What went wrong there first.
    failed: &'a Mutex<Option<E>>,
    counts: ReturnCounts,
    watch: &'a dyn Watch,
}

impl<E: From<EvaluateError> + Send> Worker for Taker<'_, E> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, rays, .. } = self;
        rays.clear();
        let counts = poser.blocks(frame, scan, |of_runs| {
            rays.extend_from_slice(&of_runs[0]);
            Ok::<(), EvaluateError>(())
        })?;
        if let Err(error) = (self.take)(ordinal, rays) {
            self.failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner).get_or_insert(error);
            // What it was is told to the one who asked.
            return Err(EvaluateError::Cancelled);
        }
        self.counts.merge(&counts);
        self.watch.advance(counts.total());
        Ok(())
    }
}
