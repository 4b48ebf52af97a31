//! On how many pairs of visits drift is measured, and how far apart these may be.

use serde::{Deserialize, Serialize};

/// On how many of the pairs of visits drift is measured beside a score.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DriftPairs {
    /// On none: there is no drift in the report.
    None,
    /// On one for each two segments at most, so that no more than half of the log is read for it; on none where a sample is
    /// scored.
    #[default]
    Few,
    /// On so many at most.
    AtMost(usize),
    /// On all that there are.
    All,
}

impl DriftPairs {
    /// So many at most, on a way of so many segments.
    pub(crate) fn most(self, segments: usize, is_sampled: bool) -> usize {
        match self {
            Self::Few if !is_sampled => segments.div_ceil(2),
            Self::None | Self::Few => 0,
            Self::AtMost(pairs) => pairs,
            Self::All => usize::MAX,
        }
    }
}

/// How far a run may be off for its visits to be found and brought onto each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DriftReach {
    /// By some 10 m: visits lie within 15 m of each other, starts up to 6 m to all sides.
    #[default]
    Near,
    /// By some 25 m, as of a run that lost its way: visits within 40 m, starts up to 21 m to all sides. Several times slower, and
    /// in a street that repeats itself more leads to the wrong house.
    Far,
}

impl DriftReach {
    /// How far visits of a pair may lie apart, metres of a drive.
    pub(crate) fn near_m(self) -> f64 {
        match self {
            Self::Near => 15.0,
            Self::Far => 40.0,
        }
    }

    /// Starts to either side of what a run claims, along both axes.
    pub(crate) fn steps(self) -> i32 {
        match self {
            Self::Near => 2,
            Self::Far => 7,
        }
    }
}
