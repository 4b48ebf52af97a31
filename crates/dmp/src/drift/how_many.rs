//! On how many pairs of visits drift is measured.

use serde::Serialize;

/// On how many of the pairs of visits drift is measured beside a score.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
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
