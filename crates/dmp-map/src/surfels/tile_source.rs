//! Maps that rays are cast into, tile by tile.

use dmp_disk::TileId;

use super::tile::{Tile, TileExtent};
use crate::MapError;

/// A surfel map cut into columns of tiles, whose discs all have one radius: a [`Store`](crate::Store) on disk, or
/// [`LooseSurfels`](crate::LooseSurfels) in memory.
pub trait TileSource: Sync {
    /// Edge of the square tiles, metres; tile (x, y) begins at (x, y) edges.
    fn tile_edge_m(&self) -> f64;

    /// Radius of every disc, metres.
    fn disc_radius_m(&self) -> f64;

    /// The smallest and largest column and row of any tile; `None` for an empty map.
    fn tile_bounds(&self) -> Option<[TileId; 2]>;

    /// The bounds of a tile before it is loaded; `None` where the map is empty.
    fn tile_extent(&self, tile: TileId) -> Option<TileExtent>;

    /// Loads a tile, including copies of discs that reach over its borders; `None` where the map is empty.
    ///
    /// # Errors
    /// When its bytes are damaged.
    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError>;
}

impl<T: TileSource> TileSource for &T {
    fn tile_edge_m(&self) -> f64 {
        (**self).tile_edge_m()
    }

    fn disc_radius_m(&self) -> f64 {
        (**self).disc_radius_m()
    }

    fn tile_bounds(&self) -> Option<[TileId; 2]> {
        (**self).tile_bounds()
    }

    fn tile_extent(&self, tile: TileId) -> Option<TileExtent> {
        (**self).tile_extent(tile)
    }

    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        (**self).load_tile(tile)
    }
}
