//! How far apart two runs are on the scans of a log.

use dmp_revisit::apart::{Apart, Ruler};

use super::frame::PlannedFrame;
use super::posed_run::PosedRun;

/// How far apart two runs put the same points, by their poses for the scans in use; `None` where both have poses for fewer
/// than two.
pub fn apart_of<M>(frames: &[PlannedFrame], runs: [&PosedRun<'_, M>; 2], ruler: &Ruler) -> Option<Apart> {
    let scans = frames.iter().enumerate().map(|(ordinal, frame)| {
        let pose = |run: &PosedRun<'_, M>| {
            let world_from_sensor = run.poses.of_frame(frame).filter(|_| run.path.has(ordinal))?;
            Some(run.own_from_world * world_from_sensor)
        };
        (frame.number as u64, runs.map(pose))
    });
    Apart::of_poses(scans, ruler)
}
