//! A range of the tiles of a map.

use dmp_disk::TileId;

/// Consecutive tiles in row order, from one up to another. `None` is the end of the world.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TileSpan {
    /// The first tile.
    pub from: Option<TileId>,
    /// The first tile after it.
    pub to: Option<TileId>,
}

impl TileSpan {
    /// Whether a tile is in it.
    pub fn contains(&self, tile: TileId) -> bool {
        self.from.is_none_or(|from| from <= tile) && self.to.is_none_or(|to| tile < to)
    }

    /// Whether a tile or a neighbour of it is in it.
    pub fn touches(&self, TileId { y, x }: TileId) -> bool {
        let beside = |c: i32| c.saturating_sub(1)..=c.saturating_add(1);
        beside(y).any(|y| beside(x).any(|x| self.contains(TileId { y, x })))
    }
}
