mod segments;
mod select;
mod survey;

use dmp_log::ScanLog;
use dmp_sensor::ReturnFilter;

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Reading};
use crate::pose::RunPoses;
use crate::sample::Looks;
use crate::watch::Watch;
use segments::{cut_segments, median};
use select::{Selection, select};

/// What is decided before anything is scored, once for all runs: the scans, the returns, the voxel, the
/// segments.
#[derive(Debug, Clone)]
pub(crate) struct Plan<'a> {
    /// Which scans, and what became of the others.
    pub(crate) selection: Selection,
    /// Where the sensor was, for each run.
    pub(crate) poses: Vec<RunPoses<'a>>,
    /// How the drive is cut.
    pub(crate) segments: Segments,
    /// Which returns are used.
    pub(crate) filter: ReturnFilter,
    /// The voxel edge and how it was chosen.
    pub(crate) voxel: VoxelChoice,
    /// Which of the scans are scored.
    pub(crate) looks: Looks,
}

/// How the drive is cut into segments, the same for all runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segments {
    /// Length asked for or found, metres; `None` where every scan is a segment of its own.
    pub(crate) length_m: Option<f64>,
    /// Whether a length was asked for.
    pub(crate) given: bool,
    /// Ordinals of the frames that begin a segment.
    pub(crate) starts: Vec<usize>,
    /// The median over the runs of the way from scan to scan, added up, metres.
    pub(crate) travel_m: f64,
}

/// The voxel edge and why it is that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VoxelChoice {
    /// The edge v, metres.
    pub(crate) voxel_m: f64,
    /// Share of returns in voxels with three or more in the sampled blocks; `None` where it was given.
    pub(crate) filled_share: Option<f64>,
}

impl<'a> Plan<'a> {
    /// Looks at log and runs and decides, for settings that were checked. Reads a sample of scans.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or nothing is left.
    pub(crate) fn new(
        log: &dyn ScanLog,
        runs: &'a [Run],
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<Self, EvaluateError> {
        check_runs(runs, config)?;
        if log.frames().is_empty() {
            return Err(EvaluateError::NoScans { path: log.summary().path.clone() });
        }
        let poses = runs.iter().map(|run| RunPoses::new(log, run, config)).collect::<Result<Vec<_>, _>>()?;
        let mut selection = select(log, runs, &poses, config)?;
        let steps_m = steps_m(&selection.frames, &poses);
        let segments = cut_segments(&steps_m, config.segment_m, &mut selection.frames);
        let filter = survey::filter(log, &selection.frames, &segments, config, watch)?;
        let voxel = survey::voxel(log, &selection.frames, runs, &poses, &filter, config, watch)?;
        let all = selection.frames.len() as u64;
        let looks = Looks::new(all, config.sample, config.seed, config.decide.is_some());
        Ok(Self { selection, poses, segments, filter, voxel, looks })
    }

    /// The scans to be scored.
    pub(crate) fn frames(&self) -> &[PlannedFrame] {
        &self.selection.frames
    }

    /// One reading of the planned scans.
    pub(crate) fn reading<'b>(
        &'b self,
        log: &'b dyn ScanLog,
        config: &Config,
        watch: &'b dyn Watch,
    ) -> Reading<'b> {
        Reading { log, frames: self.frames(), order: config.order, watch }
    }

    /// Returns of all planned scans, used or not.
    pub(crate) fn returns(&self) -> u64 {
        self.frames().iter().map(|frame| frame.returns).sum()
    }
}

/// The way from each scan to the next: the median over the runs.
fn steps_m(frames: &[PlannedFrame], poses: &[RunPoses<'_>]) -> Vec<f64> {
    let place = |frame: &PlannedFrame, run: &RunPoses<'_>| Some(run.of_frame(frame)?.translation.vector);
    let step = |pair: &[PlannedFrame]| {
        let of_run = |run| Some((place(&pair[1], run)? - place(&pair[0], run)?).norm());
        median(poses.iter().filter_map(of_run).collect())
    };
    frames.windows(2).map(step).collect()
}

/// What a run cannot be called: the words that stand for no run in a report's verdicts.
const RESERVED_NAMES: [&str; 2] = ["mixed", "undecided"];

fn check_runs(runs: &[Run], config: &Config) -> Result<(), EvaluateError> {
    if runs.is_empty() {
        return Err(EvaluateError::NoRuns);
    }
    for (k, run) in runs.iter().enumerate() {
        if runs[..k].iter().any(|other| other.name == run.name) {
            return Err(EvaluateError::SameName { name: run.name.clone() });
        }
        if RESERVED_NAMES.contains(&run.name.as_str()) {
            return Err(EvaluateError::ReservedName { name: run.name.clone() });
        }
    }
    if config.decide.is_some() && runs.len() < 2 {
        let why = "there must be two runs at least to decide between";
        return Err(EvaluateError::Setting { setting: "decide", value: "with one run".to_owned(), why });
    }
    if let Some((a, b)) = config.decide.as_ref().and_then(|decide| decide.pair.as_ref()) {
        let is_run = |name: &String| runs.iter().any(|run| run.name == *name);
        if a == b || !is_run(a) || !is_run(b) {
            let value = format!("{a},{b}");
            return Err(EvaluateError::Setting {
                setting: "decide",
                value,
                why: "it must name two of the runs",
            });
        }
    }
    Ok(())
}
