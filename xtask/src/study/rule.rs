//! Ways to tell the better of two estimates.

use dmp::Confidence;

use super::beside::Beside;
use super::interval::of_each;
use super::result::{DriveResult, PairResult, Said, common_cv};

/// Which of two is better by some measure; `None` where they are equal or it is not known.
pub(super) fn smaller(a: Option<f64>, b: Option<f64>) -> Option<bool> {
    match (a?, b?) {
        (a, b) if a < b => Some(true),
        (a, b) if a > b => Some(false),
        _ => None,
    }
}

/// What a rule says of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Saying {
    pub(super) said: Said,
    /// On which side the mean difference lies, decided or not.
    pub(super) leaning: Option<bool>,
    pub(super) scale_m: f64,
}

/// A way to tell the better of two estimates.
#[derive(Debug, Clone)]
pub(super) enum Rule {
    /// The verdict of `dmp score`.
    Command,
    /// One score's mean difference and its interval, and the truncation it belongs to.
    Single(String, f64),
    /// The first of several scores that decides, unless places speak against it.
    Cascade(Cascade),
    /// The verdict of `dmp score` and that of drift.
    Beside(Beside),
}

/// Scores asked one after the other, and the guard over places (docs/metric.md).
#[derive(Debug, Clone)]
pub(super) struct Cascade {
    pub(super) name: String,
    /// Scores and the truncations they belong to.
    pub(super) levels: Vec<(String, f64)>,
    pub(super) guard: Vec<Guard>,
    pub(super) opposing: Opposing,
}

/// Which places may oppose a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Opposing {
    /// All that lean the other way.
    Leaning,
    /// Those whose difference is beyond the interval of the pair, wider as they have fewer returns.
    Decided,
}

/// A verdict is mixed where the places that oppose it weigh more than both.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    /// The score whose places are looked at.
    pub(super) score: String,
    /// In parts of the mean level of both runs.
    pub(super) opposing: f64,
    /// In parts of what supports the verdict.
    pub(super) of_supporting: f64,
}

/// A run that is better predicts more than one in so many of the returns that the other does.
const LEAST_COVERED: f64 = 2.0;
/// The guards of `dmp score`, at 30 m and at 2 m: a share of the level, and one of what supports the verdict.
pub(super) const GUARDS: Option<[[f64; 2]; 2]> = Some([[0.1, 0.05], [0.02, 0.25]]);
/// Places of the guard: so many consecutive parts of the frames.
const PLACES: usize = 10;

impl Guard {
    /// Whether the places speak against the verdict, where an opposing one of all returns is beyond doubt by `doubt_m2`.
    fn speaks_against(&self, pair: &PairResult, a_better: bool, doubt_m2: f64) -> bool {
        let Some(batches) = pair.batches.get(&self.score) else { return false };
        let (level_m2, returns) =
            batches.iter().fold((0.0, 0.0), |(l, n), b| (l + 0.5 * b.level_m2, n + b.returns));
        // Below zero speaks for the first run.
        let places = batches.chunks(batches.len() / PLACES).map(|place| {
            let (difference_m2, of_place) =
                place.iter().fold((0.0, 0.0), |(d, n), b| (d + b.difference_m2, n + b.returns));
            let signed_m2 = if a_better { -difference_m2 } else { difference_m2 } / of_place;
            let is_doubtful = -signed_m2 > 0.0 && -signed_m2 <= doubt_m2 * (returns / of_place).sqrt();
            (of_place > 0.0).then_some(if is_doubtful { 0.0 } else { signed_m2 })
        });
        let signed: Vec<f64> = places.flatten().collect();
        let mean = |part: fn(f64) -> f64| {
            signed.iter().map(|&d| part(d)).sum::<f64>() / signed.len() as f64 / (level_m2 / returns)
        };
        let (supporting, opposing) = (mean(|d| d.max(0.0)), mean(|d| (-d).max(0.0)));
        opposing > self.opposing && opposing > self.of_supporting * supporting
    }
}

