//! How well two orders of the same things agree (Kendall tau-b, Spearman rho), and how well a score
//! finds what it should (precision and recall).
//!
//! Values stand in pairs by their index. A pair in which one value is `None` or not a number is left
//! out, as if neither had been measured; so the answers of two correlations with different gaps are about
//! different things. Lists of different lengths are compared over the shorter.
//!
//! ```
//! use dmp_truth::rank::{kendall_tau_b, spearman_rho};
//!
//! let (score, error_m) = ([0.1, 0.2, 0.4, 0.3].map(Some), [1.0, 2.0, 3.0, 4.0].map(Some));
//! assert_eq!(kendall_tau_b(&score, &error_m), Some(4.0 / 6.0));
//! assert_eq!(spearman_rho(&score, &error_m), Some(0.8));
//! ```

/// The pairs of which both values are numbers.
fn complete(a: &[Option<f64>], b: &[Option<f64>]) -> Vec<(f64, f64)> {
    let both = a.iter().zip(b).filter_map(|(&a, &b)| Some((a?, b?)));
    both.filter(|(a, b)| !a.is_nan() && !b.is_nan()).collect()
}

/// Kendall's tau-b (Kendall 1945): concordant less discordant pairs, over the geometric mean of the
/// pairs not tied in `a` and those not tied in `b`. In [-1, 1]; `None` where a list has no two different
/// values. `O(n log n)` (Knight 1966).
pub fn kendall_tau_b(a: &[Option<f64>], b: &[Option<f64>]) -> Option<f64> {
    let mut both = complete(a, b);
    both.sort_by(|x, y| ordered(x.0, y.0).then(ordered(x.1, y.1)));
    let pairs = choose_two(both.len() as u64);
    let tied_a = tied(&both, |x, y| x.0 == y.0);
    let tied_both = tied(&both, |x, y| x == y);
    let mut of_b: Vec<f64> = both.iter().map(|pair| pair.1).collect();
    let discordant = sort_counting_swaps(&mut of_b);
    let tied_b = tied(&of_b, |x, y| x == y);
    let (untied_a, untied_b) = (pairs - tied_a, pairs - tied_b);
    if untied_a == 0 || untied_b == 0 {
        return None;
    }
    // Of the pairs tied in neither, those not discordant are concordant.
    let untied = (pairs + tied_both) as i128 - (tied_a + tied_b) as i128;
    let excess = untied - 2 * i128::from(discordant);
    let square = u128::from(untied_a) * u128::from(untied_b);
    Some((excess as f64 / (square as f64).sqrt()).clamp(-1.0, 1.0))
}

/// Spearman's rho: the correlation of the ranks, ties having the mean of theirs. In [-1, 1]; `None` where
/// a list has no two different values.
pub fn spearman_rho(a: &[Option<f64>], b: &[Option<f64>]) -> Option<f64> {
    let (a, b): (Vec<f64>, Vec<f64>) = complete(a, b).into_iter().unzip();
    let (a, b) = (doubled_ranks(&a), doubled_ranks(&b));
    // Twice the ranks are whole, and so is their mean: exact until the root.
    let mean = a.len() as i128 + 1;
    let dot = |x: &[u64], y: &[u64]| -> i128 {
        x.iter().zip(y).map(|(&x, &y)| (i128::from(x) - mean) * (i128::from(y) - mean)).sum()
    };
    let (of_a, of_b) = (dot(&a, &a), dot(&b, &b));
    if of_a == 0 || of_b == 0 {
        return None;
    }
    Some((dot(&a, &b) as f64 / (of_a as f64 * of_b as f64).sqrt()).clamp(-1.0, 1.0))
}

/// One point of a precision–recall curve: the candidates with at least this score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrecisionRecall {
    /// The lowest score among them.
    pub score: f64,
    /// Share of them that is right.
    pub precision: f64,
    /// Share of all that is right which is among them.
    pub recall: f64,
    /// How many they are.
    pub taken: usize,
    /// How many of them are right.
    pub found: usize,
}

