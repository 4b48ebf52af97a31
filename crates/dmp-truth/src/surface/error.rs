//! Why a map cannot be measured.

use std::fmt;

use dmp_disk::DiskError;
use dmp_map::MapError;

/// The smallest and largest corner of a box around points, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Smallest coordinates.
    pub low_m: [f64; 3],
    /// Largest coordinates.
    pub high_m: [f64; 3],
}

impl Extent {
    pub(super) const NONE: Self = Self { low_m: [f64::INFINITY; 3], high_m: [f64::NEG_INFINITY; 3] };

    pub(super) fn include(&mut self, point: &[f64; 3]) {
        self.low_m = std::array::from_fn(|k| self.low_m[k].min(point[k]));
        self.high_m = std::array::from_fn(|k| self.high_m[k].max(point[k]));
    }

    /// Whether a point is in the box or within `reach_m` of it along every axis.
    pub(super) fn reaches(&self, point: &[f64; 3], reach_m: f64) -> bool {
        (0..3).all(|k| point[k] >= self.low_m[k] - reach_m && point[k] <= self.high_m[k] + reach_m)
    }
}

impl fmt::Display for Extent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
            let comma = if k > 0 { ", " } else { "" };
            write!(f, "{comma}{name} {:.2} to {:.2} m", self.low_m[k], self.high_m[k])?;
        }
        Ok(())
    }
}

/// Why a map cannot be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A setting outside its range.
    #[error("{setting} {value}: {why}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What it was set to.
        value: String,
        /// What it must be.
        why: &'static str,
    },
    /// There is no point to evaluate.
    #[error("the map has no points that can be used ({dropped} are not finite or beyond the world)")]
    EmptyMap {
        /// Points excluded.
        dropped: u64,
    },
    /// There is nothing to compare with.
    #[error(
        "the reference has neither points nor triangles that can be used ({dropped} are not finite or beyond the world)"
    )]
    EmptyReference {
        /// Points or triangles excluded.
        dropped: u64,
    },
    /// No evaluated point lies near the reference.
    #[error(
        "no point of the map lies within {cap_m} m of the reference: the map spans {map}, the reference {reference}; are both in the same frame?"
    )]
    NoOverlap {
        /// The cap, metres.
        cap_m: f64,
        /// Where the map is.
        map: Extent,
        /// Where the reference is.
        reference: Extent,
    },
    /// Whoever watches asked for it to stop.
    #[error("stopped before the end")]
    Cancelled,
    /// The threads could not be started.
    #[error("cannot start {threads} threads")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// Why.
        source: rayon::ThreadPoolBuildError,
    },
    /// From a store, the scratch files, or a mesh with too much area.
    #[error(transparent)]
    Map(#[from] MapError),
}

impl From<DiskError> for SurfaceError {
    fn from(error: DiskError) -> Self {
        Self::Map(error.into())
    }
}

impl SurfaceError {
    /// Whether the command was used wrongly, rather than the data being at fault.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Setting { .. })
    }
}
