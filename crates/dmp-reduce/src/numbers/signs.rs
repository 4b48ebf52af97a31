//! What several logs say together: the sign test, intervals of medians, and an error that several tests share.

use super::student::Confidence;

/// How likely signs are to be as unequal by chance as these, to either side: the exact two-sided sign test.
///
/// A sign is a log on which one of two versions is better. Where neither tends to be, each sign is a throw of a fair coin,
/// and the chance is that of the binomial distribution. Logs that give no sign are not counted; without any it is 1.
///
/// ```
/// assert_eq!(dmp_reduce::sign_test(8, 0), 2.0 / 256.0);
/// assert_eq!(dmp_reduce::sign_test(2, 2), 1.0);
/// ```
pub fn sign_test(better: u64, worse: u64) -> f64 {
    (2.0 * at_most(better.min(worse), better + worse)).min(1.0)
}

/// The fewest signs that can be beyond chance, all to one side, where the two-sided error is at most this (above 0).
///
/// ```
/// assert_eq!(dmp_reduce::signs_needed(0.01), 8);
/// ```
pub fn signs_needed(error: f64) -> u64 {
    let mut signs = 0;
    while signs < 1100 && sign_test(signs, 0) > error {
        signs += 1;
    }
    signs
}

/// P(X ≤ k) of a fair coin thrown `n` times.
fn at_most(k: u64, n: u64) -> f64 {
    if k >= n {
        return 1.0;
    }
    // C(n, k) / 2^n, halved whenever it would grow: exact powers of two, nothing overflows on the way.
    let mut halves = n;
    let mut largest = 1.0_f64;
    for j in 1..=k {
        largest *= (n - k + j) as f64 / j as f64;
        while largest > 1.0 && halves > 0 {
            largest *= 0.5;
            halves -= 1;
        }
    }
    for _ in 0..halves.min(2000) {
        largest *= 0.5;
    }
    // The others, each as a part of the one above it.
    let (mut part, mut sum) = (1.0, 1.0);
    for i in (1..=k).rev() {
        part *= i as f64 / (n - i + 1) as f64;
        sum += part;
    }
    (largest * sum).min(1.0)
}

/// The middle of some values, and where the median of what they are drawn from lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Median {
    /// The median of the values.
    pub value: f64,
    /// Two of the values, between which the true median lies at the requested confidence; `None` where the values are too few for
    /// that.
    pub interval: Option<[f64; 2]>,
}

impl Median {
    /// Of finite values in any order; `None` where there are none. The interval takes nothing for granted of how they are
    /// distributed: it is the k-th smallest and the k-th largest value, with the largest k that is sure enough.
    ///
    /// ```
    /// use dmp_reduce::{Confidence, Median};
    ///
    /// let median = Median::of(&[3.0, 1.0, 2.0, 4.0, 8.0, 6.0, 7.0, 5.0], Confidence::P99).unwrap();
    /// assert_eq!((median.value, median.interval), (4.5, Some([1.0, 8.0])));
    /// ```
    pub fn of(values: &[f64], confidence: Confidence) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let value = match n {
            0 => return None,
            _ if n.is_multiple_of(2) => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
            _ => sorted[n / 2],
        };
        let error = 1.0 - confidence.level();
        let is_sure = |k: &usize| 2.0 * at_most(*k as u64 - 1, n as u64) <= error;
        let k = (1..=n / 2).take_while(is_sure).last();
        Some(Self { value, interval: k.map(|k| [sorted[k - 1], sorted[n - k]]) })
    }
}

/// What tests that share an error decide (Holm 1979).
#[derive(Debug, Clone, PartialEq)]
pub struct Holm {
    /// Which of them are beyond chance, in the order given.
    pub decided: Vec<bool>,
    /// The error at which the first of the others was tested, or the last where there is none.
    pub error_of_next: f64,
}

