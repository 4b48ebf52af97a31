//! The number of visit pairs for drift, and the largest distance between visits.

use serde::{Deserialize, Serialize};

/// The number of visit pairs on which drift is measured beside a score.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DriftPairs {
    /// None: the report has no drift.
    None,
    /// At most one pair per two segments, so that at most half of the log is read.
    #[default]
    Few,
    /// At most this many.
    AtMost(usize),
    /// All pairs.
    All,
}

impl DriftPairs {
    /// The limit for a path of this many segments.
    pub fn most(self, segments: usize) -> usize {
        match self {
            Self::Few => segments.div_ceil(2),
            Self::None => 0,
            Self::AtMost(pairs) => pairs,
            Self::All => usize::MAX,
        }
    }
}

/// The largest drift for which visits are found and registered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DriftReach {
    /// Some 10 m: visits lie within 15 m of each other; registration starts up to 6 m to all sides.
    #[default]
    Near,
    /// Some 25 m, for a run that lost track: visits within 40 m, starts up to 21 m to all sides. It is
    /// several times slower, and in a repetitive street more pairs register to the wrong house.
    Far,
}

impl DriftReach {
    /// Largest distance between the visits of a pair, metres of a drive.
    pub fn near_m(self) -> f64 {
        match self {
            Self::Near => 15.0,
            Self::Far => 40.0,
        }
    }

    /// Starts to either side of the run's claim, along both axes.
    pub fn steps(self) -> i32 {
        match self {
            Self::Near => 2,
            Self::Far => 7,
        }
    }
}
