//! Why a run's `R_cv` is not given: a sentence in the JSON.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Why a run's `R_cv` is not given. In the JSON it is a sentence, and two that say the same are equal.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
#[non_exhaustive]
pub enum Withheld {
    /// For a reason that this version gives. What is read back has its numbers rounded as they are printed.
    Known(dmp_reduce::Withheld),
    /// For a reason that is read back and of another version.
    Other(String),
}

impl Withheld {
    /// Whether too few returns have an independent crossing.
    pub fn is_low_coverage(&self) -> bool {
        matches!(self, Self::Known(dmp_reduce::Withheld::LowCoverage { .. }))
    }
}

impl fmt::Display for Withheld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Known(why) => why.fmt(f),
            Self::Other(why) => f.write_str(why),
        }
    }
}

impl PartialEq for Withheld {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl From<Withheld> for String {
    fn from(withheld: Withheld) -> Self {
        withheld.to_string()
    }
}

impl From<String> for Withheld {
    fn from(sentence: String) -> Self {
        sentence.parse().map_or(Self::Other(sentence), Self::Known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn why_a_score_is_withheld_comes_back() {
        for (why, sentence) in [
            (dmp_reduce::Withheld::NoReturns, "no returns"),
            (
                dmp_reduce::Withheld::MapGiven,
                "the map was given, so no crossing is known to be independent of the return",
            ),
            (dmp_reduce::Withheld::LowCoverage { coverage: 0.4312 }, "coverage is 0.431, below 0.5"),
        ] {
            let json = serde_json::to_string(&Withheld::Known(why)).unwrap();
            assert_eq!(json, format!("\"{sentence}\""));
            let back: Withheld = serde_json::from_str(&json).unwrap();
            assert!(matches!(back, Withheld::Known(_)) && back == Withheld::Known(why), "{back:?}");
        }
        for sentence in ["coverage is low", "coverage is 0.4312, below 0.5", "the moon"] {
            let back: Withheld = serde_json::from_str(&format!("\"{sentence}\"")).unwrap();
            assert!(matches!(&back, Withheld::Other(other) if other == sentence), "{back:?}");
        }
    }
}
