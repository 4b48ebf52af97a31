//! What is stored of a cast, so that another process can go on with it.

use dmp_reduce::{FrameSet, RunSums, Seen};
use dmp_sensor::ReturnCounts;

use crate::drawn::ScanShape;
use crate::means::Checkpoint;

/// Partial scores of the cast.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct Casting {
    pub(crate) done: FrameSet,
    pub(crate) reducer: Seen,
    pub(crate) counts: ReturnCounts,
    /// Run, column and row of a tile, and its sums.
    pub(crate) tiles: Vec<(u64, i32, i32, RunSums)>,
    /// Scans by their ordinal in the plan, and their shapes.
    pub(crate) shapes: Vec<(u64, ScanShape)>,
    /// Likewise, and the hash of their returns.
    pub(crate) marks: Vec<(u64, u64)>,
}

impl Casting {
    /// The scans that were cast.
    pub fn scans(&self) -> &FrameSet {
        &self.done
    }
}

impl Checkpoint for Casting {
    const NAME: &'static str = "casting";
}
