//! Scores and verdicts, compared with the truth.

use std::collections::BTreeMap;

use super::result::{DriveResult, RunResult, Said};
use super::rule::{Rule, Saying, smaller};

/// Whether the first of a pair is better by each true error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Truth {
    pub(super) ate: Option<bool>,
    /// By ATE, RPE and SMD alike; `None` where they contradict each other.
    pub(super) all: Option<bool>,
    /// By the distance between sightings of one place.
    pub(super) consistency: Option<bool>,
    /// By sightings from independent segments only.
    pub(super) apart: Option<bool>,
}

impl Truth {
    pub(super) fn of(a: &RunResult, b: &RunResult) -> Self {
        let error = |run: &RunResult, name: &str| run.truth.get(name).copied();
        let by = |name: &&str| smaller(error(a, name), error(b, name));
        let all: Vec<Option<bool>> =
            ["ATE", "RPE", "SMD"].iter().filter(|name| error(a, name).is_some()).map(by).collect();
        let [consistency, apart] = [0, 1].map(|k| smaller(a.inconsistency_m[k], b.inconsistency_m[k]));
        let ate = by(&"ATE");
        Self { ate, all: ate.filter(|_| all.iter().all(|said| *said == ate)), consistency, apart }
    }

    /// Whether trajectory error and map consistency agree; `None` where one is unknown.
    pub(super) fn agree(&self) -> Option<bool> {
        Some(self.ate? == self.consistency?)
    }
}

/// How often a rule was right.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    pub(super) pairs: u32,
    pub(super) right: u32,
    pub(super) wrong: u32,
    pub(super) mixed: u32,
    /// Mixed, and better on the whole is the one that is.
    pub(super) mixed_right: u32,
    /// Leaning to the right side, decided or not.
    pub(super) sign: u32,
}

impl Tally {
    fn add(&mut self, saying: Saying, truth: Option<bool>) {
        let Some(a_better) = truth else { return };
        self.pairs += 1;
        match saying.said {
            Said::A | Said::B if (saying.said == Said::A) == a_better => self.right += 1,
            Said::A | Said::B => self.wrong += 1,
            Said::Mixed(a) => {
                self.mixed += 1;
                self.mixed_right += u32::from(a == a_better);
            }
            Said::Nothing => {}
        }
        self.sign += u32::from(saying.leaning == Some(a_better));
    }

    pub(super) fn share(&self, count: u32) -> f64 {
        f64::from(count) / f64::from(self.pairs.max(1))
    }

    /// Of the decided pairs, the share that is right.
    pub(super) fn of_decided(&self) -> f64 {
        f64::from(self.right) / f64::from((self.right + self.wrong).max(1))
    }
}

/// Every pair of some drives, with the answer of the rule and the wanted truth.
pub(super) fn tally(
    drives: &[&DriveResult],
    rule: &Rule,
    wanted: impl Fn(&RunResult, &RunResult, &Truth) -> Option<bool>,
) -> Tally {
    let mut tally = Tally::default();
    for drive in drives {
        for (pair, saying) in drive.pairs.iter().zip(rule.say_all(drive)) {
            let (a, b) = (&drive.runs[pair.a], &drive.runs[pair.b]);
            tally.add(saying, wanted(a, b, &Truth::of(a, b)));
        }
    }
    tally
}

/// One score over a drive's runs.
pub(super) fn column(drive: &DriveResult, score: &str) -> Vec<Option<f64>> {
    drive.runs.iter().map(|run| run.scores.get(score).copied().flatten()).collect()
}

/// A true error over a drive's runs.
pub(super) fn errors(drive: &DriveResult, name: &str) -> Vec<Option<f64>> {
    drive.runs.iter().map(|run| run.truth.get(name).copied()).collect()
}

/// Of the pairs whose order all true errors agree on, the share that a score puts in that order. A score that is equal or
/// missing for one of the two puts them in none.
pub(super) fn consistent_pairs(drive: &DriveResult, score: &str) -> f64 {
    let values = column(drive, score);
    let mut tally = Tally::default();
    for pair in &drive.pairs {
        let truth = Truth::of(&drive.runs[pair.a], &drive.runs[pair.b]);
        tally
            .add(Saying { said: Said::Nothing, leaning: smaller(values[pair.a], values[pair.b]) }, truth.all);
    }
    tally.share(tally.sign)
}

