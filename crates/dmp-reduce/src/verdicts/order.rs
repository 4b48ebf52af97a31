//! Runs in an order, along what is decided between pairs of them.

use std::cmp::Ordering;

/// A run in its place of the order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ranked {
    /// Which run.
    pub run: usize,
    /// Whether nothing decides between it and the next one listed: "=".
    pub tied_with_next: bool,
}

/// Lists the runs from best to worst: along the `decided` pairs (better, worse), which form a partial
/// order, and where these leave a choice by ascending score, `None` last, then in the order given.
///
/// Neighbours in the list are tied where their own pair is not decided. Should the decided pairs run
/// in a cycle, the runs on it are listed together by their scores, and tied.
///
/// # Panics
/// Where a pair names a run without a score in `scores_m2`.
pub fn order_runs(scores_m2: &[Option<f64>], decided: &[(usize, usize)]) -> Vec<Ranked> {
    let runs = scores_m2.len();
    let beats = above(runs, decided);
    let cycle = |i: usize, j: usize| i != j && beats[i][j] && beats[j][i];
    let mut by_score: Vec<usize> = (0..runs).collect();
    by_score.sort_by(|&i, &j| ascending(scores_m2[i], scores_m2[j]));

    let mut listed: Vec<usize> = Vec::with_capacity(runs);
    let mut left = by_score;
    // While any is left one is free: a cycle counts as one run, and what remains is without cycles.
    let is_free = |left: &[usize], i: usize| left.iter().all(|&j| !beats[j][i] || beats[i][j]);
    while let Some(next) = left.iter().copied().find(|&i| is_free(&left, i)) {
        let together = |i: usize| i == next || cycle(i, next);
        listed.extend(left.iter().copied().filter(|&i| together(i)));
        left.retain(|&i| !together(i));
    }
    let tied = |i: usize, j: usize| cycle(i, j) || !(decided.contains(&(i, j)) || decided.contains(&(j, i)));
    let next = listed.iter().copied().skip(1).map(Some).chain([None]);
    listed
        .iter()
        .zip(next)
        .map(|(&run, next)| Ranked { run, tied_with_next: next.is_some_and(|next| tied(run, next)) })
        .collect()
}

/// Which run is above which, over any chain of decided pairs.
fn above(runs: usize, decided: &[(usize, usize)]) -> Vec<Vec<bool>> {
    let mut beats = vec![vec![false; runs]; runs];
    for &(better, worse) in decided {
        beats[better][worse] = true;
    }
    for via in 0..runs {
        let below = beats[via].clone();
        for row in beats.iter_mut().filter(|row| row[via]) {
            for (beaten, &also) in row.iter_mut().zip(&below) {
                *beaten |= also;
            }
        }
    }
    beats
}

fn ascending(a: Option<f64>, b: Option<f64>) -> Ordering {
    match (a, b) {
        (Some(a), Some(b)) => a.total_cmp(&b),
        (a, b) => b.is_some().cmp(&a.is_some()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(scores: &[f64], decided: &[(usize, usize)], expected: &str) {
        let scores: Vec<_> = scores.iter().map(|&s| s.is_finite().then_some(s)).collect();
        let order = order_runs(&scores, decided);
        let mut text = String::new();
        for ranked in order {
            text += &ranked.run.to_string();
            text += if ranked.tied_with_next { "=" } else { " " };
        }
        assert_eq!(text.trim_end(), expected);
    }

    #[test]
    fn verdicts_come_before_scores() {
        check(&[1.0, 2.0, 3.0], &[], "0=1=2");
        check(&[1.0, 2.0, 3.0], &[(2, 0)], "1=2 0");
        check(&[1.0, 2.0, 3.0], &[(2, 0), (2, 1)], "2 0=1");
        check(&[1.0, 2.0, 3.0], &[(2, 1), (1, 0), (2, 0)], "2 1 0");
        // Decided only by a chain: neighbours are asked for their own pair.
        check(&[1.0, 2.0, 3.0, 0.5], &[(2, 1), (1, 0)], "3=2 1 0");
        check(&[], &[], "");
        check(&[1.0], &[], "0");
    }

    #[test]
    fn equal_scores_keep_the_given_order_and_none_comes_last() {
        check(&[f64::NAN, 2.0, 1.0, 2.0, f64::NAN], &[], "2=1=3=0=4");
    }

    #[test]
    fn a_cycle_is_a_tie() {
        check(&[3.0, 2.0, 1.0], &[(0, 1), (1, 2), (2, 0)], "2=1=0");
        // A cycle of 1, 2, 3 below 0 and above 4.
        let cycle = [(1, 2), (2, 3), (3, 1), (0, 2), (3, 4), (2, 4), (1, 4)];
        check(&[9.0, 3.0, 1.0, 2.0, 0.0], &cycle, "0 2=3=1 4");
    }

    proptest! {
        #[test]
        fn every_run_is_listed_once_and_along_the_verdicts(
            scores in prop::collection::vec(prop::option::of(0.0..1.0f64), 9),
            decided in prop::collection::vec((0usize..9, 0usize..9), 0..12),
        ) {
            let decided: Vec<_> = decided.into_iter().filter(|(i, j)| i != j).collect();
            let order = order_runs(&scores, &decided);
            let place = |run| order.iter().position(|r| r.run == run).unwrap();
            prop_assert_eq!((order.len(), (0..9).map(place).sum::<usize>()), (9, 36));
            let beats = above(9, &decided);
            for &(better, worse) in &decided {
                prop_assert!(beats[worse][better] || place(better) < place(worse));
            }
            prop_assert!(!order[8].tied_with_next);
        }
    }
}
