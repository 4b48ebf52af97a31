//! Tests whether two versions differ over several logs.

use dmp_reduce::{Confidence, Holm, sign_test, signs_needed};

use super::outcome::Outcome;

/// The number of logs on which each of two versions is better, and on which both were compared.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Signs {
    pub(super) a_better: u64,
    pub(super) b_better: u64,
    pub(super) compared: u64,
}

/// The result for a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Judged {
    pub(super) outcome: Outcome,
    /// The probability of signs at least as unequal as these.
    pub(super) p_value: f64,
    /// Number of logs needed for a verdict if all agree.
    pub(super) logs_needed: u64,
}

/// Tests every pair of versions by the sign test over the logs. The family-wise error rate is as asked, under
/// any dependence among the pairs (Holm).
pub(super) fn judge(pairs: &[Signs], confidence: Confidence) -> Vec<Judged> {
    let chances: Vec<f64> = pairs.iter().map(|signs| sign_test(signs.a_better, signs.b_better)).collect();
    let holm = Holm::of(&chances, 1.0 - confidence.level());
    let logs_needed = signs_needed(holm.error_of_next);
    let each = pairs.iter().zip(chances).zip(holm.decided);
    let judged = |((signs, p_value), is_decided): ((&Signs, f64), bool)| {
        let outcome = match is_decided {
            true => Outcome::Better,
            // Whatever the signs are.
            false if signs.compared < logs_needed => Outcome::TooFewLogs,
            false => Outcome::Undecided,
        };
        Judged { outcome, p_value, logs_needed }
    };
    each.map(judged).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signs(a_better: u64, b_better: u64, compared: u64) -> Signs {
        Signs { a_better, b_better, compared }
    }

    fn any_decided(pairs: &[Signs], confidence: Confidence) -> bool {
        judge(pairs, confidence).iter().any(|judged| judged.outcome == Outcome::Better)
    }

    fn levels() -> [Confidence; 3] {
        [Confidence::new(0.9).unwrap(), Confidence::new(0.95).unwrap(), Confidence::P99]
    }

    /// The probability that two equal versions are ranked apart, over all outcomes; a log decides with
    /// probability `share`.
    fn ranked_apart(logs: u64, share: f64, wins: f64, confidence: Confidence) -> f64 {
        let mut chance = 0.0;
        for a in 0..=logs {
            for b in 0..=logs - a {
                if any_decided(&[signs(a, b, logs)], confidence) {
                    let ways = choose(logs, a) * choose(logs - a, b);
                    let (of_a, of_b) = (share * wins, share * (1.0 - wins));
                    let none = 1.0 - share;
                    chance +=
                        ways * of_a.powi(a as i32) * of_b.powi(b as i32) * none.powi((logs - a - b) as i32);
                }
            }
        }
        chance
    }

    fn choose(n: u64, k: u64) -> f64 {
        (1..=k).fold(1.0, |ways, j| ways * (n - k + j) as f64 / j as f64)
    }

    #[test]
    fn equal_versions_are_ranked_apart_no_more_often_than_promised() {
        for confidence in levels() {
            for (logs, share) in [(4, 1.0), (8, 1.0), (12, 0.5), (12, 1.0), (30, 0.9), (40, 0.02)] {
                let chance = ranked_apart(logs, share, 0.5, confidence);
                assert!(chance <= 1.0 - confidence.level(), "{logs} logs, {share}: {chance}");
            }
        }
        // The test has power: it is not always undecided.
        assert!(ranked_apart(30, 1.0, 0.5, Confidence::new(0.9).unwrap()) > 0.04);
    }

    /// Three equal versions on twelve logs: on each log, all six orders are equally likely. Enumerates all
    /// counts of the orders.
    #[test]
    fn three_equal_versions_share_the_error() {
        const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        const LOGS: u64 = 12;
        fn count(left: u64, order: usize, ways: f64, wins: [[u64; 3]; 3], confidence: Confidence) -> f64 {
            let with = |mut wins: [[u64; 3]; 3], times: u64| {
                let [first, second, third] = ORDERS[order];
                for (better, worse) in [(first, second), (first, third), (second, third)] {
                    wins[better][worse] += times;
                }
                wins
            };
            if order + 1 == ORDERS.len() {
                let wins = with(wins, left);
                let pairs = [(0, 1), (0, 2), (1, 2)].map(|(a, b)| signs(wins[a][b], wins[b][a], LOGS));
                return if any_decided(&pairs, confidence) { ways } else { 0.0 };
            }
            let some = |times: u64| {
                count(left - times, order + 1, ways * choose(left, times), with(wins, times), confidence)
            };
            (0..=left).map(some).sum()
        }
        for confidence in levels() {
            let ways = count(LOGS, 0, 1.0, [[0; 3]; 3], confidence);
            let chance = ways / 6_f64.powi(LOGS as i32);
            assert!(chance > 0.0 && chance <= 1.0 - confidence.level(), "{}: {chance}", confidence.level());
        }
    }

    #[test]
    fn versions_that_differ_are_ranked_apart() {
        // Better on nineteen of twenty logs that decide.
        assert!(ranked_apart(12, 1.0, 0.95, Confidence::P99) > 0.85);
        assert!(ranked_apart(20, 0.9, 0.95, Confidence::P99) > 0.95);
        assert!(ranked_apart(12, 1.0, 1.0, Confidence::P99) == 1.0);
    }

    #[test]
    fn too_few_logs_say_so_and_nothing_else() {
        for logs in 0..8 {
            let judged = judge(&[signs(logs, 0, logs)], Confidence::P99);
            assert_eq!((judged[0].outcome, judged[0].logs_needed), (Outcome::TooFewLogs, 8), "{logs}");
        }
        let eight = judge(&[signs(0, 8, 8), signs(0, 0, 8)], Confidence::P99);
        // Two pairs share the error: 2^-7 is above 0.005.
        assert_eq!([eight[0].outcome, eight[1].outcome], [Outcome::TooFewLogs; 2]);
        let nine = judge(&[signs(0, 9, 9), signs(1, 1, 9)], Confidence::P99);
        assert_eq!([nine[0].outcome, nine[1].outcome], [Outcome::Better, Outcome::Undecided]);
        assert_eq!((nine[0].p_value, nine[1].logs_needed), (2.0 / 512.0, 8));
    }
}
