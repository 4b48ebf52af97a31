//! What holds for all places: the vehicle, the voxels; and whether log and runs belong together.

use std::collections::BTreeSet;

use dmp_log::{HeldLog, LogOutline, ScanLog};

use super::ScoredPlace;
use super::scans::DriveScans;
use super::way::{PlaceScans, Way};
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::plan::{Drive, Plan, survey};
use crate::sample::Looks;
use crate::sanity;
use crate::watch::Watch;

/// Scans that vote on the vehicle at most: one of a place.
const VOTERS: usize = 50;

/// About how many bytes are read for it.
pub(super) fn bytes(outline: &LogOutline) -> u64 {
    let scans = (VOTERS + survey::BLOCKS * survey::BLOCK_SCANS) as u64;
    scans * outline.bytes() / outline.scans().len().max(1) as u64
}

/// A few scans, held.
pub(super) struct Survey<'a> {
    drive: &'a Drive<'a>,
    log: HeldLog,
    /// One scan of each of some places.
    voters: Vec<PlannedFrame>,
    /// Passes through a few places.
    passes: Vec<Vec<PlannedFrame>>,
}

impl<'a> Survey<'a> {
    /// Reads scans of some of the places, evenly spread.
    pub(super) fn read(
        scans: &DriveScans<'a>,
        way: &Way,
        places: &[(ScoredPlace, PlaceScans)],
        config: &Config,
    ) -> Result<Self, EvaluateError> {
        let some = |count| survey::spread(places.len(), count).into_iter().map(|k| &places[k].1);
        let voters: BTreeSet<usize> =
            some(VOTERS).filter_map(|place| place.scored.first().copied()).collect();
        let pass_of = |place| way.pass_of(place).iter().take(survey::BLOCK_SCANS).copied().collect();
        let passes: Vec<BTreeSet<usize>> = some(survey::BLOCKS).map(pass_of).collect();
        let wanted: BTreeSet<usize> = passes.iter().flatten().chain(&voters).copied().collect();
        let log = scans.load(&wanted.into_iter().collect::<Vec<_>>())?;
        let (frames, _) = scans.frames_of(&log, config);
        let of = |set: &BTreeSet<usize>| -> Vec<PlannedFrame> {
            frames.iter().filter(|(ordinal, _)| set.contains(ordinal)).map(|(_, frame)| *frame).collect()
        };
        let (voters, passes) = (of(&voters), passes.iter().map(of).collect());
        Ok(Self { drive: scans.drive(), log, voters, passes })
    }

    /// Returns of the largest scan.
    pub(super) fn largest_scan(&self) -> u64 {
        self.log.frames().iter().map(|frame| frame.returns).max().unwrap_or(0)
    }

    /// The plan for all places, and for every run what is likely wrong with it.
    pub(super) fn plan(
        &self,
        runs: &[Run],
        looks: Looks,
        config: &Config,
        watch: &dyn Watch,
    ) -> Result<(Plan<'a>, Vec<Option<String>>), EvaluateError> {
        let drive = self.drive;
        let filter = survey::filter(&self.log, &self.voters, drive.segments.travel_m, config, watch)?;
        let passes: Vec<&[PlannedFrame]> = self.passes.iter().map(Vec::as_slice).collect();
        let blocks: Vec<&[PlannedFrame]> = passes.iter().map(|pass| survey::block_of(pass)).collect();
        let voxel = survey::voxel(&self.log, &blocks, runs, &drive.poses, &filter, config, watch)?;
        let plan = Plan {
            selection: drive.selection.clone(),
            poses: drive.poses.clone(),
            segments: drive.segments.clone(),
            filter,
            voxel,
            looks,
        };
        let hints = sanity::look(&self.log, &plan, &passes, runs, &[], config, watch)?;
        Ok((plan, hints))
    }
}
