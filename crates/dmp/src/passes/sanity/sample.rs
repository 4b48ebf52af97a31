//! The sample of scans for the check.

use dmp_runs::{EvaluateError, PlannedFrame, Poser, RunPath, RunPoses};
use dmp_sensor::{Ray, ReturnFilter, Scan};

use super::doubts::Doubts;
use crate::drawn::spread;

/// Number of scans, and of returns per scan.
const SCANS: usize = 16;
const RETURNS: usize = 2000;

/// Scans along the whole path with few returns of each.
#[derive(Debug)]
pub(super) struct Sample {
    /// With their ordinals.
    scans: Vec<(usize, PlannedFrame, Scan)>,
}

impl Sample {
    pub(super) fn read(&Doubts { log, plan, .. }: &Doubts<'_>) -> Result<Self, EvaluateError> {
        let (mut reader, mut whole) = (log.reader()?, Scan::default());
        let mut scans = Vec::with_capacity(SCANS);
        for ordinal in spread(plan.frames().len(), SCANS) {
            let frame = plan.frames()[ordinal];
            reader.read(frame.frame, &mut whole)?;
            scans.push((ordinal, frame, thinned(&whole, &plan.filter)));
        }
        Ok(Self { scans })
    }

    /// Number of scans.
    pub(super) fn len(&self) -> usize {
        self.scans.len()
    }

    /// Returns of all scans.
    pub(super) fn returns(&self) -> usize {
        self.scans.iter().map(|(_, _, scan)| scan.len()).sum()
    }

    /// Calls `each` for every scan with the rays of its returns. Returns without a pose have no ray.
    pub(super) fn rays(
        &self,
        posed: (&RunPoses, &RunPath),
        filter: &ReturnFilter,
        mut each: impl FnMut(&[Ray]) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let mut poser = Poser::new([posed], filter);
        for (ordinal, frame, scan) in &self.scans {
            poser.blocks((*ordinal, frame), scan, |block| {
                each(&block.posed(0).map(|(_, ray)| *ray).collect::<Vec<_>>())
            })?;
        }
        Ok(())
    }
}

/// Up to this many of the used returns, evenly spread over the scan.
fn thinned(scan: &Scan, filter: &ReturnFilter) -> Scan {
    let used: Vec<usize> =
        (0..scan.len()).filter(|&k| filter.check(scan.points_in_sensor_m[k]).is_ok()).collect();
    let kept = || spread(used.len(), RETURNS).into_iter().map(|k| used[k]);
    Scan {
        stamp_ns: scan.stamp_ns,
        points_in_sensor_m: kept().map(|k| scan.points_in_sensor_m[k]).collect(),
        time_offsets_ns: kept().filter_map(|k| scan.time_offsets_ns.get(k).copied()).collect(),
    }
}
