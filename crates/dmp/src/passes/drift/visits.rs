//! The scans of a visit.

use dmp_revisit::visits::at_part;

/// Approximate number of returns used of a visit: of more, each scan is subsampled.
pub(super) const RETURNS: u64 = 120_000;
/// Part of a segment that is its visit, around its middle: distortion within a visit is not measured as
/// drift.
const PART: f64 = 0.5;
/// Least number of consecutive scans of a visit, and most scans, spread over it.
const LEAST_SCANS: usize = 3;
const SCANS: usize = 12;

/// A segment of the path as a visit to the place in its middle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Visit {
    /// Its middle scan, whose pose is that of the visit: its ordinal in the plan.
    pub(super) middle: usize,
    /// Some of its scans, the middle among them, ascending.
    pub(super) scans: Vec<usize>,
}

impl Visit {
    /// Selects scans of a segment. If a few have enough returns, they are the ones next to the middle, which
    /// mostly lie together in the log. Otherwise, and for a camera with its small view, they are at equal
    /// steps of distance, or of their number if the sensor stands.
    pub(super) fn of(
        ordinals: &[usize],
        along_m: &[f64],
        returns: impl Fn(usize) -> u64,
        is_camera: bool,
    ) -> Self {
        let at = |part: f64| at_part(ordinals, along_m, part);
        let middle = at(0.5);
        let enough = RETURNS.div_ceil(returns(ordinals[middle]).max(1)) as usize;
        let scans = if !is_camera && enough < SCANS / 2 {
            let beside = (enough.max(LEAST_SCANS) / 2).min(ordinals.len() / 2);
            (middle.saturating_sub(beside)..(middle + beside + 1).min(ordinals.len())).collect()
        } else {
            let spread = (0..SCANS).map(|k| at(0.5 + PART * ((k as f64 + 0.5) / SCANS as f64 - 0.5)));
            let mut scans: Vec<usize> = spread.chain([middle]).collect();
            scans.sort_unstable();
            scans.dedup();
            scans
        };
        let scans = scans.into_iter().map(|k: usize| ordinals[k]).collect();
        Self { middle: ordinals[middle], scans }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scans_of_a_visit_are_spread_over_its_middle() {
        // It stands on the first half of its scans.
        let along_m: Vec<f64> = (0..100).map(|k| f64::from(k.max(50) - 50)).collect();
        let all: Vec<usize> = (0..100).collect();
        let visit = Visit::of(&all, &along_m, |_| 10_000, false);
        assert_eq!((visit.middle, visit.scans.len()), (75, SCANS + 1));
        assert!(visit.scans.iter().all(|scan| (62..88).contains(scan)), "{:?}", visit.scans);
        let standing = Visit::of(&all[20..40], &[0.0; 100], |_| 10_000, false);
        assert!(
            standing.scans.contains(&standing.middle)
                && standing.scans.iter().all(|scan| (20..40).contains(scan))
        );
        // With dense scans a few suffice.
        assert_eq!(Visit::of(&all, &along_m, |_| 50_000, false).scans, [74, 75, 76]);
        assert_eq!(Visit::of(&all[7..8], &along_m, |_| 10_000, false), Visit { middle: 7, scans: vec![7] });
    }
}
