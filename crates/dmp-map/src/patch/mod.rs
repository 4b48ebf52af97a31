//! Rigid pieces of a map, which are fused once and put together anew wherever they come to lie.

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
