//! Which pose of one trajectory belongs to which of another, by their stamps.

use super::{CompareError, PosePath};

/// How stamps are matched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matching {
    /// Largest difference of two stamps, seconds, itself included.
    pub max_diff_s: f64,
    /// Added to the estimate's stamps.
    pub offset_s: f64,
}

impl Default for Matching {
    fn default() -> Self {
        Self { max_diff_s: 0.01, offset_s: 0.0 }
    }
}

/// Both trajectories reduced to poses that belong together, one by one. The trajectory with fewer poses
/// (the estimate where they have as many) asks, the other answers with the pose nearest in time, the
/// earlier of two as near; a pose may answer several times.
///
/// # Errors
/// When one has stamps and the other not, or when nothing matches. Where both have none they are left as
/// they are.
pub fn associate(
    reference: &PosePath,
    estimate: &PosePath,
    matching: &Matching,
) -> Result<(PosePath, PosePath), CompareError> {
    let (reference_stamps, estimate_stamps) = match (reference.stamps_s(), estimate.stamps_s()) {
        (None, None) => return Ok((reference.clone(), estimate.clone())),
        (Some(reference), Some(estimate)) => (reference, estimate),
        _ => return Err(CompareError::OneWithoutStamps),
    };
    let estimate_is_longer = estimate.len() > reference.len();
    let (asking, answering, offset_s) = if estimate_is_longer {
        (reference_stamps, estimate_stamps, matching.offset_s)
    } else {
        (estimate_stamps, reference_stamps, -matching.offset_s)
    };
    let matches = match_stamps(asking, answering, matching.max_diff_s, offset_s);
    if matches.is_empty() {
        let Matching { max_diff_s, offset_s } = *matching;
        return Err(CompareError::NoMatches { max_diff_s, offset_s });
    }
    let (of_short, of_long): (Vec<usize>, Vec<usize>) = matches.into_iter().unzip();
    let (short, long) = if estimate_is_longer { (reference, estimate) } else { (estimate, reference) };
    let (short, long) = (short.select(&of_short), long.select(&of_long));
    Ok(if estimate_is_longer { (short, long) } else { (long, short) })
}

/// Pairs (index in `asking`, index in `answering`) of stamps at most `max_diff_s` apart, once `offset_s`
/// is added to the answering ones. `O(n log n)`, also where stamps are out of order.
pub fn match_stamps(
    asking: &[f64],
    answering: &[f64],
    max_diff_s: f64,
    offset_s: f64,
) -> Vec<(usize, usize)> {
    let answering: Vec<f64> = answering.iter().map(|stamp| stamp + offset_s).collect();
    let sorted = answering.windows(2).all(|pair| pair[1] - pair[0] >= 0.0);
    let asking = asking.iter().enumerate();
    if sorted {
        asking.filter_map(|(k, &stamp)| Some((k, nearest_sorted(&answering, stamp, max_diff_s)?))).collect()
    } else {
        let unsorted = Unsorted::new(&answering);
        asking.filter_map(|(k, &stamp)| Some((k, unsorted.nearest(stamp, max_diff_s)?))).collect()
    }
}

/// The nearest of ascending stamps. The two ends of the range are checked before the differences are, as
/// evo does it: the two tests round differently.
fn nearest_sorted(stamps: &[f64], stamp: f64, max_diff_s: f64) -> Option<usize> {
    let (first, last) = (*stamps.first()?, *stamps.last()?);
    if stamp < first - max_diff_s || stamp > last + max_diff_s {
        return None;
    }
    let after = stamps.partition_point(|&s| s <= stamp).min(stamps.len() - 1);
    let to_after = stamps[after] - stamp;
    let to_before = after.checked_sub(1).map_or(f64::INFINITY, |before| stamp - stamps[before]);
    if to_after <= max_diff_s && to_after < to_before {
        Some(after)
    } else if to_before <= max_diff_s && to_before <= to_after {
        after.checked_sub(1)
    } else {
        None
    }
}

/// Stamps out of order, sorted with the first index of each. Among several as near, the one that comes
/// first in the file wins, whatever its side.
struct Unsorted(Vec<(f64, usize)>);

impl Unsorted {
    fn new(stamps: &[f64]) -> Self {
        let mut sorted: Vec<(f64, usize)> = stamps.iter().copied().zip(0..).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        sorted.dedup_by(|later, kept| later.0 == kept.0);
        Self(sorted)
    }