impl Cascade {
    fn say(&self, pair: &PairResult, confidence: Confidence) -> Saying {
        let deciding = self.levels.iter().find_map(|(name, scale_m)| {
            let said = pair.singles.get(name)?.said(confidence);
            (said != Said::Nothing).then_some((said == Said::A, *scale_m))
        });
        let Some((a_better, scale_m)) = deciding else {
            let (name, scale_m) = &self.levels[0];
            let leaning = pair.singles.get(name).map(|d| d.value_m2 < 0.0);
            return Saying { said: Said::Nothing, leaning, scale_m: *scale_m };
        };
        let [own, other] = if a_better { pair.predicted } else { [pair.predicted[1], pair.predicted[0]] };
        let doubt_m2 = |guard: &Guard| match self.opposing {
            Opposing::Leaning => 0.0,
            Opposing::Decided => pair.singles.get(&guard.score).map_or(0.0, |d| d.half_m2(confidence)),
        };
        let opposes = |guard: &Guard| guard.speaks_against(pair, a_better, doubt_m2(guard));
        let said = match self.guard.iter().any(opposes) {
            _ if LEAST_COVERED * own < other => Said::Nothing,
            true => Said::Mixed(a_better),
            false if a_better => Said::A,
            false => Said::B,
        };
        Saying { said, leaning: Some(a_better), scale_m }
    }
}

impl Rule {
    /// The rule of docs/metric.md, from the study's own sums.
    pub(super) fn documented() -> Self {
        Self::Cascade(Cascade::new("as documented", &[10.0, 2.0, 0.5, 0.2], GUARDS))
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::Command => "`dmp score`".to_owned(),
            Self::Single(name, _) => name.clone(),
            Self::Cascade(cascade) => cascade.name.clone(),
            Self::Beside(beside) => beside.name().to_owned(),
        }
    }

    /// How sure each interval must be on a drive, so that all its pairs together are as sure as 99 %.
    pub(super) fn confidence(&self, drive: &DriveResult) -> Confidence {
        match self {
            Self::Single(name, _) => {
                let chance = |pair: &PairResult| pair.singles.get(name).map_or(1.0, |d| d.chance());
                of_each(&drive.pairs.iter().map(chance).collect::<Vec<_>>())
            }
            Self::Command | Self::Cascade(_) | Self::Beside(_) => {
                Confidence::new(drive.interval_confidence).unwrap_or(Confidence::P99)
            }
        }
    }

    /// What it says of a pair, with intervals that are as sure as `confidence`.
    pub(super) fn say(&self, pair: &PairResult, confidence: Confidence) -> Saying {
        match self {
            Self::Command => {
                let first = pair.singles.get("R_cv(10) common").map(|d| d.value_m2 < 0.0);
                let leaning = match pair.verdict {
                    Said::A => Some(true),
                    Said::B => Some(false),
                    Said::Mixed(a) => Some(a),
                    Said::Nothing => first,
                };
                Saying { said: pair.verdict, leaning, scale_m: pair.decided_at_m.unwrap_or(10.0) }
            }
            Self::Cascade(cascade) => cascade.say(pair, confidence),
            Self::Beside(beside) => {
                let score = Self::Command.say(pair, confidence);
                Saying { said: beside.of(score.said, pair.drift), ..score }
            }
            Self::Single(name, scale_m) => {
                let difference = pair.singles.get(name);
                Saying {
                    said: difference.map_or(Said::Nothing, |d| d.said(confidence)),
                    leaning: difference.and_then(|d| smaller(Some(d.value_m2), Some(0.0))),
                    scale_m: *scale_m,
                }
            }
        }
    }
}

