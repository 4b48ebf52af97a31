//! How far apart two runs are on the scans of a log, and how much of one comes back.

use dmp_revisit::apart::{Apart, Ruler, share_back};
use dmp_sensor::Isometry3;

use super::frame::PlannedFrame;
use super::posed_run::PosedRun;

/// How far apart two runs put the same points, by their poses for the scans in use; `None` where both have poses for fewer
/// than two.
pub fn apart_of<M>(frames: &[PlannedFrame], runs: [&PosedRun<'_, M>; 2], ruler: &Ruler) -> Option<Apart> {
    let [a, b] = runs.map(|run| own_poses(frames, run));
    let numbers = frames.iter().map(|frame| frame.number as u64);
    Apart::of_poses(numbers.zip(a.zip(b).map(|(a, b)| [a, b])), ruler)
}

/// The share of the scans in use with which a run comes back to a place, by its own path.
pub fn back_of<M>(frames: &[PlannedFrame], run: &PosedRun<'_, M>, ruler: &Ruler) -> f64 {
    share_back(own_poses(frames, run).flatten(), ruler)
}

/// The pose of each scan in the run's own frame.
fn own_poses<'a, M>(
    frames: &'a [PlannedFrame],
    run: &'a PosedRun<'_, M>,
) -> impl Iterator<Item = Option<Isometry3<f64>>> + 'a {
    frames.iter().enumerate().map(|(ordinal, frame)| {
        let world_from_sensor = run.poses.of_frame(frame).filter(|_| run.path.has(ordinal))?;
        Some(run.own_from_world * world_from_sensor)
    })
}
