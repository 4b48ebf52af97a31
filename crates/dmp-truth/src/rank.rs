//! How well two orders of the same things agree: Kendall tau-b, Spearman rho.
//!
//! Values stand in pairs by their index. A pair in which one value is `None` or not a number is excluded.
//! Lists of different lengths are compared over the shorter.
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
/// values. `O(n²)`.
pub fn kendall_tau_b(a: &[Option<f64>], b: &[Option<f64>]) -> Option<f64> {
    let both = complete(a, b);
    let (mut excess, mut untied_a, mut untied_b) = (0_i64, 0_u64, 0_u64);
    for (k, x) in both.iter().enumerate() {
        for y in &both[..k] {
            let (in_a, in_b) = (ordered(x.0, y.0) as i64, ordered(x.1, y.1) as i64);
            excess += in_a * in_b;
            untied_a += in_a.unsigned_abs();
            untied_b += in_b.unsigned_abs();
        }
    }
    let square = u128::from(untied_a) * u128::from(untied_b);
    (square > 0).then(|| (excess as f64 / (square as f64).sqrt()).clamp(-1.0, 1.0))
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

/// The order of numbers that are not NaN, with -0 and 0 the same.
fn ordered(a: f64, b: f64) -> std::cmp::Ordering {
    a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
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

    #[test]
    fn spearmans_rho_equals_its_definition() {
        let mut state = 3_u64;
        for round in 0..300_u64 {
            let mut list = || -> Vec<f64> {
                let mut draw = |_| {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    ((state >> 33) % (2 + round % 17)) as f64
                };
                (0..round % 25).map(&mut draw).collect()
            };
            let (a, b) = (list(), list());
            match (spearman_rho(&some(&a), &some(&b)), rho_oracle(&a, &b)) {
                (Some(found), Some(oracle)) => assert!((found - oracle).abs() < 1e-14, "{a:?} {b:?}"),
                (found, oracle) => assert_eq!(found, oracle),
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
        // Of six pairs one is tied in the first list and one is discordant: (4 - 1) / sqrt(5 * 6).
        let tied = kendall_tau_b(&some(&[1.0, 1.0, 2.0, 3.0]), &some(&[1.0, 2.0, 4.0, 3.0])).unwrap();
        assert!((tied - 3.0 / 30.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn incomplete_pairs_are_excluded() {
        let a = [Some(1.0), None, Some(2.0), Some(f64::NAN), Some(3.0), Some(9.0)];
        let b = [Some(1.0), Some(7.0), Some(2.0), Some(-4.0), Some(3.0), None];
        assert_eq!((kendall_tau_b(&a, &b), spearman_rho(&a, &b)), (Some(1.0), Some(1.0)));
    }
}
