//! The scans that are looked at, and how well they fit together.

use std::collections::HashMap;

use dmp_sensor::{Ray, ReturnFilter, Scan, Vector3};

use super::doubts::Doubts;
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::plan::Plan;
use crate::pose::{Poser, RunPoses};
use crate::run_state::{RunState, poses_of};
use crate::segment_length::SegmentLength;
use crate::settings::Settings;

/// Scans of a stretch, and returns of a scan, that are looked at.
const SCANS: usize = 8;
const RETURNS: usize = 2000;
/// Length of a stretch, metres of a drive.
const STRETCH_M: f64 = 20.0;
/// Stretches among which the one with the sharpest turn is looked for.
const STRETCHES: usize = 100;
/// Edge of the cells in which scans must meet, metres of a drive.
const CELL_M: f64 = 0.5;

/// How well scans fit together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    /// Share of the returns in whose cell another scan of the same stretch has one too.
    pub(super) together: f64,
    /// The way from scan to scan in the stretches, metres.
    pub(super) way_m: f64,
}

/// Scans with few returns of each, in stretches of the drive.
#[derive(Debug)]
pub(super) struct Sample {
    stretches: Vec<Vec<(PlannedFrame, Scan)>>,
    /// Edge of the cells in which scans must meet, metres.
    cell_m: f64,
    /// Returns of all scans.
    pub(super) returns: usize,
    pub(super) scans: usize,
}

impl Sample {
    /// Scans of the first stretch and of that with the sharpest turn among the others: along a straight street
    /// every wrong rotation and every wrong time give a street as well, only another one.
    pub(super) fn read<M>(
        &Doubts { log, plan, settings, .. }: &Doubts<'_>,
        stretches: &[&[PlannedFrame]],
        runs: &[RunState<'_, M>],
    ) -> Result<Self, EvaluateError> {
        let cell_m = CELL_M * settings.metre_m();
        let mut sample = Self { stretches: Vec::new(), cell_m, returns: 0, scans: 0 };
        let (mut reader, mut whole) = (log.reader()?, Scan::default());
        let turns: Vec<f64> = stretches.iter().map(|stretch| turn_rad(stretch, runs)).collect();
        let sharpest =
            (1..stretches.len()).max_by(|&a, &b| f64::total_cmp(&turns[a], &turns[b]).then(b.cmp(&a)));
        for stretch in stretches.iter().take(1).chain(sharpest.map(|k| &stretches[k])) {
            let count = SCANS.min(stretch.len());
            let mut scans = Vec::new();
            for k in 0..count {
                let frame = stretch[k * stretch.len() / count];
                reader.read(frame.frame, &mut whole)?;
                scans.push((frame, thinned(&whole, &plan.filter)));
            }
            sample.scans += scans.len();
            sample.returns += scans.iter().map(|(_, scan)| scan.len()).sum::<usize>();
            sample.stretches.push(scans);
        }
        Ok(sample)
    }

    /// Calls `each` for every scan: which one, and the rays of its returns with these poses, at stamps that
    /// are later by `shift_ns`. Returns without a pose have no ray.
    pub(super) fn rays(
        &self,
        poses: &RunPoses,
        filter: &ReturnFilter,
        shift_ns: i64,
        mut each: impl FnMut(usize, &[Ray]) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let mut poser = Poser::new([poses], filter);
        for (k, (frame, scan)) in self.stretches.iter().flatten().enumerate() {
            let stamp_ns = frame.stamp_ns.map(|stamp_ns| stamp_ns.saturating_add(shift_ns));
            let frame = PlannedFrame { stamp_ns, ..*frame };
            poser.blocks(&frame, scan, |block| each(k, block.rays(0)))?;
        }
        Ok(())
    }

    /// How well the scans fit together with these poses, at stamps that are later by `shift_ns`.
    pub(super) fn fit(
        &self,
        poses: &RunPoses,
        filter: &ReturnFilter,
        shift_ns: i64,
    ) -> Result<Fit, EvaluateError> {
        let stretch_of: Vec<usize> =
            self.stretches.iter().enumerate().flat_map(|(k, scans)| scans.iter().map(move |_| k)).collect();
        let (mut way_m, mut before) = (0.0, None::<(usize, Vector3<f64>)>);
        // Of every cell: its returns, the last scan in it, and whether there was another.
        let mut cells: HashMap<(usize, [i64; 3]), (u64, usize, bool)> = HashMap::new();
        self.rays(poses, filter, shift_ns, |scan, rays| {
            if let Some(ray) = rays.first() {
                let (stretch, place) = (stretch_of[scan], Vector3::from(ray.origin_in_world));
                if let Some((_, last)) = before.filter(|&(before, _)| before == stretch) {
                    way_m += (place - last).norm();
                }
                before = Some((stretch, place));
            }
            for ray in rays {
                let cell = ray.endpoint_in_world().map(|c| (c / self.cell_m).floor() as i64);
                let (returns, last, shared) =
                    cells.entry((stretch_of[scan], cell)).or_insert((0, scan, false));
                *returns += 1;
                *shared |= *last != scan;
                *last = scan;
            }
            Ok(())
        })?;
        let shared: u64 = cells.values().filter(|cell| cell.2).map(|cell| cell.0).sum();
        Ok(Fit { together: shared as f64 / self.returns.max(1) as f64, way_m })
    }
}

/// The first stretches of a drive, cut as all runs agree.
pub(crate) fn stretches<'p>(plan: &'p Plan, settings: &Settings) -> Vec<&'p [PlannedFrame]> {
    let (frames, starts) = (plan.frames(), &plan.segments.starts);
    let segments = match plan.segments.length {
        Some(SegmentLength::Metres(length_m)) => {
            (STRETCH_M * settings.metre_m() / length_m).ceil().max(1.0) as usize
        }
        Some(SegmentLength::Seconds(_) | SegmentLength::Scans(_)) => 1,
        // Every scan is a segment.
        None => SCANS,
    };
    let cuts: Vec<usize> = starts.iter().step_by(segments).copied().chain([frames.len()]).collect();
    cuts.windows(2).take(STRETCHES).map(|cut| &frames[cut[0]..cut[1]]).collect()
}

/// How far a stretch turns from scan to scan, all runs together.
fn turn_rad<M>(stretch: &[PlannedFrame], runs: &[RunState<'_, M>]) -> f64 {
    let turn = |pair: &[PlannedFrame], run: &RunPoses| {
        Some(run.of_frame(&pair[0])?.rotation.angle_to(&run.of_frame(&pair[1])?.rotation))
    };
    stretch.windows(2).flat_map(|pair| poses_of(runs).filter_map(move |run| turn(pair, run))).sum()
}

/// Up to so many of the returns that are used, evenly spread over the scan.
fn thinned(scan: &Scan, filter: &ReturnFilter) -> Scan {
    let used: Vec<usize> =
        (0..scan.len()).filter(|&k| filter.check(scan.points_in_sensor_m[k]).is_ok()).collect();
    let count = RETURNS.min(used.len());
    let kept = || (0..count).map(|k| used[k * used.len() / count]);
    Scan {
        stamp_ns: scan.stamp_ns,
        points_in_sensor_m: kept().map(|k| scan.points_in_sensor_m[k]).collect(),
        time_offsets_ns: kept().filter_map(|k| scan.time_offsets_ns.get(k).copied()).collect(),
    }
}
