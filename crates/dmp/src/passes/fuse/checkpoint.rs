//! What is stored of maps, so that another process can go on with them.

use std::path::PathBuf;

use dmp_reduce::FrameSet;
use dmp_sensor::ReturnCounts;

use crate::means::Checkpoint;
use crate::passes::run_map::MapFacts;

/// Partially fused maps.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Fusing {
    pub(crate) done: FrameSet,
    pub(crate) counts: ReturnCounts,
    /// From [`dmp_map::MapFuser::put_down`], for every run whose map is fused.
    pub(crate) fusers: Vec<Option<Vec<u8>>>,
}

/// Finished maps.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Fused {
    pub(crate) counts: Option<ReturnCounts>,
    pub(crate) scratch_bytes: u64,
    pub(crate) maps: Vec<FusedMap>,
}

/// The finished map of one run; without a path if it was given as a store.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct FusedMap {
    pub(crate) path: Option<PathBuf>,
    pub(crate) facts: MapFacts,
}

impl Checkpoint for Fusing {
    const NAME: &'static str = "fusing";
}

impl Checkpoint for Fused {
    const NAME: &'static str = "fused";
}