impl Cascade {
    /// R_cv at these truncations, one after the other, with a guard at τ = 30 m and one at 2 m: each a share of
    /// the level and one of what supports the verdict.
    pub(super) fn new(name: &str, scales_m: &[f64], guards: Option<[[f64; 2]; 2]>) -> Self {
        let guard = |(scale_m, [opposing, of_supporting]): (f64, [f64; 2])| Guard {
            score: common_cv(scale_m),
            opposing,
            of_supporting,
        };
        Self {
            name: name.to_owned(),
            levels: scales_m.iter().map(|&scale_m| (common_cv(scale_m), scale_m)).collect(),
            guard: guards
                .map_or_else(Vec::new, |guards| [30.0, 2.0].into_iter().zip(guards).map(guard).collect()),
            opposing: Opposing::Leaning,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::result::{Batch, Difference};
    use super::*;
    use std::collections::BTreeMap;

    /// A pair that differs by `differences_m2` in 20 equal parts, at a level of 1 m² each, at all scales.
    fn pair(differences_m2: [f64; 20], error_m2: f64) -> PairResult {
        let batches: Vec<Batch> = differences_m2
            .iter()
            .map(|d| Batch { difference_m2: d * 10.0, level_m2: 20.0, returns: 10.0 })
            .collect();
        let value_m2 = differences_m2.iter().sum::<f64>() / 20.0;
        let single = Difference { value_m2, error_m2: Some(error_m2), degrees: 30 };
        let names = || [30.0, 10.0, 2.0, 0.5, 0.2].map(common_cv);
        PairResult {
            a: 0,
            b: 1,
            verdict: Said::Nothing,
            decided_at_m: None,
            is_same: false,
            drift: Said::Nothing,
            predicted: [200.0; 2],
            singles: names().map(|name| (name, single)).into_iter().collect(),
            batches: names().map(|name| (name, batches.clone())).into_iter().collect::<BTreeMap<_, _>>(),
        }
    }

    #[test]
    fn a_pair_is_decided_mixed_or_neither() {
        let say = |pair: &PairResult| Rule::documented().say(pair, Confidence::P99);
        let all_better = say(&pair([-0.4; 20], 0.03));
        assert_eq!((all_better.said, all_better.leaning, all_better.scale_m), (Said::A, Some(true), 10.0));
        assert_eq!(say(&pair([0.4; 20], 0.03)).said, Said::B);
        // Who predicts less than half of what the other does is not the better one.
        let mut holed = pair([-0.4; 20], 0.03);
        holed.predicted = [99.0, 200.0];
        assert_eq!(say(&holed).said, Said::Nothing);
        let unsure = say(&pair([0.4; 20], 0.2));
        assert_eq!((unsure.said, unsure.leaning), (Said::Nothing, Some(false)));
        // Two places of ten oppose by as much as the others support: 0.2 of the level, a quarter of 0.8.
        let mut places = [-1.0; 20];
        places[4..8].fill(1.0);
        assert_eq!(say(&pair(places, 0.03)).said, Said::Mixed(true));
        // They still do where each is beyond doubt, 0.26 here, and do not where that is 1.7.
        let Rule::Cascade(cascade) = Rule::documented() else { panic!() };
        let beyond_doubt = Rule::Cascade(Cascade { opposing: Opposing::Decided, ..cascade });
        let say_surely = |error_m2| beyond_doubt.say(&pair(places, error_m2), Confidence::P99).said;
        assert_eq!((say_surely(0.03), say_surely(0.2)), (Said::Mixed(true), Said::A));
        // One half of a place opposes: its other half outweighs that.
        let mut places = [-1.0; 20];
        places[4] = 0.9;
        assert_eq!(say(&pair(places, 0.03)).said, Said::A);
    }

    #[test]
    fn the_first_scale_that_decides_answers() {
        let mut pair = pair([-0.4; 20], 0.03);
        for scale_m in [10.0, 2.0] {
            let single = Difference { value_m2: 0.4, error_m2: Some(0.2), degrees: 30 };
            pair.singles.insert(common_cv(scale_m), single);
        }
        let said = Rule::documented().say(&pair, Confidence::P99);
        assert_eq!((said.said, said.scale_m), (Said::A, 0.5));
    }
}
