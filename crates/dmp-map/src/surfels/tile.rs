//! A tile in memory, and its bounds.

use dmp_disk::TileId;

use super::surfel::Surfel;

/// One tile in memory: its own surfels, then the copies of its neighbours' border discs.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// The tile.
    pub id: TileId,
    /// The origin of the surfels' coordinates: the tile's corner and a z among its surfels, world metres.
    pub origin_in_world_m: [f64; 3],
    /// The surfels.
    pub surfels: Vec<Surfel>,
    /// The number of its own surfels, which come first.
    pub own: usize,
}

impl Tile {
    /// Origin of the tile's z, world metres.
    pub fn base_z_m(&self) -> f64 {
        self.origin_in_world_m[2]
    }
}

/// Bounds of a tile's content.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileExtent {
    /// Lowest and highest world z that any disc reaches, metres.
    pub z_range_m: [f64; 2],
    /// Smallest third-lowest segment of its surfels: no surfel of the tile is independent of an earlier segment.
    pub min_third_lowest: i32,
    /// Largest third-highest segment of its surfels.
    pub max_third_highest: i32,
}

impl TileExtent {
    pub(crate) const EMPTY: Self = Self {
        z_range_m: [f64::INFINITY, f64::NEG_INFINITY],
        min_third_lowest: i32::MAX,
        max_third_highest: i32::MIN,
    };

    /// Extends it by a disc whose z has the origin `base_z_m`.
    pub(crate) fn add(&mut self, surfel: &Surfel, base_z_m: f64, radius_m: f32) {
        let half = f64::from(surfel.half_extents_m(radius_m)[2]) + 1e-3;
        let z = base_z_m + f64::from(surfel.centre_in_tile_m[2]);
        self.z_range_m = [self.z_range_m[0].min(z - half), self.z_range_m[1].max(z + half)];
        self.min_third_lowest = self.min_third_lowest.min(surfel.third_lowest);
        self.max_third_highest = self.max_third_highest.max(surfel.third_highest);
    }
}
