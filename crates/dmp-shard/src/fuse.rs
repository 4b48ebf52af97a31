//! The fuse stage: sums some scans into voxels, for every run.

use std::path::PathBuf;

use dmp_map::SumsList;
use dmp_reduce::FrameSet;
use dmp_sensor::ReturnCounts;
use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::folder::stem_of;
use super::opened::Shard;
use super::part::Part;
use super::stage::Stage;

/// The result of a part.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FusedPart {
    pub(super) frames: FrameSet,
    pub(super) counts: ReturnCounts,
    /// For every run.
    pub(super) sums: Vec<SumsList>,
}

/// The name of the file with a run's sums.
pub(super) fn sums_name(part: Part, file_stem: &str) -> String {
    format!("{}.{file_stem}.sums", stem_of(Stage::Fuse, part))
}

impl Shard<'_> {
    /// Poses some scans with every run and writes the sums of their voxels. Returns the receipt file that
    /// marks the part as done.
    ///
    /// # Errors
    /// When the log cannot be read or differs from the plan, or nothing can be written.
    pub fn fuse(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let frames = Self::share(&planned, part, &planned.used_scans());
        let folder = self.folder;
        let path = |file_stem: &str| folder.file(&sums_name(part, file_stem));
        let (counts, sums) = planned.fuse(&frames, path)?;
        folder.write(Stage::Fuse, part, &FusedPart { frames, counts, sums })
    }
}
