//! Rules that decide which of two estimates is better.

use dmp::Confidence;

use super::interval::{BATCHES_OF_PLACE, of_each, total};
use super::observe::pair_scores;
use super::result::{Both, Difference, DriveResult, PairResult, Said, common_cv};

/// Whether the first is smaller; `None` where they are equal or one is missing.
pub(super) fn smaller(a: Option<f64>, b: Option<f64>) -> Option<bool> {
    match (a?, b?) {
        (a, b) if a < b => Some(true),
        (a, b) if a > b => Some(false),
        _ => None,
    }
}

/// The answer of a rule on a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Saying {
    pub(super) said: Said,
    /// Whether the mean difference is in favour of the first, decided or not.
    pub(super) leaning: Option<bool>,
}

/// A rule.
#[derive(Debug, Clone)]
pub(super) enum Rule {
    /// The verdict of `dmp score`.
    Command,
    /// The same without what drift decides.
    Scores,
    /// The comparison of drift that `dmp score` prints.
    Drift,
    /// One score's mean difference and its interval.
    Single(String),
}

impl Rule {
    pub(super) fn all() -> Vec<Self> {
        // The largest truncation is that of the guard alone.
        let singles = pair_scores().skip(1).map(|(name, _)| Self::Single(name));
        [Self::Command, Self::Scores, Self::Drift].into_iter().chain(singles).collect()
    }

    pub(super) fn name(&self) -> &str {
        match self {
            Self::Command => "`dmp score`",
            Self::Scores => "`dmp score`, scores alone",
            Self::Drift => "drift",
            Self::Single(name) => name,
        }
    }

    /// Its answers on all pairs of a drive, with intervals that together are as sure as 99 %.
    pub(super) fn say_all(&self, drive: &DriveResult) -> Vec<Saying> {
        let of = |pair: &PairResult, name: &str| pair.singles.get(name).copied();
        let leaning = |pair: &PairResult, name: &str| of(pair, name).map(|d| d.value_m2 < 0.0);
        let decided = |said: Said, leaning: Option<bool>| match said {
            Said::A => Some(true),
            Said::B => Some(false),
            Said::Mixed(a) => Some(a),
            Said::Nothing => leaning,
        };
        let say: &dyn Fn(&PairResult) -> Saying = match self {
            Self::Command | Self::Scores => &|pair| {
                let is_left = matches!(self, Self::Scores) && pair.decided_at_m.is_none();
                let said = if is_left { Said::Nothing } else { pair.verdict };
                Saying { said, leaning: decided(said, leaning(pair, &common_cv(10.0))) }
            },
            Self::Drift => &|pair| Saying { said: pair.drift, leaning: decided(pair.drift, None) },
            Self::Single(name) => {
                let chance = |pair: &PairResult| of(pair, name).map_or(1.0, Difference::chance);
                let confidence = of_each(&drive.pairs.iter().map(chance).collect::<Vec<_>>());
                &move |pair| {
                    let said = of(pair, name).map_or(Said::Nothing, |d| d.said(confidence));
                    Saying { said, leaning: leaning(pair, name) }
                }
            }
        };
        drive.pairs.iter().map(say).collect()
    }
}

/// Truncations that are asked one after the other, metres.
const CASCADE_M: [f64; 4] = [10.0, 2.0, 0.5, 0.2];
/// The better run predicts more than one in so many of the returns that the other does.
const LEAST_COVERED: f64 = 2.0;
/// Where the other run finds this share of its returns on what another visit saw, the better one finds at least one in so many of
/// those, or of the share with which it comes back.
const REVISIT_NEEDED: f64 = 0.05;
const MOST_LOST: f64 = 2.0;
/// The guard over places: a truncation in metres, a share of the mean level, and one of what supports the verdict.
const GUARDS: [(f64, [f64; 2]); 2] = [(30.0, [0.1, 0.05]), (2.0, [0.02, 0.25])];

