//! What an evaluation took, and the sums that are not part of its JSON.

use serde::{Deserialize, Serialize};

/// How long it took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassTimes {
    /// Planning, the survey included, seconds.
    pub plan_s: f64,
    /// Fusing the maps, seconds.
    pub fuse_s: f64,
    /// Finding trails and writing the maps without them, seconds.
    pub trails_s: f64,
    /// Casting and reducing, seconds.
    pub cast_s: f64,
    /// Measuring drift, seconds.
    #[serde(default)]
    pub drift_s: f64,
    /// All, seconds.
    pub total_s: f64,
    /// By how many threads.
    pub threads: usize,
}

/// What it needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemoryReport {
    /// The budget, bytes.
    pub budget_bytes: usize,
    /// The largest anonymous memory seen, bytes; null where the system does not tell.
    pub peak_anon_bytes: Option<u64>,
    /// Partial tiles written to the scratch file, bytes.
    pub scratch_bytes: u64,
    /// That, and the maps that were fused, bytes.
    pub disk_bytes: u64,
    /// The most that was to lie on disk at once, as it was foreseen before anything was written, bytes.
    pub disk_bytes_estimated: u64,
    /// How often a tile was loaded.
    pub tile_loads: u64,
    /// Tiles of all maps that were ever within the sensor's reach.
    pub tiles_in_reach: u64,
    /// How often they came into it: no tile is loaded more often where the memory holds those in reach at once.
    pub tile_visits: u64,
}

/// The sums of one run's returns that lie in one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct TileReport {
    /// Index of the run.
    pub run: usize,
    /// The tile.
    pub tile: dmp_map::TileId,
    /// The sums.
    pub sums: dmp_reduce::RunSums,
}
