//! Why a run's `R_cv` is not given: a sentence in the JSON.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Why a run's `R_cv` is not given. In the JSON it is a sentence, and two that say the same are equal.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
#[non_exhaustive]
pub enum Withheld {
    /// For a reason that this version gives. What is read back has its numbers rounded as they are told.
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
