//! How often samples are right.

use dmp::Confidence;
use dmp_reduce::{Promise, Reducer, Verdict};

use super::full::{Full, decided};

/// How often something held, of how many.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Share {
    held: u64,
    pub(super) of: u64,
}

impl Share {
    pub(super) fn add(&mut self, held: bool) {
        self.held += u64::from(held);
        self.of += 1;
    }

    pub(super) fn merge(&mut self, other: Self) {
        self.held += other.held;
        self.of += other.of;
    }

    pub(super) fn show(self) -> String {
        if self.of == 0 { "–".to_owned() } else { format!("{:.4}", self.held as f64 / self.of as f64) }
    }
}

/// What samples of one size say.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::study) struct Samples {
    sign: Share,
    covered: Share,
    runs_covered: Share,
    decided: Share,
    wrong: Share,
    undecided_by_all: Share,
    mixed: Share,
    mixed_by_all: Share,
}

impl Samples {
    pub(in crate::study) const HEAD: &str = "drive           scans  pairs  sample    sign   covered   of runs   decided    wrong by chance    mixed   of all";

    pub(in crate::study) fn add(&mut self, sample: &Reducer, full: &Full) {
        for (run, value) in full.runs.iter().enumerate() {
            let interval =
                sample.scores(run, Confidence::P99).r_cv_m2[0].1.and_then(|estimate| estimate.interval);
            if let (Some(interval), Some(value)) = (interval, value) {
                self.runs_covered.add((interval.low_m2..=interval.high_m2).contains(value));
            }
        }
        for (index, said) in sample.comparisons(Promise::default()).pairs.iter().enumerate() {
            let all = &full.pairs[index];
            for (ours, all) in said.scales.iter().zip(&all.scales) {
                if let (Some(interval), Some(all)) = (ours.interval(), all.difference) {
                    self.covered.add((interval.low_m2..=interval.high_m2).contains(&all.value_m2));
                }
            }
            if let (Some(ours), Some(all)) = (said.scales[0].difference, all.scales[0].difference) {
                self.sign.add((ours.value_m2 < 0.0) == (all.value_m2 < 0.0));
            }
            self.decided.add(decided(said).is_some());
            if decided(said).is_some() {
                self.wrong.add(full.contradicts(index, said));
                self.undecided_by_all.add(decided(all).is_none());
                self.mixed.add(matches!(said.verdict, Verdict::Mixed { .. }));
            }
            if decided(all).is_some() {
                self.mixed_by_all.add(matches!(all.verdict, Verdict::Mixed { .. }));
            }
        }
    }

    pub(in crate::study) fn merge(&mut self, other: &Self) {
        let Self { sign, covered, runs_covered, decided, wrong, undecided_by_all, mixed, mixed_by_all } =
            other;
        self.sign.merge(*sign);
        self.covered.merge(*covered);
        self.runs_covered.merge(*runs_covered);
        self.decided.merge(*decided);
        self.wrong.merge(*wrong);
        self.undecided_by_all.merge(*undecided_by_all);
        self.mixed.merge(*mixed);
        self.mixed_by_all.merge(*mixed_by_all);
    }

    /// A line of the table; `of` are the scans and the pairs of one drive.
    pub(in crate::study) fn print(&self, drive: &str, of: Option<(usize, usize)>, size: u64) {
        let [scans, pairs] =
            of.map_or_else(Default::default, |(scans, pairs)| [scans.to_string(), pairs.to_string()]);
        println!(
            "{drive:<14}{scans:>7}{pairs:>7}{size:>8}{:>8}{:>10}{:>10}{:>10}{:>9}{:>10}{:>9}{:>9}",
            self.sign.show(),
            self.covered.show(),
            self.runs_covered.show(),
            self.decided.show(),
            self.wrong.show(),
            self.undecided_by_all.show(),
            self.mixed.show(),
            self.mixed_by_all.show()
        );
    }
}
