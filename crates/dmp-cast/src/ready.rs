//! Tiles as rays are cast into them, and where they come from.

use dmp_disk::Weight;
use dmp_map::{MapError, MappedBytes, Tile, TileExtent, TileId, TileSource};

use crate::tile::{BuiltTile, CastTile, Leaf, LeafSupport};

/// A map that rays can be cast into: any [`TileSource`], whose tiles are built when they are loaded, or a
/// [`ReadyMap`](crate::ReadyMap), whose tiles are used where they are mapped.
pub trait CastSource: Sync {
    /// Edge of the square tiles, metres; tile (x, y) begins at (x, y) edges.
    fn edge_m(&self) -> f64;

    /// The smallest and largest column and row of any tile; `None` for an empty map.
    fn bounds(&self) -> Option<[TileId; 2]>;

    /// What is known of a tile before it is loaded; `None` where the map is empty.
    fn extent(&self, tile: TileId) -> Option<TileExtent>;

    /// Makes a tile ready for casting; one without discs where the map is empty.
    ///
    /// # Errors
    /// When its bytes are not those that were written.
    fn load_ready(&self, tile: TileId) -> Result<ReadyTile, MapError>;
}

impl<T: TileSource> CastSource for T {
    fn edge_m(&self) -> f64 {
        self.tile_edge_m()
    }

    fn bounds(&self) -> Option<[TileId; 2]> {
        self.tile_bounds()
    }

    #[inline]
    fn extent(&self, tile: TileId) -> Option<TileExtent> {
        self.tile_extent(tile)
    }

    fn load_ready(&self, tile: TileId) -> Result<ReadyTile, MapError> {
        let radius_m = self.disc_radius_m() as f32;
        let loaded = self.load_tile(tile)?;
        Ok(loaded.map_or_else(ReadyTile::default, |tile| ReadyTile::build(&tile, radius_m)))
    }
}

/// A tile ready for casting.
#[derive(Debug, Default)]
pub struct ReadyTile(Place);

/// Where it lies.
#[derive(Debug)]
enum Place {
    Built(BuiltTile),
    Mapped(MappedTile),
}

impl Default for Place {
    fn default() -> Self {
        Self::Built(BuiltTile::default())
    }
}

/// A tile in a mapped file: the caller has checked that its bytes are whole nodes and leaves.
#[derive(Debug)]
pub(crate) struct MappedTile {
    pub(crate) origin_in_world_m: [f64; 3],
    pub(crate) radius_m: f32,
    pub(crate) nodes: MappedBytes,
    /// Leaves, then what supports each.
    pub(crate) leaves: MappedBytes,
}

impl ReadyTile {
    /// Builds the tree of a tile whose discs have one radius. `O(n log n)`.
    pub fn build(tile: &Tile, radius_m: f32) -> Self {
        Self(Place::Built(BuiltTile::new(tile, radius_m)))
    }

    pub(crate) fn mapped(tile: MappedTile) -> Self {
        Self(Place::Mapped(tile))
    }

    /// The tile as rays are cast into it.
    pub(crate) fn view(&self) -> CastTile<'_> {
        match &self.0 {
            Place::Built(tile) => tile.view(),
            Place::Mapped(tile) => tile.view(),
        }
    }
}

impl MappedTile {
    pub(crate) fn view(&self) -> CastTile<'_> {
        let rows = self.leaves.len() / (size_of::<Leaf>() + size_of::<LeafSupport>());
        let (leaves, support) = self.leaves.split_at(rows * size_of::<Leaf>());
        CastTile {
            origin_in_world_m: self.origin_in_world_m,
            radius_m: self.radius_m,
            nodes: bytemuck::try_cast_slice(&self.nodes).unwrap_or_default(),
            leaves: bytemuck::try_cast_slice(leaves).unwrap_or_default(),
            support: bytemuck::try_cast_slice(support).unwrap_or_default(),
        }
    }
}

impl Weight for ReadyTile {
    fn weight_bytes(&self) -> usize {
        match &self.0 {
            Place::Built(tile) => tile.weight_bytes(),
            // The system takes its pages back when it needs them: they cost no memory of ours.
            Place::Mapped(_) => size_of::<Self>(),
        }
    }
}
