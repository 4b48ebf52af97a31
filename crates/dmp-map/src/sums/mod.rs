//! Sums of voxels as files: what is fused of some scans in one place goes to another, and with that of the other scans becomes
//! a map.

mod file;
mod merge;
mod packed;

pub use file::{SumsBlock, SumsFile, SumsList};
pub use merge::merge_sums;
