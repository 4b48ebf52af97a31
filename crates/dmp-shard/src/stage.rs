//! The stages of a score in parts.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A stage whose parts are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Stage {
    /// Sums scans into voxels.
    Fuse,
    /// Computes surfels from the sums, tile by tile.
    Merge,
    /// Casts scans into the maps.
    Cast,
    /// Registers pairs of visits.
    Drift,
}

impl Stage {
    /// All stages, in order.
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
