//! Rigid pieces of a map, fused once and assembled anew at any poses.

mod block;
mod builder;
mod file;
mod gathered;
mod placed;
mod placement;
#[cfg(test)]
mod tests;
mod voxel_sums;

pub use builder::{PatchBuilder, PointsOfVoxel};
pub use file::{PatchWriter, Patches};
pub use placed::PlacedPatches;
pub use placement::Placement;
