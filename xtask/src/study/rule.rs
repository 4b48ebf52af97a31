//! Ways to tell the better of two estimates.

use super::evaluate::{common_cv, square_on};
use super::judge::smaller;
use super::result::{PairResult, Said};

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
}

/// Scores asked one after the other, and the guard over places (docs/metric.md).
#[derive(Debug, Clone)]
pub(super) struct Cascade {
    pub(super) name: String,
    /// Scores and the truncations they belong to.
    pub(super) levels: Vec<(String, f64)>,
    pub(super) guard: Vec<Guard>,
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

/// Places of the guard: so many consecutive parts of the frames.
const PLACES: usize = 10;

impl Guard {
    fn speaks_against(&self, pair: &PairResult, a_better: bool) -> bool {
        let Some(batches) = pair.batches.get(&self.score) else { return false };
        let (level_m2, returns) =
            batches.iter().fold((0.0, 0.0), |(l, n), b| (l + 0.5 * b.level_m2, n + b.returns));
        let places = batches.chunks(batches.len() / PLACES).map(|place| {
            let (difference_m2, returns) =
                place.iter().fold((0.0, 0.0), |(d, n), b| (d + b.difference_m2, n + b.returns));
            (returns > 0.0).then(|| difference_m2 / returns)
        });
        // Below zero speaks for the first run.
        let signed: Vec<f64> = places.flatten().map(|d| if a_better { -d } else { d }).collect();
        let mean = |part: fn(f64) -> f64| {
            signed.iter().map(|&d| part(d)).sum::<f64>() / signed.len() as f64 / (level_m2 / returns)
        };
        let (supporting, opposing) = (mean(|d| d.max(0.0)), mean(|d| (-d).max(0.0)));
        opposing > self.opposing && opposing > self.of_supporting * supporting
    }
}

impl Cascade {
    fn say(&self, pair: &PairResult) -> Saying {
        let deciding = self.levels.iter().find_map(|(name, scale_m)| {
            let said = pair.singles.get(name)?.said();
            (said != Said::Nothing).then_some((said == Said::A, *scale_m))
        });
        let Some((a_better, scale_m)) = deciding else {
            let (name, scale_m) = &self.levels[0];
            let leaning = pair.singles.get(name).map(|d| d.value_m2 < 0.0);
            return Saying { said: Said::Nothing, leaning, scale_m: *scale_m };
        };
        let said = match self.guard.iter().any(|guard| guard.speaks_against(pair, a_better)) {
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
        let guards = Some([[0.1, 0.05], [0.02, 0.25]]);
        Self::Cascade(Cascade::new("as documented", Square::Plain, &[10.0, 2.0, 0.5, 0.2], guards))
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::Command => "`dmp score`".to_owned(),
            Self::Single(name, _) => name.clone(),
            Self::Cascade(cascade) => cascade.name.clone(),
        }
    }

    pub(super) fn say(&self, pair: &PairResult) -> Saying {
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
            Self::Cascade(cascade) => cascade.say(pair),
            Self::Single(name, scale_m) => {
                let difference = pair.singles.get(name);
                Saying {
                    said: difference.map_or(Said::Nothing, |d| d.said()),
                    leaning: difference.and_then(|d| smaller(Some(d.value_m2), Some(0.0))),
                    scale_m: *scale_m,
                }
            }
        }
    }
}

/// What of a return is compared.
#[derive(Debug, Clone, Copy)]
pub(super) enum Square {
    /// (z − zc)², truncated.
    Plain,
    /// That times cos² of the incidence.
    SquareOn,
}

impl Cascade {
    /// R_cv at these truncations, one after the other, with a guard at τ = 30 m and one at 2 m: each a share of
    /// the level and one of what supports the verdict.
    pub(super) fn new(name: &str, square: Square, scales_m: &[f64], guards: Option<[[f64; 2]; 2]>) -> Self {
        let score = |scale_m: f64| match square {
            Square::Plain => common_cv(scale_m),
            Square::SquareOn => square_on(scale_m),
        };
        let guard = |(scale_m, [opposing, of_supporting]): (f64, [f64; 2])| Guard {
            score: score(scale_m),
            opposing,
            of_supporting,
        };
        Self {
            name: name.to_owned(),
            levels: scales_m.iter().map(|&scale_m| (score(scale_m), scale_m)).collect(),
            guard: guards
                .map_or_else(Vec::new, |guards| [30.0, 2.0].into_iter().zip(guards).map(guard).collect()),
        }
    }
}
