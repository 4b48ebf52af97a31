use super::heads::Heads;
use super::segments::{Segments, cut_segments, median, take_segments};
use super::select::{Selection, select};
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::pose::RunPoses;

/// What log and trajectories say of a drive before a scan is read.
#[derive(Debug, Clone)]
pub(crate) struct Drive<'a> {
    /// Which scans are in use, and what became of the others.
    pub(crate) selection: Selection,
    /// Where the sensor was, for each run.
    pub(crate) poses: Vec<RunPoses<'a>>,
    /// How the drive is cut.
    pub(crate) segments: Segments,
    /// For each scan in use the way up to it, metres: the median over the runs from scan to scan, added up.
    pub(crate) along_m: Vec<f64>,
}

impl<'a> Drive<'a> {
    /// Looks at the heads of a log's scans and at the runs.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or nothing is left.
    pub(crate) fn new(heads: Heads<'_>, runs: &'a [Run], config: &Config) -> Result<Self, EvaluateError> {
        check_runs(runs, config)?;
        if heads.len() == 0 {
            return Err(EvaluateError::NoScans { path: heads.summary().path.clone() });
        }
        let poses =
            runs.iter().map(|run| RunPoses::new(heads, run, config)).collect::<Result<Vec<_>, _>>()?;
        let mut selection = select(heads, runs, &poses, config)?;
        let steps_m = steps_m(&selection.frames, &poses);
        let segments = match &config.segments {
            Some(given) => take_segments(given, &mut selection.frames)?,
            None => cut_segments(&steps_m, config.segment, config.scales(), &mut selection.frames),
        };
        let mut along_m = vec![0.0];
        along_m.extend(steps_m.iter().scan(0.0, |along_m, step_m| {
            *along_m += step_m;
            Some(*along_m)
        }));
        Ok(Self { selection, poses, segments, along_m })
    }

    /// The scans in use, in order of time.
    pub(crate) fn frames(&self) -> &[PlannedFrame] {
        &self.selection.frames
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

fn check_runs(runs: &[Run], config: &Config) -> Result<(), EvaluateError> {
    if runs.is_empty() {
        return Err(EvaluateError::NoRuns);
    }
    for (k, run) in runs.iter().enumerate() {
        if runs[..k].iter().any(|other| other.name == run.name) {
            return Err(EvaluateError::SameName { name: run.name.clone() });
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
