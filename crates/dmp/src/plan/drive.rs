//! The path of the sensor, known before a scan is read.

use super::segments::{Segments, cut_segments, median, take_segments};
use super::select::{Selection, select};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::heads::Heads;
use crate::run_poses::RunPoses;
use crate::run_state::{RunState, poses_of};
use crate::settings::Settings;

/// The drive by log and trajectories, before a scan is read.
#[derive(Debug, Clone)]
pub(crate) struct Drive {
    /// Which scans are in use, and why the others are not.
    pub(crate) selection: Selection,
    /// The segments.
    pub(crate) segments: Segments,
    /// For each scan in use the path length up to it, metres: the median over the runs per step, accumulated.
    pub(crate) along_m: Vec<f64>,
}

impl Drive {
    /// Reads the heads of a log's scans; each run gets its number of scans without a pose.
    ///
    /// # Errors
    /// When a run and the log do not belong together, or no scan remains.
    pub(crate) fn new<M>(
        heads: Heads<'_>,
        runs: &mut [RunState<'_, M>],
        settings: &Settings,
    ) -> Result<Self, EvaluateError> {
        if heads.len() == 0 {
            return Err(EvaluateError::NoScans { path: heads.summary().path.clone() });
        }
        let mut selection = select(heads, runs, settings)?;
        let steps_m = steps_m(&selection.frames, runs);
        let segments = match &settings.segments {
            Some(given) => take_segments(given, &mut selection.frames)?,
            None => cut_segments(&steps_m, settings.segment, settings.scales, &mut selection.frames),
        };
        let mut along_m = vec![0.0];
        along_m.extend(steps_m.iter().scan(0.0, |along_m, step_m| {
            *along_m += step_m;
            Some(*along_m)
        }));
        Ok(Self { selection, segments, along_m })
    }

    /// The scans in use, in order of time.
    pub(crate) fn frames(&self) -> &[PlannedFrame] {
        &self.selection.frames
    }
}

/// The distance from each scan to the next: the median over the runs.
fn steps_m<M>(frames: &[PlannedFrame], runs: &[RunState<'_, M>]) -> Vec<f64> {
    let place = |frame: &PlannedFrame, run: &RunPoses| Some(run.of_frame(frame)?.translation.vector);
    let step = |pair: &[PlannedFrame]| {
        let of_run = |run| Some((place(&pair[1], run)? - place(&pair[0], run)?).norm());
        median(poses_of(runs).filter_map(of_run).collect())
    };
    frames.windows(2).map(step).collect()
}