/// Whether the truth is the best of a drive's estimates by a score.
pub(super) fn truth_is_first(drive: &DriveResult, score: &str) -> bool {
    let values = column(drive, score);
    values[0].is_some_and(|truth| values[1..].iter().all(|value| value.is_none_or(|value| truth < value)))
}

/// Of the truth and the drifts, by their ATE: pairs in the right order by a score, and all pairs.
pub(super) fn ladder(drive: &DriveResult, score: &str) -> (u32, u32) {
    let on_ladder = drive.runs.iter().filter(|run| run.kind == "Truth" || run.kind == "Drift");
    let mut steps: Vec<(f64, Option<f64>)> = on_ladder
        .map(|run| (run.truth.get("ATE").copied().unwrap_or(0.0), run.scores.get(score).copied().flatten()))
        .collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pairs = super::observe::pairs(steps.len());
    pairs.fold((0, 0), |(right, all), (a, b)| {
        (right + u32::from(smaller(steps[a].1, steps[b].1) == Some(true)), all + 1)
    })
}

/// The kinds of error that occur, in the order in which they come.
pub(super) fn kinds(drives: &[&DriveResult]) -> Vec<String> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for drive in drives {
        for (index, run) in drive.runs.iter().enumerate() {
            seen.entry(&run.kind).or_insert(index);
        }
    }
    let mut kinds: Vec<_> = seen.into_iter().collect();
    kinds.sort_by_key(|(_, index)| *index);
    kinds.into_iter().map(|(kind, _)| kind.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(runs: &[(&str, f64, Option<f64>)]) -> DriveResult {
        let run = |&(kind, ate_m, score): &(&str, f64, Option<f64>)| RunResult {
            name: format!("{kind}-{ate_m}"),
            kind: kind.to_owned(),
            truth: BTreeMap::from(["ATE", "RPE", "SMD"].map(|name| (name.to_owned(), ate_m))),
            inconsistency_m: [None; 2],
            scores: BTreeMap::from([("score".to_owned(), score)]),
            coverage: None,
            coverage_revisit: None,
        };
        let pair = |(a, b)| super::super::result::PairResult {
            a,
            b,
            verdict: Said::Nothing,
            decided_at_m: None,
            drift: Said::Nothing,
            predicted: [1.0; 2],
            revisited: [0.0; 2],
            back: [0.0; 2],
            singles: BTreeMap::new(),
            batches: BTreeMap::new(),
        };
        DriveResult {
            drive: "one".to_owned(),
            held_out: false,
            seconds: 0.0,
            runs: runs.iter().map(run).collect(),
            pairs: super::super::observe::pairs(runs.len()).map(pair).collect(),
        }
    }

    #[test]
    fn order_ladder_and_the_first_are_counted() {
        let drive = drive(&[
            ("Truth", 0.0, Some(1.0)),
            ("Drift", 0.3, Some(2.0)),
            ("Drift", 1.0, Some(1.5)),
            ("Noise", 0.1, None),
        ]);
        // Of six pairs three are with the run that has no score, and one is upside down.
        assert!((consistent_pairs(&drive, "score") - 2.0 / 6.0).abs() < 1e-12);
        assert_eq!(ladder(&drive, "score"), (2, 3));
        assert!(truth_is_first(&drive, "score"));
        assert_eq!(kinds(&[&drive]), ["Truth", "Drift", "Noise"]);
    }

    #[test]
    fn a_tally_counts_each_saying_once() {
        let mut tally = Tally::default();
        for said in [Said::A, Said::B, Said::Mixed(true), Said::Mixed(false), Said::Nothing] {
            tally.add(Saying { said, leaning: Some(true) }, Some(true));
        }
        tally.add(Saying { said: Said::A, leaning: Some(true) }, None);
        let counts = (tally.pairs, tally.right, tally.wrong, tally.mixed, tally.mixed_right, tally.sign);
        assert_eq!(counts, (5, 1, 1, 2, 1, 5));
    }
}