/// The verdict of docs/metric.md, from the study's own sums.
pub(super) fn documented(pair: &PairResult, confidence: Confidence) -> Said {
    let deciding = CASCADE_M.iter().find_map(|&scale_m| {
        let said = pair.singles.get(&common_cv(scale_m))?.said(confidence);
        (said != Said::Nothing).then_some(said == Said::A)
    });
    let Some(a_better) = deciding else { return Said::Nothing };
    let [own, other] = if a_better { pair.predicted } else { [pair.predicted[1], pair.predicted[0]] };
    if LEAST_COVERED * own < other {
        return Said::Nothing;
    }
    let (worse, better) = if a_better { (1, 0) } else { (0, 1) };
    let is_lost = |of: f64| MOST_LOST * pair.revisited[better] < of;
    if pair.revisited[worse] >= REVISIT_NEEDED && is_lost(pair.revisited[worse]) && is_lost(pair.back[better])
    {
        return Said::Nothing;
    }
    let opposed = |&(scale_m, shares): &(f64, [f64; 2])| {
        pair.batches.get(&common_cv(scale_m)).is_some_and(|batches| is_opposed(batches, a_better, shares))
    };
    match GUARDS.iter().any(opposed) {
        true => Said::Mixed(a_better),
        false if a_better => Said::A,
        false => Said::B,
    }
}

/// Whether places speak against the verdict.
fn is_opposed(batches: &[Both], a_better: bool, [of_level, of_supporting]: [f64; 2]) -> bool {
    // Below zero speaks for the verdict.
    let signed = batches.chunks(BATCHES_OF_PLACE).map(total).filter(|place| place.returns > 0.0);
    let signed: Vec<f64> = signed
        .map(|place| if a_better { -place.difference_m2 } else { place.difference_m2 } / place.returns)
        .collect();
    let all = total(batches);
    let mean = |part: fn(f64) -> f64| {
        let level_m2 = 0.5 * all.level_m2 / all.returns;
        signed.iter().map(|&d| part(d)).sum::<f64>() / signed.len() as f64 / level_m2
    };
    let (supporting, opposing) = (mean(|d| d.max(0.0)), mean(|d| (-d).max(0.0)));
    opposing > of_level && opposing > of_supporting * supporting
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pair that differs by `differences_m2` in 20 equal parts, at a level of 1 m² each, at all scales.
    fn pair(differences_m2: [f64; 20], error_m2: f64) -> PairResult {
        let batch = |d: &f64| Both { difference_m2: d * 10.0, level_m2: 20.0, returns: 10.0 };
        let batches: Vec<Both> = differences_m2.iter().map(batch).collect();
        let value_m2 = differences_m2.iter().sum::<f64>() / 20.0;
        let single = Difference { value_m2, error_m2: Some(error_m2), degrees: 30 };
        let names = || pair_scores().map(|(name, _)| name);
        PairResult {
            a: 0,
            b: 1,
            verdict: Said::Nothing,
            decided_at_m: None,
            drift: Said::Nothing,
            predicted: [200.0; 2],
            revisited: [0.3; 2],
            back: [0.4; 2],
            singles: names().map(|name| (name, single)).collect(),
            batches: names().map(|name| (name, batches.clone())).collect(),
        }
    }

    #[test]
    fn a_pair_is_decided_mixed_or_neither() {
        let at = |places: std::ops::Range<usize>, value: f64| {
            let mut differences = [-1.0; 20];
            differences[places].fill(value);
            differences
        };
        let unsure_at_first = {
            let mut pair = pair([-0.4; 20], 0.03);
            for scale_m in [10.0, 2.0] {
                let single = Difference { value_m2: 0.4, error_m2: Some(0.2), degrees: 30 };
                pair.singles.insert(common_cv(scale_m), single);
            }
            pair
        };
        let holed = PairResult { predicted: [99.0, 200.0], ..pair([-0.4; 20], 0.03) };
        let astray = |revisited, back| PairResult { revisited, back, ..pair([-0.4; 20], 0.03) };
        for (case, pair, expected) in [
            ("better everywhere", pair([-0.4; 20], 0.03), Said::A),
            ("worse everywhere", pair([0.4; 20], 0.03), Said::B),
            ("not beyond the interval", pair([0.4; 20], 0.2), Said::Nothing),
            ("predicts less than half of what the other does", holed, Said::Nothing),
            ("comes back and finds little, the other finds it", astray([0.1, 0.3], [0.4; 2]), Said::Nothing),
            ("does not come back, by its own path", astray([0.1, 0.3], [0.0, 0.4]), Said::A),
            ("comes back and finds as little as the other", astray([0.1, 0.19], [0.4; 2]), Said::A),
            (
                "two places of ten oppose, a quarter of the others",
                pair(at(4..8, 1.0), 0.03),
                Said::Mixed(true),
            ),
            ("half a place opposes, outweighed by its other half", pair(at(4..5, 0.9), 0.03), Said::A),
            ("the first scale that decides answers", unsure_at_first, Said::A),
        ] {
            assert_eq!(documented(&pair, Confidence::P99), expected, "{case}");
        }
    }
}
