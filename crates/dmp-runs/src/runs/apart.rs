//! How far apart two runs are on the scans of a log.

use dmp_revisit::apart::{Apart, Ruler, ScanInBoth};

use super::frame::PlannedFrame;
use super::posed_run::PosedRun;

/// How far apart two runs put the same points, by their poses for the scans in use; `None` where both have poses for fewer
/// than two.
pub fn apart_of<M>(frames: &[PlannedFrame], runs: [&PosedRun<'_, M>; 2], ruler: &Ruler) -> Option<Apart> {
    let (mut scans, mut of_one) = (Vec::new(), 0);
    for (ordinal, frame) in frames.iter().enumerate() {
        let pose = |run: &PosedRun<'_, M>| {
            let world_from_sensor = run.poses.of_frame(frame).filter(|_| run.path.has(ordinal))?;
            Some(run.own_from_world * world_from_sensor)
        };
        match runs.map(pose) {
            [Some(a), Some(b)] => {
                scans.push(ScanInBoth { scan: frame.number as u64, run_from_sensor: [a, b] });
            }
            [None, None] => {}
            _ => of_one += 1,
        }
    }
    Apart::of(&scans, of_one, ruler)
}