/// The precision–recall curve of candidates, higher scores first; candidates of one score enter
/// together. A candidate with the score `None` (or not a number) was never proposed: it is on no point,
/// but if it is right it counts as missed. Empty where nothing is right.
pub fn precision_recall(scores: &[Option<f64>], right: &[bool]) -> Vec<PrecisionRecall> {
    let all = scores.iter().zip(right).filter(|(_, right)| **right).count();
    if all == 0 {
        return Vec::new();
    }
    let proposed = scores.iter().zip(right).filter_map(|(&score, &right)| Some((score?, right)));
    let mut ranked: Vec<(f64, bool)> = proposed.filter(|(score, _)| !score.is_nan()).collect();
    ranked.sort_by(|x, y| ordered(y.0, x.0));
    let (mut taken, mut found) = (0, 0);
    let same_score = |x: &(f64, bool), y: &(f64, bool)| x.0 == y.0;
    let points = ranked.chunk_by(same_score).map(|group| {
        taken += group.len();
        found += group.iter().filter(|candidate| candidate.1).count();
        let (precision, recall) = (found as f64 / taken as f64, found as f64 / all as f64);
        PrecisionRecall { score: group[0].0, precision, recall, taken, found }
    });
    points.collect()
}

/// Average precision: the precision at each point of [`precision_recall`], weighted by how much recall
/// has grown there. In [0, 1]; `None` where nothing is right.
pub fn average_precision(scores: &[Option<f64>], right: &[bool]) -> Option<f64> {
    if !scores.iter().zip(right).any(|(_, &right)| right) {
        return None;
    }
    let mut before = 0.0;
    let steps = precision_recall(scores, right).into_iter().map(|point| {
        let grown = point.recall - before;
        before = point.recall;
        point.precision * grown
    });
    Some(steps.sum())
}

/// The order of numbers that are not NaN, with -0 and 0 the same.
fn ordered(a: f64, b: f64) -> std::cmp::Ordering {
    a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
}

fn choose_two(count: u64) -> u64 {
    count * count.saturating_sub(1) / 2
}

/// Pairs within runs of neighbours that are the same.
fn tied<T>(sorted: &[T], same: impl Fn(&T, &T) -> bool) -> u64 {
    sorted.chunk_by(same).map(|run| choose_two(run.len() as u64)).sum()
}

/// Sorts and says how many pairs were in the wrong order.
fn sort_counting_swaps(values: &mut [f64]) -> u64 {
    let half = values.len() / 2;
    if half == 0 {
        return 0;
    }
    let mut swaps = sort_counting_swaps(&mut values[..half]) + sort_counting_swaps(&mut values[half..]);
    let (mut left, mut right) = (values[..half].iter().peekable(), values[half..].iter().peekable());
    let mut merged = Vec::with_capacity(values.len());
    while let (Some(&&l), Some(&&r)) = (left.peek(), right.peek()) {
        if r < l {
            swaps += left.len() as u64;
            merged.extend(right.next());
        } else {
            merged.extend(left.next());
        }
    }
    merged.extend(left.chain(right));
    values.copy_from_slice(&merged);
    swaps
}

