//! Two runs compared, in a report.

use dmp_reduce::{Basis, Comparison, Estimate, ScaleComparison, Scales};
use dmp_revisit::apart::Apart;
use serde::{Deserialize, Serialize};

use crate::verdict::Verdict;

/// Two runs compared on their common returns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairReport {
    /// One run.
    pub a: String,
    /// The other.
    pub b: String,
    /// By what the two are judged, `score` in the JSON: `R_cv`, or `R_near` where a map was given.
    #[serde(rename = "score", with = "ScoreOfBasis")]
    pub basis: Basis,
    /// Every scale, the largest first, also those after the one that decided.
    pub scales: Vec<ScaleReport>,
    /// The paper's LLR, log p(Z|a) − log p(Z|b): a raw sum, not a probability.
    pub llr_raw: f64,
    /// How far apart the two put the same points, by their poses; null where both have poses for fewer than two scans.
    pub apart: Option<Apart>,
    /// What comes of it: `verdict`, `better_on_the_whole`, `decided_at_m` and `decided_by_drift` in the JSON.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The verdict in words.
    pub reason: String,
}

/// What the report of a pair needs beside its comparison. Runs go by their numbers.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "it holds functions")]
pub struct PairFacts<'a> {
    /// The name of a run, by its number.
    pub name: &'a dyn Fn(usize) -> String,
    /// log p(Z|run).
    pub log_likelihood: &'a dyn Fn(usize) -> f64,
    /// The number in the log of a scan that the reducer knows by its place.
    pub scan_of_unit: &'a dyn Fn(u64) -> u64,
    /// The truncation lengths.
    pub scales: Scales,
}

impl PairReport {
    /// The report of a comparison.
    pub fn of(pair: &Comparison, facts: PairFacts<'_>, apart: Option<Apart>) -> Self {
        let PairFacts { name, log_likelihood, scan_of_unit, scales } = facts;
        let scale = |scale: &ScaleComparison| ScaleReport {
            scale_m: scale.scale_m,
            mean_a_m2: scale.mean_a_m2,
            mean_b_m2: scale.mean_b_m2,
            difference_m2: scale.difference.map(|difference| difference.value_m2),
            interval_m2: scale.difference.and_then(interval_of),
            returns: pair.common_returns,
        };
        let verdict = match pair.verdict {
            dmp_reduce::Verdict::Better { which, decided_at_m, .. } => {
                Verdict::Better { run: name(which), decided_at_m: Some(decided_at_m) }
            }
            dmp_reduce::Verdict::Mixed { which, decided_at_m, .. } => {
                Verdict::Mixed { run: name(which), decided_at_m }
            }
            dmp_reduce::Verdict::Same => Verdict::Same,
            dmp_reduce::Verdict::Undecided { .. } => Verdict::Undecided,
        };
        Self {
            a: name(pair.a),
            b: name(pair.b),
            basis: pair.basis,
            scales: pair.scales.iter().map(scale).collect(),
            llr_raw: log_likelihood(pair.a) - log_likelihood(pair.b),
            verdict,
            reason: match (&pair.verdict, &apart) {
                (dmp_reduce::Verdict::Same, Some(apart)) => format!("the same: {apart}"),
                (dmp_reduce::Verdict::Undecided { reason }, Some(apart)) => {
                    format!("undecided: {apart}, and {reason}")
                }
                (verdict, _) => verdict.reason_with(scales, scan_of_unit),
            },
            apart,
        }
    }

    /// Whether it is the pair of these two, whichever stands first.
    pub fn is_of(&self, one: &str, other: &str) -> bool {
        (self.a == one && self.b == other) || (self.a == other && self.b == one)
    }

    /// The one of the two that is not called `name`.
    pub fn other(&self, name: &str) -> &str {
        if self.a == name { &self.b } else { &self.a }
    }

    /// The scale that decided; `None` where none did.
    pub fn decided_at(&self) -> Option<&ScaleReport> {
        let decided_at_m = self.verdict.decided_at_m()?;
        self.scales.iter().find(|scale| scale.scale_m == decided_at_m)
    }
}

/// What the JSON calls the two.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Basis")]
enum ScoreOfBasis {
    #[serde(rename = "R_cv")]
    CrossValidated,
    #[serde(rename = "R_near")]
    Near,
}

/// The ends of an interval, m².
pub(crate) fn interval_of(estimate: Estimate) -> Option<[f64; 2]> {
    estimate.interval.map(|interval| [interval.low_m2, interval.high_m2])
}

/// Two runs at one scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScaleReport {
    /// The truncation τ, metres.
    pub scale_m: f64,
    /// The mean of a over the common returns, m².
    pub mean_a_m2: Option<f64>,
    /// The mean of b over the common returns, m².
    pub mean_b_m2: Option<f64>,
    /// Mean of a minus b over the common returns, m²: negative where a is better.
    pub difference_m2: Option<f64>,
    /// Its interval, as sure as [`PromiseReport::interval_confidence`](super::PromiseReport::interval_confidence).
    pub interval_m2: Option<[f64; 2]>,
    /// Common returns.
    pub returns: u64,
}