impl Holm {
    /// Of the chances of several tests: whatever depends on what, none that is true by chance alone is called decided more
    /// often than `error`.
    ///
    /// [`Reducer::comparisons`](crate::Reducer::comparisons) may share an error by fewer, as equality carries over from pair to pair. That two versions
    /// win equally often does not: with three versions, each can win more often against the next.
    pub fn of(chances: &[f64], error: f64) -> Self {
        let mut order: Vec<usize> = (0..chances.len()).collect();
        order.sort_by(|&a, &b| chances[a].total_cmp(&chances[b]));
        let mut decided = vec![false; chances.len()];
        let mut error_of_next = error;
        for (before, &test) in order.iter().enumerate() {
            error_of_next = error / (chances.len() - before) as f64;
            if chances[test] > error_of_next {
                break;
            }
            decided[test] = true;
        }
        Self { decided, error_of_next }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By throwing every sequence of coins.
    fn by_enumeration(better: u32, worse: u32) -> f64 {
        let n = better + worse;
        let off = better.abs_diff(worse);
        let as_unequal =
            (0..1_u32 << n).filter(|coins| coins.count_ones().abs_diff(n - coins.count_ones()) >= off);
        as_unequal.count() as f64 / f64::from(1_u32 << n)
    }

    #[test]
    fn the_sign_test_is_that_of_all_sequences_of_coins() {
        for n in 0..=16 {
            for better in 0..=n {
                let (got, expected) =
                    (sign_test(u64::from(better), u64::from(n - better)), by_enumeration(better, n - better));
                assert!((got - expected).abs() < 1e-14, "{better} of {n}: {got} {expected}");
            }
        }
    }

    /// From R: `2 * pbinom(k, n, 0.5)`, by its series in whole numbers for the last.
    #[test]
    fn many_signs_neither_overflow_nor_vanish() {
        assert!((sign_test(40, 60) / 0.056_887_933_640_98 - 1.0).abs() < 1e-10);
        assert!(sign_test(5000, 5000) == 1.0 && sign_test(0, 5000) == 0.0);
        let sides = sign_test(4800, 5200);
        assert!(sides > 6e-5 && sides < 7e-5, "{sides}");
    }

    #[test]
    fn as_many_signs_are_needed_as_can_be_beyond_chance() {
        for error in [0.5, 0.05, 0.01, 0.01 / 3.0, 0.001] {
            let needed = signs_needed(error);
            assert!(sign_test(needed, 0) <= error && sign_test(needed - 1, 0) > error, "{error}: {needed}");
        }
        // The table of docs/suite.md: 1, 3, 6 and 10 pairs.
        assert_eq!([1.0, 3.0, 6.0, 10.0].map(|pairs| signs_needed(0.01 / pairs)), [8, 10, 11, 11]);
    }

    /// Every order of n values about a true median is one of 2^n equally likely patterns of sides.
    #[test]
    fn intervals_of_medians_hold_as_often_as_they_say() {
        let level = |percent: f64| Confidence::new(percent / 100.0).unwrap();
        for n in 1..=14_u32 {
            let values: Vec<f64> = (0..n).map(f64::from).collect();
            for confidence in [level(50.0), level(90.0), level(95.0), Confidence::P99] {
                let Some([low, high]) = Median::of(&values, confidence).unwrap().interval else {
                    assert!(sign_test(u64::from(n), 0) > 1.0 - confidence.level(), "{n}");
                    continue;
                };
                // The median lies above `below` of the values.
                let holds = (0..1_u32 << n).filter(|sides| {
                    let below = f64::from(sides.count_ones());
                    low < below && below <= high
                });
                let share = holds.count() as f64 / f64::from(1_u32 << n);
                assert!(share >= confidence.level() - 1e-12, "{n}: {share}");
            }
        }
        assert_eq!(Median::of(&[], Confidence::P99), None);
        assert_eq!(
            Median::of(&[2.0, 1.0, 9.0], Confidence::P99),
            Some(Median { value: 2.0, interval: None })
        );
    }

    #[test]
    fn an_error_is_shared_step_by_step() {
        // 0.001 ≤ 0.04 / 4, but 0.015 > 0.04 / 3: the rest is not asked.
        let chances = [0.02, 0.001, 0.04, 0.015];
        let one = Holm { decided: vec![false, true, false, false], error_of_next: 0.04 / 3.0 };
        assert_eq!(Holm::of(&chances, 0.04), one);
        // 0.015 ≤ 0.05 / 3, 0.02 ≤ 0.05 / 2, 0.04 ≤ 0.05.
        assert_eq!(Holm::of(&chances, 0.05), Holm { decided: vec![true; 4], error_of_next: 0.05 });
        assert_eq!(Holm::of(&[], 0.05), Holm { decided: Vec::new(), error_of_next: 0.05 });
    }
}
