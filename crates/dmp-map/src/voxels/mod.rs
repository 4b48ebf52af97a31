//! Sums over the points of a voxel, and who saw it.

mod merged;
mod moments;
mod narrow_moments;
mod open_tiles;
mod recent_voxels;
mod support;
mod tile_moments;

pub(crate) use merged::Merged;
pub(crate) use moments::{Moments, VoxelRecord};
pub(crate) use narrow_moments::{NarrowMoments, PackedSums};
pub(crate) use open_tiles::{OpenTiles, Sums};
pub(crate) use recent_voxels::RecentVoxels;
pub use support::{Independence, Support};
pub use tile_moments::{BRICK_EDGE, fused_bytes};
pub(crate) use tile_moments::{PartOfVoxel, TileMoments};
