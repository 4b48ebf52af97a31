//! Stamps that jump: scans stamped at another time than those around them, and times without any scan.

use super::frame_info::median_step_ns;
use std::fmt;

/// Scans without which nothing is usual.
const ENOUGH: usize = 8;
/// Periods between stamps that belong together, and those of a gap at least.
const NEAR_PERIODS: i64 = 10;
const GAP_PERIODS: i64 = 20;
/// The longest steps that may be gaps, and one of so many more; a gap is so many times the next one. Where more are long, as
/// between the key frames of a drive that stops, that is what the log is like.
const GAPS: usize = 3;
const ONE_GAP_OF: usize = 100;
const USUAL: i64 = 10;

/// A jump of a log's stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StampJump {
    /// One scan is stamped far from the scans before and after it, which are near each other.
    Scan {
        /// Its number.
        scan: usize,
        /// By how much it is after them, or before where less than 0, nanoseconds.
        by_ns: i64,
    },
    /// There is no scan for far longer than elsewhere in the log.
    Gap {
        /// The number of the last scan before.
        after: usize,
        /// How long, nanoseconds.
        gap_ns: i64,
        /// The usual time from scan to scan, nanoseconds.
        period_ns: i64,
    },
}

impl fmt::Display for StampJump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = |ns: i64| ns as f64 / 1e9;
        match *self {
            Self::Scan { scan, by_ns } => {
                let side = if by_ns < 0 { "before" } else { "after" };
                write!(f, "scan {scan} is stamped {:.1} s {side} the scans around it", s(by_ns).abs())
            }
            Self::Gap { after, gap_ns, period_ns } => write!(
                f,
                "no scan for {:.1} s after scan {after}, where scans are {:.2} s apart",
                s(gap_ns),
                s(period_ns)
            ),
        }
    }
}

/// The jumps of a log's stamps, in nanoseconds, each with the scan's number, in the order of the log. Stamps that merely are in
/// disorder do not jump.
pub fn stamp_jumps(stamps: &[(usize, i64)]) -> Vec<StampJump> {
    let period_ns = median_step_ns(stamps.iter().map(|&(_, ns)| ns).collect());
    let Some(period_ns) = period_ns.filter(|_| stamps.len() >= ENOUGH) else { return Vec::new() };
    let near_ns = period_ns.saturating_mul(NEAR_PERIODS);
    let (mut jumps, mut others) = (Vec::new(), Vec::with_capacity(stamps.len()));
    for (k, &(scan, ns)) in stamps.iter().enumerate() {
        let around = k.checked_sub(1).and_then(|before| Some((stamps.get(before)?.1, stamps.get(k + 1)?.1)));
        let around =
            around.filter(|&(before, after)| before <= after && after.saturating_sub(before) <= near_ns).map(
                |(before, after)| {
                    if ns > after { ns.saturating_sub(after) } else { ns.saturating_sub(before).min(0) }
                },
            );
        match around.filter(|by_ns| by_ns.saturating_abs() > near_ns) {
            Some(by_ns) => jumps.push(StampJump::Scan { scan, by_ns }),
            None => others.push((ns, scan)),
        }
    }
    others.sort_unstable();
    let step_ns = |pair: &[(i64, usize)]| match pair {
        [(one, _), (other, _)] => other.saturating_sub(*one),
        _ => 0,
    };
    let mut steps_ns: Vec<i64> = others.windows(2).map(step_ns).collect();
    steps_ns.sort_unstable_by_key(|&step| std::cmp::Reverse(step));
    let usual_ns = steps_ns.get(GAPS + steps_ns.len() / ONE_GAP_OF).copied().unwrap_or(period_ns);
    let limit_ns = period_ns.saturating_mul(GAP_PERIODS).max(usual_ns.saturating_mul(USUAL));
    let gaps = others.windows(2).filter(|pair| step_ns(pair) > limit_ns);
    jumps.extend(gaps.map(|pair| StampJump::Gap { after: pair[0].1, gap_ns: step_ns(pair), period_ns }));
    jumps
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    fn jumps(stamps_ns: &[i64]) -> Vec<StampJump> {
        stamp_jumps(&stamps_ns.iter().copied().enumerate().collect::<Vec<_>>())
    }

    fn every(period_ns: i64, count: i64) -> Vec<i64> {
        (0..count).map(|k| 1_700_000_000 * S + k * period_ns).collect()
    }

    #[test]
    fn a_stamp_that_is_off_and_a_gap_are_found() {
        let mut stamps = every(S / 10, 100);
        stamps[12] += 3600 * S;
        stamps[30] -= 20 * S;
        stamps[41..].iter_mut().for_each(|ns| *ns += 12 * S);
        let found: Vec<String> = jumps(&stamps).iter().map(ToString::to_string).collect();
        let words = [
            "scan 12 is stamped 3599.9 s after the scans around it",
            "scan 30 is stamped 19.9 s before the scans around it",
            "no scan for 12.1 s after scan 40, where scans are 0.10 s apart",
        ];
        assert_eq!(found, words);
        stamps[12] = i64::MAX;
        stamps[30] = i64::MIN;
        assert_eq!(jumps(&stamps).len(), 3);
        // At an end nobody can say which side is off.
        let mut stamps = every(S / 10, 100);
        stamps[0] -= 500 * S;
        assert!(matches!(jumps(&stamps)[..], [StampJump::Gap { after: 0, .. }]));
    }

    /// The null: jitter, lost scans, scans in disorder, key frames of a drive that stops, no stamps to speak of.
    #[test]
    fn what_recordings_are_like_is_no_jump() {
        let mut jitter = every(S / 10, 1000);
        jitter.iter_mut().enumerate().for_each(|(k, ns)| *ns += (k as i64 * 7919 % 80) * 1_000_000);
        let lost: Vec<i64> = every(S / 10, 1000)
            .into_iter()
            .enumerate()
            .filter(|(k, _)| k % 50 > 10)
            .map(|(_, ns)| ns)
            .collect();
        let mut disorder = every(S / 10, 1000);
        disorder.chunks_mut(8).for_each(<[i64]>::reverse);
        let mut parts = every(S / 10, 1000);
        parts.rotate_left(300);
        let stops = [60, 45, 30, 20, 10, 7, 5, 4, 3];
        let mut ns = 0;
        let key_frames: Vec<i64> = (0..300)
            .map(|k| {
                ns += if k % 33 == 5 { stops[k / 33 % 9] * S } else { S / 2 };
                ns
            })
            .collect();
        let same = vec![7 * S; 100];
        for stamps in [jitter, lost, disorder, parts, key_frames, same, vec![0, S, 900 * S], vec![]] {
            assert_eq!(jumps(&stamps), []);
        }
    }
}
