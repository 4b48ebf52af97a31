//! Selects the scans in use.

use dmp_log::{StampJump, stamp_jumps};

use crate::config::Run;
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::heads::Heads;
use crate::run_state::RunState;
use crate::settings::Settings;
use crate::unposed::Unposed;

/// Least share of scans with a pose in a run; below it, log and run probably do not belong together.
const MIN_POSED_SHARE: f64 = 0.05;

/// The scans to score, and why the others are not scored.
#[derive(Debug, Clone, Default)]
pub(crate) struct Selection {
    /// The selected scans with a pose in every run, in order of time.
    pub(crate) frames: Vec<PlannedFrame>,
    /// Returns of scans that were not selected.
    pub(crate) unselected_returns: u64,
    /// Returns of scans that lack a pose in some run.
    pub(crate) unposed_returns: u64,
    /// Number of backward steps of the log's stamps.
    pub(crate) out_of_order: usize,
    /// Scans with the stamp of another.
    pub(crate) same_stamp: usize,
    /// Where the log's stamps jump, whether those scans are in use or not.
    pub(crate) stamp_jumps: Vec<StampJump>,
}

/// Selects the requested scans with a pose in every run, near enough in time. Each run gets its number of
/// scans without a pose.
pub(super) fn select<M>(
    heads: Heads<'_>,
    runs: &mut [RunState<'_, M>],
    settings: &Settings,
) -> Result<Selection, EvaluateError> {
    let mut selection = Selection::default();
    runs.iter_mut().for_each(|run| (run.scans_without_pose, run.scans_between_poses) = (0, 0));
    let mut asked = 0;
    for (frame, (number, info)) in heads.scans().enumerate() {
        if number % settings.every != 0 {
            selection.unselected_returns += info.returns;
            continue;
        }
        asked += 1;
        let stamp_ns = info.stamp_ns.map(|stamp_ns| stamp_ns.saturating_add(settings.time_offset_ns));
        let planned = PlannedFrame { frame, number, stamp_ns, returns: info.returns, segment: 0 };
        let mut posed = true;
        for run in &mut *runs {
            if run.poses.of_frame(&planned).is_none() {
                run.scans_without_pose += 1;
                posed = false;
            } else if !run.poses.carries(&planned) {
                run.scans_between_poses += 1;
                posed = false;
            }
        }
        if posed {
            selection.frames.push(planned);
        } else {
            selection.unposed_returns += info.returns;
        }
    }
    for run in &*runs {
        let found = asked - run.scans_without_pose;
        if found == 0 || (found as f64) < MIN_POSED_SHARE * asked as f64 {
            let (run, why) = (run.run.name.clone(), why_no_overlap(heads, run.run, settings));
            return Err(EvaluateError::NoOverlap { run, found, scans: asked, why });
        }
    }
    if selection.frames.is_empty() {
        let sparsest = runs.iter().max_by_key(|run| run.scans_between_poses);
        let gap = sparsest.filter(|run| run.scans_between_poses > 0);
        if let Some((run, (gap_s, off_m))) = gap.and_then(|run| Some((run, run.poses.left_open()?))) {
            let run = run.run.name.clone();
            return Err(EvaluateError::TooSparse { run, gap_s, off_m });
        }
        return Err(EvaluateError::NothingInCommon);
    }
    selection.out_of_order =
        selection.frames.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count();
    selection.frames.sort_by_key(|frame| (frame.stamp_ns, frame.frame));
    let same = |pair: &&[PlannedFrame]| pair[0].stamp_ns.is_some() && pair[0].stamp_ns == pair[1].stamp_ns;
    selection.same_stamp = selection.frames.windows(2).filter(same).count();
    let stamps: Vec<(usize, i64)> =
        heads.scans().filter_map(|(number, info)| Some((number, info.stamp_ns?))).collect();
    selection.stamp_jumps = stamp_jumps(&stamps);
    Ok(selection)
}

/// The shift from the log's time span to the trajectory's. Clocks mostly differ by whole seconds, so a whole
/// shift is returned where it overlaps as much as aligning the beginnings.
fn shift_of_clocks(log: (i64, i64), run: (i64, i64)) -> i64 {
    const SECOND_NS: i64 = 1_000_000_000;
    let shift_ns = run.0.saturating_sub(log.0);
    let common_ns = |shift_ns: i64| {
        let (first, last) = (log.0.saturating_add(shift_ns), log.1.saturating_add(shift_ns));
        last.min(run.1).saturating_sub(first.max(run.0))
    };
    let below_ns = shift_ns.div_euclid(SECOND_NS).saturating_mul(SECOND_NS);
    let whole = [below_ns, below_ns.saturating_add(SECOND_NS)];
    whole.into_iter().find(|&whole| common_ns(whole) >= common_ns(shift_ns)).unwrap_or(shift_ns)
}

fn why_no_overlap(heads: Heads<'_>, run: &Run, settings: &Settings) -> Unposed {
    let (Some((first, last)), Some([start, .., end])) = (heads.summary().span_ns, run.trajectory.stamps_ns())
    else {
        return Unposed::TooFewPoses;
    };
    let s = |ns: i64| ns as f64 / 1e9;
    if first == last && heads.len() > 1 {
        return Unposed::SameStamps { stamp_s: s(first) };
    }
    let (first, last) =
        (first.saturating_add(settings.time_offset_ns), last.saturating_add(settings.time_offset_ns));
    let (log_s, poses_s) = ([s(first), s(last)], [s(*start), s(*end)]);
    let gap_ns = start.saturating_sub(last).max(first.saturating_sub(*end));
    if gap_ns > 0 {
        let offset_s = s(shift_of_clocks((first, last), (*start, *end)));
        Unposed::Apart { log_s, poses_s, gap_s: s(gap_ns), offset_s }
    } else {
        Unposed::Gaps { log_s, poses_s }
    }
}
