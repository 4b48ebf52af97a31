//! What a reducer answers, once it has seen its frames.

use super::compare::{Comparison, chance, compare};
use super::family::EqualPairs;
use super::scale_comparison::Asked;
use crate::numbers::Confidence;
use crate::reducer::Reducer;
use crate::residual::{Basis, CV, NEAR, WIDEST};
use crate::sums::{Estimate, PairTotals, Ratio, RunSums, pairs_of};

/// The scores of one run over all frames added.
#[derive(Debug, Clone, PartialEq)]
pub struct RunScores {
    /// Its sums, from which all scores come.
    pub sums: RunSums,
    /// As [`RunSums::r_cv_m2`], each with an interval of its own: (scale in metres, score).
    pub r_cv_m2: [(f64, Option<Estimate>); CV - WIDEST],
    /// As [`RunSums::r_near_m2`], each with an interval of its own: (scale in metres, score).
    pub r_near_m2: [(f64, Option<Estimate>); NEAR],
}

/// What comes of comparing every two runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparisons {
    /// How sure each interval is, so that all verdicts together are as sure as was asked for.
    pub of_each_interval: Confidence,
    /// Every pair, in the order (0, 1), (0, 2), …, (1, 2), …
    pub pairs: Vec<Comparison>,
}

impl Reducer {
    /// The sums and scores of the `run`-th run, with intervals that are each as sure as `confidence`.
    ///
    /// # Panics
    /// Where there is no such run.
    pub fn scores(&self, run: usize, confidence: Confidence) -> RunScores {
        let totals = &self.runs[run];
        let scales = self.layout.scales;
        let estimate = |ratio: &Ratio| ratio.mean().map(|mean| mean.within(confidence));
        RunScores {
            sums: totals.sums,
            r_cv_m2: std::array::from_fn(|k| (scales.lengths().cv_m[WIDEST + k], estimate(&totals.cv[k]))),
            r_near_m2: std::array::from_fn(|k| (scales.lengths().near_m[k], estimate(&totals.near[k]))),
        }
    }

    /// Compares every two runs so that all verdicts together are as sure as `confidence`: where runs are equal, the chance that any
    /// two of them get different ranks is what the confidence leaves.
    ///
    /// Each pair is looked at at some scales, which share its error. The pairs share it by as many as can be equal, given
    /// those that are found to differ: a pair that differs needs no share.
    pub fn comparisons(&self, confidence: Confidence) -> Comparisons {
        let equal = EqualPairs::among(self.runs.len());
        let chances: Vec<f64> = self.pairs.iter().map(|pair| chance(pair, self.layout.scales)).collect();
        let mut differing = 0;
        // From step to step less error is to be shared, and more pairs may be found to differ.
        let shared_by = loop {
            let shared_by = equal.most(differing);
            let error = (1.0 - confidence.level()) / shared_by as f64;
            let found = chances.iter().filter(|&&chance| chance <= error).count();
            if found <= differing {
                break shared_by;
            }
            differing = found;
        };
        let of_pair = confidence.of_each_look(shared_by as u32);
        // One level for all: pairs with fewer scales are a little surer than they would have to be.
        let scales = |pair: &PairTotals| pair.basis.cascade_m(self.layout.scales).len();
        let of_each_interval = of_pair.of_each_look(self.pairs.iter().map(scales).max().unwrap_or(1) as u32);
        let compared = |(a, b)| self.compare(a, b, of_each_interval);
        Comparisons { of_each_interval, pairs: pairs_of(self.runs.len()).map(compared).collect() }
    }

    /// Compares run `a` with run `b`, a < b, by intervals that are each as sure as `confidence`.
    ///
    /// ```
    /// use dmp_reduce::{Basis, Confidence, FrameSums, Layout, Reducer, Residuals, UndecidedReason, Verdict};
    ///
    /// let layout = Layout::new(3, vec![Basis::CrossValidated; 2]);
    /// let mut reducer = Reducer::new(layout.clone());
    /// let mut frame = FrameSums::new(layout.bases());
    /// frame.add_return(&[Residuals::all(0.125), Residuals::all(0.375)]);
    /// for ordinal in 0..3 {
    ///     reducer.add_frame(ordinal, &frame)?;
    /// }
    /// let pair = reducer.compare(0, 1, Confidence::P99);
    /// assert_eq!((pair.common_returns, pair.scales[0].scale_m), (3, 10.0));
    /// let difference_m2 = pair.scales[0].difference.unwrap().value_m2;
    /// assert!((difference_m2 - (0.015625 - 0.140625)).abs() < 1e-9);
    /// // Three frames say nothing of how far they scatter.
    /// assert_eq!(pair.verdict, Verdict::Undecided { reason: UndecidedReason::TooFewFrames { frames: 3 } });
    /// # Ok::<(), dmp_reduce::ReduceError>(())
    /// ```
    ///
    /// # Panics
    /// Where there is no such pair.
    pub fn compare(&self, a: usize, b: usize, confidence: Confidence) -> Comparison {
        let runs = self.runs.len();
        assert!(a < b && b < runs, "no pair ({a}, {b}) of {runs} runs");
        // Pairs stand row by row; before row `a` there are rows of runs − 1, runs − 2, … pairs.
        let index = a * (2 * runs - a - 1) / 2 + (b - a - 1);
        let pair = &self.pairs[index];
        let predicted = [a, b].map(|run| match pair.basis {
            Basis::CrossValidated => self.runs[run].sums.with_independent(),
            Basis::Near => self.runs[run].sums.with_first(),
        });
        let asked = Asked { scales: self.layout.scales, frames: self.layout.frames, confidence };
        compare([a, b], predicted, pair, asked)
    }
}
