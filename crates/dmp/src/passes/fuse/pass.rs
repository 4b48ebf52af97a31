//! One pass over the log that fuses the maps.

use dmp_map::{FuseBuffers, MapFuser, ScanSample};
use dmp_reduce::FrameSet;
use dmp_runs::{EvaluateError, PlannedFrame, PosedRun, Poser, Stage, WorldPoint, posed};
use dmp_sensor::{ReturnCounts, Scan};

use super::checkpoint::Fusing;
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Pauses, Worker, each_frame_in_parts, jobs_of};

/// The source of a run's map.
pub(super) enum Making<G> {
    /// The scans.
    Scans(MapFuser),
    /// The given map.
    Given(G),
}

impl<G> Making<G> {
    fn fuser(&self) -> Option<&MapFuser> {
        match self {
            Self::Scans(fuser) => Some(fuser),
            Self::Given(_) => None,
        }
    }
}

/// One pass over the log, or over some `frames` of it.
pub(super) struct FusePass<'p, G> {
    pub(super) evaluation: &'p Evaluation<'p, Making<G>>,
    /// `None`: all.
    pub(super) frames: Option<&'p FrameSet>,
}

impl<G: Sync> FusePass<'_, G> {
    /// Resumes from `before`. Returns the return counts.
    pub(super) fn run(&self, before: &Fusing) -> Result<ReturnCounts, EvaluateError> {
        let Evaluation { log, means, work, progress, plan, runs, .. } = self.evaluation;
        let returns = self.frames.map_or(self.evaluation.returns(), |frames| plan.returns_of(frames));
        progress.begin(Stage::Fuse, returns);
        progress.advance(before.counts.total());
        let state = |workers: &[FuseWorker<'_, G>]| {
            let mut counts = before.counts;
            workers.iter().for_each(|worker| counts.merge(&worker.counts));
            counts
        };
        let put_down = |workers: &[FuseWorker<'_, G>], done: &FrameSet| {
            let put_down = |run: &PosedRun<'_, Making<G>>| {
                let state = run.map.fuser().map(MapFuser::put_down).transpose();
                state.map_err(EvaluateError::map_of(run.name()))
            };
            let fusers = runs.iter().map(put_down).collect::<Result<_, _>>()?;
            work.save(&Fusing { done: done.clone(), counts: state(workers), fusers })
        };
        let workers = (0..means.threads).map(|_| FuseWorker::new(self)).collect();
        let pauses = Pauses {
            every: work.every(),
            done: before.done.clone(),
            keep: &mut |w, done| put_down(w, done),
            ahead: &|_| (),
        };
        let reading = plan.reading(*log, means, *progress);
        let is_wanted = |ordinal| {
            self.evaluation.uses(ordinal) && self.frames.is_none_or(|frames| frames.contains(ordinal))
        };
        let jobs = jobs_of(reading, |ordinal| is_wanted(ordinal) && !pauses.done.contains(ordinal));
        let (workers, done) = each_frame_in_parts(reading, jobs, workers, pauses)?;
        if work.due() {
            put_down(&workers, &done)?;
        }
        Ok(state(&workers))
    }
}

/// Work of a thread on a scan: adds its returns to the map of every run that has a pose for them.
struct FuseWorker<'p, G> {
    poser: Poser<'p, WorldPoint>,
    evaluation: &'p Evaluation<'p, Making<G>>,
    buffers: FuseBuffers,
    points: Vec<WorldPoint>,
    /// Of the scan at work, by run.
    samples: Vec<ScanSample>,
    counts: ReturnCounts,
}

impl<'p, G> FuseWorker<'p, G> {
    fn new(pass: &FusePass<'p, G>) -> Self {
        let evaluation = pass.evaluation;
        Self {
            poser: Poser::new(posed(&evaluation.runs), &evaluation.plan.filter),
            evaluation,
            buffers: FuseBuffers::default(),
            points: Vec::new(),
            samples: evaluation.runs.iter().map(|_| ScanSample::default()).collect(),
            counts: ReturnCounts::default(),
        }
    }
}

impl<G: Sync> Worker for FuseWorker<'_, G> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self { poser, evaluation, buffers, points, samples, .. } = self;
        let segments =
            || evaluation.runs.iter().map(|run| Some((run.map.fuser()?, run.path.segment(ordinal)?)));
        let counts = poser.blocks((ordinal, frame), scan, |block| {
            for (number, (of_run, scan)) in segments().zip(&mut *samples).enumerate() {
                let Some((fuser, segment)) = of_run else { continue };
                let posed = if block.is_posed(number).contains(&false) {
                    points.clear();
                    points.extend(block.posed(number).map(|(_, point)| point));
                    points.as_slice()
                } else {
                    block.rays(number)
                };
                let added = fuser.add_block(posed, Some(segment), buffers, scan);
                added.map_err(EvaluateError::map_of(evaluation.runs[number].name()))?;
            }
            Ok::<(), EvaluateError>(())
        })?;
        for (of_run, scan) in segments().zip(samples) {
            if let Some((fuser, segment)) = of_run {
                fuser.end_scan(Some(segment), scan);
            }
        }
        evaluation.kept.keep((ordinal, frame), scan)?;
        self.counts.merge(&counts);
        self.evaluation.progress.advance(counts.total());
        Ok(())
    }
}