    fn nearest(&self, stamp: f64, max_diff_s: f64) -> Option<usize> {
        let after = self.0.partition_point(|&(s, _)| s < stamp);
        let difference = |k: usize| self.0.get(k).map(|&(s, _)| (s - stamp).abs());
        let to_after = difference(after);
        let to_before = after.checked_sub(1).and_then(difference);
        let least = to_after.into_iter().chain(to_before).reduce(f64::min)?;
        if least.is_nan() || least > max_diff_s {
            return None;
        }
        // Different stamps may be as near, one on each side or rounded to the same difference.
        let up = (after..).take_while(|&k| difference(k) == Some(least));
        let down = (0..after).rev().take_while(|&k| difference(k) == Some(least));
        up.chain(down).map(|k| self.0[k].1).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::Pose;
    use nalgebra::Vector3;

    /// The obvious search: the first index of the least difference.
    fn brute(asking: &[f64], answering: &[f64], max_diff_s: f64, offset_s: f64) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for (k, stamp) in asking.iter().enumerate() {
            let mut best = (f64::INFINITY, 0);
            for (j, other) in answering.iter().enumerate() {
                let difference = (other + offset_s - stamp).abs();
                if difference < best.0 {
                    best = (difference, j);
                }
            }
            if best.0 <= max_diff_s {
                pairs.push((k, best.1));
            }
        }
        pairs
    }

    struct Random(u64);

    impl Random {
        fn below(&mut self, bound: u64) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            self.0 % bound
        }
    }

    #[test]
    fn fast_and_obvious_search_agree() {
        let mut random = Random(9);
        for round in 0..400 {
            // Eighths and few of them, so that ties and repetitions occur.
            let mut stamps = |count: u64| -> Vec<f64> {
                (0..count).map(|_| random.below(4 * count) as f64 / 8.0).collect()
            };
            let (asking, mut answering) = (stamps(20), stamps(1 + round % 30));
            if round % 2 == 0 {
                // In ascending lists without repetitions the earlier index is the earlier stamp.
                answering.sort_by(f64::total_cmp);
                answering.dedup();
            } else if answering.is_sorted() {
                // Repetitions in ascending lists are the other test's.
                continue;
            }
            for (max_diff_s, offset_s) in [(0.0, 0.0), (0.125, 0.0), (0.25, 0.5), (1e9, -1.0)] {
                let fast = match_stamps(&asking, &answering, max_diff_s, offset_s);
                assert_eq!(fast, brute(&asking, &answering, max_diff_s, offset_s), "round {round}");
            }
        }
    }

    #[test]
    fn among_repeated_sorted_stamps_the_last_answers() {
        // The search for the insertion place goes behind all of the same stamp, and one back.
        assert_eq!(match_stamps(&[1.0], &[0.0, 1.0, 1.0, 2.0], 0.01, 0.0), [(0, 2)]);
        // At the very end the one before it answers: it is as near and earlier.
        assert_eq!(match_stamps(&[1.0], &[0.0, 1.0, 1.0], 0.01, 0.0), [(0, 1)]);
    }

    fn path(stamps: &[f64], x: f64) -> PosePath {
        let pose = |&s: &f64| Pose { position_m: Vector3::new(s, x, 0.0), ..Pose::identity() };
        PosePath::new(stamps.iter().map(pose).collect(), Some(stamps.to_vec())).unwrap()
    }

    #[test]
    fn the_one_with_fewer_poses_asks() {
        let (dense, sparse) = (path(&[0.0, 0.004, 1.0, 2.0], 0.0), path(&[0.002, 1.0], 1.0));
        let matching = Matching::default();
        let (reference, estimate) = associate(&dense, &sparse, &matching).unwrap();
        assert_eq!((reference.stamps_s().unwrap(), estimate.len()), (&[0.0, 1.0][..], 2));
        let (reference, estimate) = associate(&sparse, &dense, &matching).unwrap();
        assert_eq!((reference.len(), estimate.stamps_s().unwrap()), (2, &[0.0, 1.0][..]));
        // As many poses: the estimate asks, so both of its poses find the one of the reference.
        let (close, one) = (path(&[1.0, 1.004], 0.0), path(&[1.002, 9.0], 0.0));
        assert_eq!(associate(&one, &close, &matching).unwrap().0.stamps_s().unwrap(), &[1.002, 1.002]);
        assert_eq!(associate(&close, &one, &matching).unwrap().0.len(), 1);
    }

    #[test]
    fn the_offset_is_the_estimates() {
        let (reference, estimate) = (path(&[10.0, 11.0], 0.0), path(&[0.0, 1.0, 2.0], 0.0));
        let matching = Matching { offset_s: 10.0, ..Matching::default() };
        assert_eq!(associate(&reference, &estimate, &matching).unwrap().1.len(), 2);
        assert_eq!(
            associate(&estimate, &reference, &matching),
            Err(CompareError::NoMatches { max_diff_s: 0.01, offset_s: 10.0 })
        );
        let bare = PosePath::new(vec![Pose::identity()], None).unwrap();
        assert_eq!(associate(&reference, &bare, &matching), Err(CompareError::OneWithoutStamps));
    }
}
