//! Surveys what is common to all places: the vehicle and the voxel edge.

use std::collections::BTreeSet;

use dmp_log::{LogOutline, MemoryLog, ScanLog};
use dmp_map::Store;

use super::scans::DriveScans;
use super::way::{PlaceScans, Way};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::plan::{BLOCK_RETURNS, BLOCK_SCANS, BLOCKS, Plan, Survey, block_of, spread};
use crate::progress::Progress;
use crate::run_state::RunState;
use crate::sample::Looks;
use crate::settings::Settings;
use crate::sink::ScoredPlace;

/// Scans that vote on the vehicle.
const VOTERS: usize = 30;

/// Approximate number of bytes read for the survey.
pub(super) fn bytes(outline: &LogOutline) -> u64 {
    let scans = outline.scans();
    let packed: u64 = scans.chunk_by(|a, b| a.group == b.group).map(|group| group[0].bytes).sum();
    let groups = scans.last().map_or(1, |scan| u64::from(scan.group) + 1);
    let in_a_group = (scans.len() as u64).div_ceil(groups).max(1);
    let of_pass = (BLOCK_SCANS as u64).div_ceil(in_a_group) + 1;
    // At most twice, whatever the size.
    ((VOTERS as u64 + BLOCKS as u64 * of_pass) * packed / groups).min(2 * packed)
}

/// The survey's results for all places.
pub(super) struct Surveyed<'a> {
    pub(super) plan: Plan,
    /// The runs.
    pub(super) runs: Vec<RunState<'a, Option<Store>>>,
    /// Number of returns of the largest scan read.
    pub(super) largest_scan: u64,
}

/// Reads a few scans of the drawn places and surveys them.
pub(super) fn look<'a>(
    scans: &DriveScans<'a>,
    way: &Way,
    places: &[(ScoredPlace, PlaceScans)],
    looks: Looks,
    settings: &Settings,
    pool: &rayon::ThreadPool,
    progress: &dyn Progress,
) -> Result<Surveyed<'a>, EvaluateError> {
    let drive = scans.drive();
    let scored: Vec<usize> = places.iter().flat_map(|(_, place)| place.scored.iter().copied()).collect();
    let voters: BTreeSet<usize> = spread(scored.len(), VOTERS).into_iter().map(|k| scored[k]).collect();
    let voters = Held::read(scans, &voters, settings)?;
    let survey = Survey { log: &voters.log, settings, pool, progress };
    let filter = survey.filter(&voters.of(&voters.ordinals()), drive.segments.travel_m)?;
    let (mut largest_scan, mean_returns) = voters.returns();
    drop(voters);

    // As many scans of a few passes as a block has.
    let count = (BLOCK_RETURNS.div_ceil(mean_returns.max(1)) as usize).min(BLOCK_SCANS);
    let pass_of = |k: usize| way.pass_of(&places[k].1).iter().take(count).copied().collect();
    let passes: Vec<BTreeSet<usize>> = spread(places.len(), BLOCKS).into_iter().map(pass_of).collect();
    let held = Held::read(scans, &passes.iter().flatten().copied().collect(), settings)?;
    largest_scan = largest_scan.max(held.returns().0);
    let passes: Vec<Vec<PlannedFrame>> = passes.iter().map(|pass| held.of(pass)).collect();
    let passes: Vec<&[PlannedFrame]> = passes.iter().map(Vec::as_slice).collect();
    let blocks: Vec<&[PlannedFrame]> = passes.iter().map(|pass| block_of(pass)).collect();
    let runs: Vec<_> = scans.runs().iter().map(|run| run.like(None)).collect();
    let survey = Survey { log: &held.log, settings, pool, progress };
    let voxel = survey.voxel(settings.voxel_m, &blocks, &runs, &filter)?;
    let (selection, segments) = (drive.selection.clone(), drive.segments.clone());
    let along_m = drive.along_m.clone();
    let plan = Plan { selection, segments, along_m, filter, voxel, looks };
    Ok(Surveyed { plan, runs, largest_scan })
}

/// Loaded scans as planned frames.
struct Held {
    log: MemoryLog,
    frames: Vec<(usize, PlannedFrame)>,
}

impl Held {
    fn read(
        scans: &DriveScans<'_>,
        ordinals: &BTreeSet<usize>,
        settings: &Settings,
    ) -> Result<Self, EvaluateError> {
        let log = scans.load(&ordinals.iter().copied().collect::<Vec<_>>())?;
        let (frames, _) = scans.frames_of(&log, settings);
        Ok(Self { log, frames })
    }

    fn ordinals(&self) -> BTreeSet<usize> {
        self.frames.iter().map(|(ordinal, _)| *ordinal).collect()
    }

    fn of(&self, ordinals: &BTreeSet<usize>) -> Vec<PlannedFrame> {
        let wanted = self.frames.iter().filter(|(ordinal, _)| ordinals.contains(ordinal));
        wanted.map(|(_, frame)| *frame).collect()
    }

    /// Largest and mean number of returns of a scan.
    fn returns(&self) -> (u64, u64) {
        let returns = || self.log.frames().iter().map(|frame| frame.returns);
        let count = returns().count().max(1) as u64;
        (returns().max().unwrap_or(0), returns().sum::<u64>() / count)
    }
}
