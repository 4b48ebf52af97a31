//! Two runs compared, in a report.

use dmp_reduce::Basis;
use serde::{Deserialize, Serialize};

use super::verdict::Verdict;

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
    /// What comes of it: `verdict`, `is_same`, `better_on_the_whole` and `decided_at_m` in the JSON.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The verdict in words.
    pub reason: String,
    /// Where a sample decides nothing: about how many scans would, as far as it shows a difference at all.
    pub frames_needed: Option<u64>,
    /// The same of places, where these were drawn.
    pub places_needed: Option<u64>,
}

impl PairReport {
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
    /// How far apart the root mean squares of the two may be at most, by that interval, metres.
    pub apart_at_most_m: Option<f64>,
    /// How far apart they may be and still count as the same, metres.
    pub margin_m: Option<f64>,
    /// Common returns.
    pub returns: u64,
}
