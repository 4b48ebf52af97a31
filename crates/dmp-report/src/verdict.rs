//! What is decided between two runs, with the three fields that say it in the JSON.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What is decided between the two runs of a pair: by their scores, and where these are undecided, by their
/// [drift](dmp_revisit::drift::DriftComparison).
///
/// In the JSON it is four fields, which tell a run from a word whatever the run is called: a verdict with a
/// `decided_at_m` is [`Self::Mixed`] where there is a `better_on_the_whole`, else the name of the better run; without
/// it is the word `same` or `undecided`, or the name of the run that drifts less where it is `decided_by_drift`.
///
/// ```
/// use dmp_report::Verdict;
///
/// let verdict = Verdict::Better { run: "mixed".into(), decided_at_m: Some(2.0) };
/// let json = r#"{"verdict":"mixed","better_on_the_whole":null,"decided_at_m":2.0,"decided_by_drift":false}"#;
/// assert_eq!(serde_json::to_string(&verdict)?, json);
/// assert_eq!(serde_json::from_str::<Verdict>(json)?, verdict);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Fields", into = "Fields")]
pub enum Verdict {
    /// One run is better.
    Better {
        /// Its name.
        run: String,
        /// The scale that decided, metres; `None` where drift did.
        decided_at_m: Option<f64>,
    },
    /// One run is better on the whole, the other at some places.
    Mixed {
        /// The name of the run that is better on the whole.
        run: String,
        /// The scale at which it is, metres.
        decided_at_m: f64,
    },
    /// The two are nowhere apart by what matters: their poses say so.
    Same,
    /// Nothing can be said.
    Undecided,
}

impl Verdict {
    /// The run that is better, everywhere; `None` where neither is.
    pub fn better(&self) -> Option<&str> {
        match self {
            Self::Better { run, .. } => Some(run),
            _ => None,
        }
    }

    /// The run that is better, be it only on the whole; `None` where nothing is decided.
    pub fn ahead(&self) -> Option<&str> {
        match self {
            Self::Better { run, .. } | Self::Mixed { run, .. } => Some(run),
            Self::Same | Self::Undecided => None,
        }
    }

    /// The scale that decided, metres; `None` where none did.
    pub fn decided_at_m(&self) -> Option<f64> {
        match self {
            Self::Better { decided_at_m, .. } => *decided_at_m,
            Self::Mixed { decided_at_m, .. } => Some(*decided_at_m),
            Self::Same | Self::Undecided => None,
        }
    }

    /// Whether drift decides.
    pub fn is_by_drift(&self) -> bool {
        matches!(self, Self::Better { decided_at_m: None, .. })
    }

    /// The run that it names, to be called otherwise.
    pub fn run_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Better { run, .. } | Self::Mixed { run, .. } => Some(run),
            Self::Same | Self::Undecided => None,
        }
    }
}

/// The name of the better run, `mixed`, `same` or `undecided`, as the JSON has it.
impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Better { run, .. } => run,
            Self::Mixed { .. } => "mixed",
            Self::Same => "same",
            Self::Undecided => "undecided",
        })
    }
}

/// A verdict in the JSON.
#[derive(Serialize, Deserialize)]
struct Fields {
    verdict: String,
    better_on_the_whole: Option<String>,
    decided_at_m: Option<f64>,
    /// Absent before drift decided anything.
    #[serde(default)]
    decided_by_drift: bool,
}

impl From<Verdict> for Fields {
    fn from(verdict: Verdict) -> Self {
        Self {
            verdict: verdict.to_string(),
            decided_at_m: verdict.decided_at_m(),
            decided_by_drift: verdict.is_by_drift(),
            better_on_the_whole: match verdict {
                Verdict::Mixed { run, .. } => Some(run),
                _ => None,
            },
        }
    }
}

impl TryFrom<Fields> for Verdict {
    type Error = String;

    fn try_from(fields: Fields) -> Result<Self, String> {
        let Fields { verdict, better_on_the_whole, decided_at_m, decided_by_drift } = fields;
        match (verdict.as_str(), better_on_the_whole, decided_at_m, decided_by_drift) {
            ("mixed", Some(run), Some(decided_at_m), false) => Ok(Self::Mixed { run, decided_at_m }),
            (_, None, Some(_), false) | (_, None, None, true) => {
                Ok(Self::Better { run: verdict, decided_at_m })
            }
            ("same", None, None, false) => Ok(Self::Same),
            ("undecided", None, None, false) => Ok(Self::Undecided),
            _ => Err(format!("the verdict `{verdict}` contradicts the fields beside it")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verdict_comes_back_whatever_its_run_is_called() {
        for (verdict, json) in [
            (
                Verdict::Same,
                r#"{"verdict":"same","better_on_the_whole":null,"decided_at_m":null,"decided_by_drift":false}"#,
            ),
            (
                Verdict::Undecided,
                r#"{"verdict":"undecided","better_on_the_whole":null,"decided_at_m":null,"decided_by_drift":false}"#,
            ),
            (
                Verdict::Better { run: "undecided".into(), decided_at_m: Some(0.5) },
                r#"{"verdict":"undecided","better_on_the_whole":null,"decided_at_m":0.5,"decided_by_drift":false}"#,
            ),
            (
                Verdict::Better { run: "same".into(), decided_at_m: None },
                r#"{"verdict":"same","better_on_the_whole":null,"decided_at_m":null,"decided_by_drift":true}"#,
            ),
            (
                Verdict::Mixed { run: "same".into(), decided_at_m: 10.0 },
                r#"{"verdict":"mixed","better_on_the_whole":"same","decided_at_m":10.0,"decided_by_drift":false}"#,
            ),
        ] {
            assert_eq!(serde_json::to_string(&verdict).unwrap(), json);
            assert_eq!(serde_json::from_str::<Verdict>(json).unwrap(), verdict);
        }
    }

    #[test]
    fn fields_that_contradict_each_other_are_refused() {
        for (verdict, on_the_whole, decided_at_m) in
            [("truth", "null", "null"), ("truth", r#""drift""#, "2.0"), ("mixed", r#""drift""#, "null")]
        {
            let json = format!(
                r#"{{"verdict":"{verdict}","better_on_the_whole":{on_the_whole},"decided_at_m":{decided_at_m}}}"#
            );
            let error = serde_json::from_str::<Verdict>(&json).unwrap_err().to_string();
            assert!(error.contains(&format!("the verdict `{verdict}` contradicts")), "{error}");
        }
    }
}
