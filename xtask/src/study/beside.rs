//! The verdicts of scores and of drift beside each other.

use super::result::Said;

/// What is made of two verdicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Beside {
    /// Drift alone.
    Drift,
    /// The score's, unless drift says the opposite.
    Uncontradicted,
    /// What both say.
    Both,
    /// Drift's where it decides, else the score's.
    DriftFirst,
    /// The score's where it decides, else drift's.
    ScoreFirst,
}

impl Beside {
    pub(super) const ALL: [Self; 5] =
        [Self::Drift, Self::Uncontradicted, Self::Both, Self::DriftFirst, Self::ScoreFirst];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Drift => "drift",
            Self::Uncontradicted => "score, if drift does not contradict",
            Self::Both => "what both say",
            Self::DriftFirst => "drift, else score",
            Self::ScoreFirst => "score, else drift",
        }
    }

    pub(super) fn of(self, score: Said, drift: Said) -> Said {
        let contradicts = matches!((score, drift), (Said::A, Said::B) | (Said::B, Said::A));
        match self {
            Self::Drift => drift,
            Self::Uncontradicted if contradicts => Said::Nothing,
            Self::Both if score == drift => score,
            Self::Both => Said::Nothing,
            Self::DriftFirst if drift != Said::Nothing => drift,
            Self::ScoreFirst if score == Said::Nothing => drift,
            Self::Uncontradicted | Self::DriftFirst | Self::ScoreFirst => score,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_verdicts_make_one() {
        use Said::{A, B, Mixed, Nothing};
        for (score, drift, expected) in [
            (A, A, [A, A, A, A, A]),
            (A, B, [B, Nothing, Nothing, B, A]),
            (A, Nothing, [Nothing, A, Nothing, A, A]),
            (Nothing, B, [B, Nothing, Nothing, B, B]),
            (Mixed(true), B, [B, Mixed(true), Nothing, B, Mixed(true)]),
        ] {
            assert_eq!(Beside::ALL.map(|beside| beside.of(score, drift)), expected, "{score:?} {drift:?}");
        }
    }
}