/// Twice the rank of each value, from 2; ties have twice the mean of their ranks.
fn doubled_ranks(values: &[f64]) -> Vec<u64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| ordered(values[i], values[j]));
    let mut ranks = vec![0; values.len()];
    let mut before = 0;
    for run in order.chunk_by(|&i, &j| values[i] == values[j]) {
        let (first, last) = (before + 1, before + run.len());
        run.iter().for_each(|&i| ranks[i] = (first + last) as u64);
        before = last;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().copied().map(Some).collect()
    }

    /// Every pair looked at, as the definition has it.
    fn tau_b_oracle(a: &[f64], b: &[f64]) -> Option<f64> {
        let (mut excess, mut untied_a, mut untied_b) = (0.0, 0.0, 0.0);
        for i in 0..a.len() {
            for j in 0..i {
                let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
                let (in_a, in_b) = (sign(a[i] - a[j]), sign(b[i] - b[j]));
                excess += in_a * in_b;
                untied_a += in_a * in_a;
                untied_b += in_b * in_b;
            }
        }
        (untied_a * untied_b > 0.0).then(|| excess / (untied_a * untied_b).sqrt())
    }

    /// Pearson's correlation of ranks that are counted, not sorted.
    fn rho_oracle(a: &[f64], b: &[f64]) -> Option<f64> {
        let rank = |values: &[f64], x: f64| {
            let below = values.iter().filter(|v| **v < x).count() as f64;
            let same = values.iter().filter(|v| **v == x).count() as f64;
            below + 0.5 * (same + 1.0)
        };
        let ranks = |values: &[f64]| values.iter().map(|&x| rank(values, x)).collect::<Vec<_>>();
        let (a, b) = (ranks(a), ranks(b));
        let mean = 0.5 * (a.len() as f64 + 1.0);
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean)).sum::<f64>();
        let norm = (dot(&a, &a) * dot(&b, &b)).sqrt();
        (norm > 0.0).then(|| dot(&a, &b) / norm)
    }

    fn random(state: &mut u64, below: u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) % below) as f64
    }

    #[test]
    fn both_correlations_equal_their_definitions() {
        let mut state = 3;
        for round in 0..300_u64 {
            let mut list = || (0..round % 25).map(|_| random(&mut state, 2 + round % 17)).collect::<Vec<_>>();
            let (a, b) = (list(), list());
            for (found, oracle) in [
                (kendall_tau_b(&some(&a), &some(&b)), tau_b_oracle(&a, &b)),
                (spearman_rho(&some(&a), &some(&b)), rho_oracle(&a, &b)),
            ] {
                match (found, oracle) {
                    (Some(found), Some(oracle)) => assert!((found - oracle).abs() < 1e-14, "{a:?} {b:?}"),
                    (found, oracle) => assert_eq!(found, oracle),
                }
            }
        }
    }

    #[test]
    fn correlations_by_hand() {
        let (up, down) = (some(&[1.0, 2.0, 3.0, 4.0]), some(&[4.0, 3.0, 2.0, 1.0]));
        assert_eq!((kendall_tau_b(&up, &up), spearman_rho(&up, &down)), (Some(1.0), Some(-1.0)));
        // One exchange of neighbours: (5 - 1) / 6, and 1 - 6 * 2 / (4 * 15).
        let nearly = some(&[1.0, 3.0, 2.0, 4.0]);
        assert!((kendall_tau_b(&up, &nearly).unwrap() - 4.0 / 6.0).abs() < 1e-15);
        assert!((spearman_rho(&up, &nearly).unwrap() - 0.8).abs() < 1e-15);
        assert_eq!((kendall_tau_b(&up, &some(&[5.0; 4])), spearman_rho(&[], &[])), (None, None));
        assert_eq!(kendall_tau_b(&some(&[-0.0, 0.0]), &some(&[1.0, 2.0])), None);
    }

    #[test]
    fn incomplete_pairs_are_left_out() {
        let a = [Some(1.0), None, Some(2.0), Some(f64::NAN), Some(3.0), Some(9.0)];
        let b = [Some(1.0), Some(7.0), Some(2.0), Some(-4.0), Some(3.0), None];
        assert_eq!((kendall_tau_b(&a, &b), spearman_rho(&a, &b)), (Some(1.0), Some(1.0)));
    }

    #[test]
    fn average_precision_by_hand_and_by_definition() {
        // Right at the ranks 1, 3 and 4, one right never proposed: (1 + 2/3 + 3/4) / 4.
        let scores = [Some(0.9), Some(0.8), Some(0.7), Some(0.6), None];
        let right = [true, false, true, true, true];
        let expected = (1.0 + 2.0 / 3.0 + 0.75) / 4.0;
        assert!((average_precision(&scores, &right).unwrap() - expected).abs() < 1e-15);
        // Equal scores enter together: two of three are right at the only point.
        let tied = average_precision(&[Some(1.0); 3], &[true, false, true]).unwrap();
        assert!((tied - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(average_precision(&scores, &[false; 5]), None);
        assert_eq!(average_precision(&[None], &[true]), Some(0.0));

        let mut state = 8;
        for _ in 0..200 {
            let scores: Vec<f64> = (0..15).map(|_| random(&mut state, 8)).collect();
            let right: Vec<bool> = (0..15).map(|_| random(&mut state, 2) == 1.0).collect();
            let all = right.iter().filter(|r| **r).count();
            if all == 0 {
                continue;
            }
            // The precision at each right one's own score, every one weighing as much.
            let at_least = |limit: f64| scores.iter().zip(&right).filter(move |(s, _)| **s >= limit);
            let precision = |limit: f64| {
                at_least(limit).filter(|(_, r)| **r).count() as f64 / at_least(limit).count() as f64
            };
            let oracle: f64 =
                scores.iter().zip(&right).filter(|(_, r)| **r).map(|(s, _)| precision(*s) / all as f64).sum();
            assert!((average_precision(&some(&scores), &right).unwrap() - oracle).abs() < 1e-14);
        }
    }
}
