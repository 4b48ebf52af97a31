//! Sums of voxels as files: parts that were fused on different machines are merged into one map.

mod file;
mod merge;
mod packed;

pub use file::{SumsBlock, SumsFile, SumsList};
pub use merge::merge_sums;
