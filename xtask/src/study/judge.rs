//! Scores and verdicts judged by the truth.

use std::collections::BTreeMap;

use super::observe::CV_M;
use super::result::{DriveResult, RunResult, Said};
use super::rule::{Rule, Saying, smaller};

/// A way to sum up how far apart sightings of one place lie.
#[derive(Debug, Clone, Copy)]
pub(super) enum Spread {
    /// The mean distance in metres, over these pairs of sightings.
    Distance(&'static str),
    /// The root of the mean square, truncated at the scale in question.
    Root(&'static str),
}

/// The one that is meant where nothing else is said.
pub(super) const CONSISTENCY: Spread = Spread::Distance("any, by pairs");

impl Spread {
    /// In metres; `None` where it was not measured.
    pub(super) fn of(self, run: &RunResult, scale_m: f64) -> Option<f64> {
        match self {
            Self::Distance(pairs) => run.inconsistency.get(pairs).map(|spread| spread.distance_m),
            Self::Root(pairs) => {
                let k = CV_M.iter().position(|t| *t == scale_m)?;
                run.inconsistency.get(pairs).map(|spread| spread.squares_m2[k].sqrt())
            }
        }
    }
}

/// Whether the first of a pair is better by each true error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Truth {
    pub(super) ate: Option<bool>,
    pub(super) rpe: Option<bool>,
    /// By ATE, RPE and SMD alike; `None` where they contradict each other.
    pub(super) all: Option<bool>,
    /// By the distance between sightings of one place.
    pub(super) consistency: Option<bool>,
}

impl Truth {
    /// Whether trajectory error and map consistency say the same; `None` where one says nothing.
    pub(super) fn agree(&self) -> Option<bool> {
        Some(self.ate? == self.consistency?)
    }
}

/// The true errors that must say the same for a pair to count as known.
const ERRORS: [&str; 3] = ["ATE", "RPE", "SMD"];

/// What is true of two estimates, where the question is asked at truncation `scale_m`.
pub(super) fn truth_of(a: &RunResult, b: &RunResult, scale_m: f64) -> Truth {
    let error = |run: &RunResult, name: &str| run.truth.get(name).copied();
    let by = |name: &str| smaller(error(a, name), error(b, name));
    let known = ERRORS.iter().filter(|name| error(a, name).is_some());
    let all: Vec<Option<bool>> = known.map(|name| by(name)).collect();
    let all = all[0].filter(|_| all.iter().all(|said| *said == all[0]));
    let consistency = smaller(CONSISTENCY.of(a, scale_m), CONSISTENCY.of(b, scale_m));
    Truth { ate: by("ATE"), rpe: by("RPE"), all, consistency }
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
    pub(super) fn add(&mut self, saying: Saying, truth: Option<bool>) {
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

/// Every pair of some drives with what the rule and the truth say.
pub(super) fn tally(
    drives: &[&DriveResult],
    rule: &Rule,
    wanted: impl Fn(&RunResult, &RunResult, &Truth) -> Option<bool>,
) -> Tally {
    let mut tally = Tally::default();
    for drive in drives {
        let confidence = rule.confidence(drive);
        for pair in &drive.pairs {
            let (a, b) = (&drive.runs[pair.a], &drive.runs[pair.b]);
            let saying = rule.say(pair, confidence);
            let truth = truth_of(a, b, saying.scale_m);
            tally.add(saying, wanted(a, b, &truth));
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

/// Share of the pairs whose order all true errors agree on that a score puts in that order; a score that
/// is equal or missing for one of the two puts them in none.
pub(super) fn consistent_pairs(drive: &DriveResult, score: &str) -> f64 {
    let values = column(drive, score);
    let mut tally = Tally::default();
    for pair in &drive.pairs {
        let truth = truth_of(&drive.runs[pair.a], &drive.runs[pair.b], 10.0);
        let leaning = smaller(values[pair.a], values[pair.b]);
        tally.add(Saying { said: Said::Nothing, leaning, scale_m: 10.0 }, truth.all);
    }
    tally.share(tally.sign)
}

/// Whether the truth is the best of a drive's estimates by a score.
pub(super) fn truth_is_first(drive: &DriveResult, score: &str) -> bool {
    let values = column(drive, score);
    values[0].is_some_and(|truth| values[1..].iter().all(|value| value.is_none_or(|value| truth < value)))
}

/// Steps of the ladder truth, then drift by its size, that a score gets right, over all pairs of steps.
pub(super) fn ladder(drive: &DriveResult, score: &str) -> (u32, u32) {
    let on_ladder = |run: &&RunResult| run.kind == "Truth" || run.kind == "Drift";
    let mut steps: Vec<(f64, Option<f64>)> = drive
        .runs
        .iter()
        .filter(on_ladder)
        .map(|run| (run.truth.get("ATE").copied().unwrap_or(0.0), run.scores.get(score).copied().flatten()))
        .collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut counts = (0, 0);
    for (k, a) in steps.iter().enumerate() {
        for b in &steps[k + 1..] {
            counts.0 += u32::from(smaller(a.1, b.1) == Some(true));
            counts.1 += 1;
        }
    }
    counts
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
            inconsistency: BTreeMap::new(),
            scores: BTreeMap::from([("score".to_owned(), score)]),
            shares: BTreeMap::new(),
        };
        let pair = |(a, b)| super::super::result::PairResult {
            a,
            b,
            verdict: Said::Nothing,
            decided_at_m: None,
            is_same: false,
            drift: Said::Nothing,
            predicted: [1.0; 2],
            singles: BTreeMap::new(),
            batches: BTreeMap::new(),
        };
        DriveResult {
            drive: "one".to_owned(),
            held_out: false,
            setting: "default".to_owned(),
            voxel_m: 0.2,
            segment_m: None,
            segments: 1,
            travel_m: 1.0,
            frames: 1,
            returns: 1,
            interval_confidence: 0.99,
            sightings: BTreeMap::new(),
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
            tally.add(Saying { said, leaning: Some(true), scale_m: 10.0 }, Some(true));
        }
        tally.add(Saying { said: Said::A, leaning: Some(true), scale_m: 10.0 }, None);
        let counts = (tally.pairs, tally.right, tally.wrong, tally.mixed, tally.mixed_right, tally.sign);
        assert_eq!(counts, (5, 1, 1, 2, 1, 5));
    }
}
