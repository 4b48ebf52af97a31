//! What a run, or a pair of runs, is judged by: `R_cv` or `R_near`.

use std::fmt;

use super::scales::{Scales, WIDEST};

/// By which crossings a run is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum Basis {
    /// The map was fused from the log: only crossings of independent surfels count (`R_cv`), so that no
    /// scan vouches for itself.
    CrossValidated,
    /// The map was given: nothing is known of what made it, and the crossing nearest to the measured
    /// range counts (`R_near`).
    Near,
}

impl Basis {
    /// How two runs are compared: on `R_near` where either map was given.
    #[must_use]
    pub fn of_pair(self, other: Self) -> Self {
        self.max(other)
    }

    /// The scales of its sums, metres, largest first.
    pub fn scales_m(self, scales: Scales) -> &'static [f64] {
        match self {
            Self::CrossValidated => &scales.lengths().cv_m,
            Self::Near => &scales.lengths().near_m,
        }
    }

    /// The scales at which a pair is decided, metres, in the order in which they are asked.
    pub fn cascade_m(self, scales: Scales) -> &'static [f64] {
        match self {
            Self::CrossValidated => &scales.lengths().cv_m[WIDEST..],
            Self::Near => &scales.lengths().near_m,
        }
    }
}

/// What the score is called: `R_cv` or `R_near`.
impl fmt::Display for Basis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::CrossValidated => "R_cv",
            Self::Near => "R_near",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_given_map_makes_the_pair_near() {
        assert_eq!(Basis::CrossValidated.of_pair(Basis::CrossValidated), Basis::CrossValidated);
        assert_eq!(Basis::CrossValidated.of_pair(Basis::Near), Basis::Near);
        assert_eq!(Basis::Near.of_pair(Basis::CrossValidated), Basis::Near);
        assert_eq!(Basis::CrossValidated.cascade_m(Scales::Drive), [10.0, 2.0, 0.5, 0.2]);
    }
}
