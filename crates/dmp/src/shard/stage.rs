//! The stages of a score in parts.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A stage whose parts are done by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Stage {
    /// Scans become sums of voxels.
    Fuse,
    /// Sums become surfels, tile by tile.
    Merge,
    /// Scans are cast into the maps.
    Cast,
    /// Visits are brought onto each other.
    Drift,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Self; 4] = [Self::Fuse, Self::Merge, Self::Cast, Self::Drift];

    /// Its name, as in the names of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fuse => "fuse",
            Self::Merge => "merge",
            Self::Cast => "cast",
            Self::Drift => "drift",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
