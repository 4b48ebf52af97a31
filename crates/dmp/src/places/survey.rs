//! Surveys what is common to all places: the vehicle, the voxel edge, and where returns lie.

use dmp_log::{LogOutline, ScanLog};
use dmp_runs::{EvaluateError, PlannedFrame, Progress, Selection, Settings};

use super::scans::DriveScans;
use crate::drawn::spread;
use crate::passes::{Plan, SURVEYED_SCANS, Survey};

/// Approximate number of bytes read for the survey.
pub(super) fn bytes(outline: &LogOutline) -> u64 {
    let scans = outline.scans();
    let packed: u64 = scans.chunk_by(|a, b| a.group == b.group).map(|group| group[0].bytes).sum();
    let groups = scans.last().map_or(1, |scan| u64::from(scan.group) + 1);
    (SURVEYED_SCANS as u64 * packed / groups).min(packed)
}

/// Reads a few scans along the drive and surveys them: the plan, and the number of returns of the largest.
pub(super) fn look(
    scans: &DriveScans<'_>,
    selection: Selection,
    settings: &Settings,
    (pool, progress): (&rayon::ThreadPool, &dyn Progress),
) -> Result<(Plan, u64), EvaluateError> {
    let log = scans.load(&spread(scans.drive().frames.len(), SURVEYED_SCANS))?;
    let (frames, _) = scans.frames_of(&log, settings);
    let frames: Vec<PlannedFrame> = frames.into_iter().map(|(_, frame)| frame).collect();
    let survey = Survey { log: &log, settings, pool, progress };
    let (filter, surveyed) = survey.look(&frames, settings.voxel_m)?;
    let largest_scan = log.frames().iter().map(|frame| frame.returns).max().unwrap_or(0);
    // The scans of a place are few: by default their returns are all cast.
    let draw = settings.returns.draw(0, settings.seed);
    Ok((Plan { selection, filter, surveyed, draw }, largest_scan))
}
