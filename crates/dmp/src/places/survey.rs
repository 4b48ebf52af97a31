//! What holds for all places: the vehicle, the voxels; and whether log and runs belong together.

use std::collections::BTreeSet;

use dmp_log::{HeldLog, LogOutline, ScanLog};

use super::ScoredPlace;
use super::score::{frames_of, load};
use super::way::{PlaceScans, SPACING_M, Way};
use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::plan::{Plan, survey};
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
    way: &'a Way<'a>,
    log: HeldLog,
    /// One scan of each of some places.
    voters: Vec<PlannedFrame>,
    /// Passes through a few places.
    passes: Vec<Vec<PlannedFrame>>,
}

impl<'a> Survey<'a> {
    /// Reads scans of some of the places, evenly spread.
    pub(super) fn read(
        outline: &LogOutline,
        way: &'a Way<'a>,
        places: &[(ScoredPlace, PlaceScans)],
        config: &Config,
    ) -> Result<Self, EvaluateError> {
        let some = |count| survey::spread(places.len(), count).into_iter().map(|k| &places[k].1);
        let voters: BTreeSet<usize> =
            some(VOTERS).filter_map(|place| place.scored.first().copied()).collect();
        let passes: Vec<BTreeSet<usize>> = some(survey::BLOCKS).map(|place| pass_of(place, way)).collect();
        let wanted: BTreeSet<usize> = passes.iter().flatten().chain(&voters).copied().collect();
        let log = load(outline, way, &wanted.into_iter().collect::<Vec<_>>())?;
        let (frames, _) = frames_of(&log, way, config);
        let of = |set: &BTreeSet<usize>| -> Vec<PlannedFrame> {
            frames.iter().filter(|(ordinal, _)| set.contains(ordinal)).map(|(_, frame)| *frame).collect()
        };
        let (voters, passes) = (of(&voters), passes.iter().map(of).collect());
        Ok(Self { way, log, voters, passes })
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
        let drive = self.way.drive();
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

/// The longest pass through a place, as long as a block of scans.
fn pass_of(place: &PlaceScans, way: &Way<'_>) -> BTreeSet<usize> {
    let along_m = &way.drive().along_m;
    let passes = place.read.chunk_by(|a, b| along_m[*b] - along_m[*a] < 2.0 * SPACING_M);
    let longest = passes.max_by_key(|pass| pass.len()).unwrap_or_default();
    longest.iter().take(survey::BLOCK_SCANS).copied().collect()
}
