//! A disc of the map.

/// A disc of the map, in tile-local metres: x and y from the tile's corner, z from the tile's
/// [`base_z_m`](crate::Tile::base_z_m). All discs of a map have the same radius.
///
/// A fused surfel is rounded once, when it is computed, to its stored form (`docs/store-format.md`). So it is the same
/// surfel wherever it is read from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// Mean of the voxel's points.
    pub centre_in_tile_m: [f32; 3],
    /// Unit normal; its sign has no meaning.
    pub normal: [f32; 3],
    /// See [`crate::Support::third_lowest`].
    pub third_lowest: i32,
    /// See [`crate::Support::third_highest`].
    pub third_highest: i32,
}

impl Surfel {
    /// Half extents of the disc's bounding box, metres.
    pub fn half_extents_m(&self, radius_m: f32) -> [f32; 3] {
        self.normal.map(|n| radius_m * (1.0 - n * n).max(0.0).sqrt())
    }
}
