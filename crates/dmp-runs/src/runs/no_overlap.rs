//! Why a run has no poses for the scans of a log.

use crate::asked::{Run, Settings, Unposed};
use crate::runs::heads::Heads;

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

/// Why the poses of a run and the scans of a log are of different times.
pub(crate) fn why_no_overlap(heads: Heads<'_>, run: &Run, settings: &Settings) -> Unposed {
    let (Some((first, last)), Some([start, .., end])) = (heads.summary().span_ns, run.trajectory.stamps_ns())
    else {
        return Unposed::TooFewPoses;
    };
    let s = |ns: i64| ns as f64 / 1e9;
    if first == last && heads.readable() > 1 {
        return Unposed::SameStamps { stamp_s: s(first) };
    }
    let offset_ns = settings.time_offset_ns(run);
    let (first, last) = (first.saturating_add(offset_ns), last.saturating_add(offset_ns));
    let (log_s, poses_s) = ([s(first), s(last)], [s(*start), s(*end)]);
    let gap_ns = start.saturating_sub(last).max(first.saturating_sub(*end));
    if gap_ns > 0 {
        let offset_s = s(offset_ns.saturating_add(shift_of_clocks((first, last), (*start, *end))));
        Unposed::Apart { log_s, poses_s, gap_s: s(gap_ns), offset_s }
    } else {
        Unposed::Gaps { log_s, poses_s }
    }
}
