//! The number of a square tile of the horizontal plane: what records are sorted by.

/// A column of the world: tiles are square in x and y and reach from the lowest to the highest point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileId {
    /// Row: the tile covers world y from `y` to `y + 1` tile edges. First, so that ids sort by rows.
    pub y: i32,
    /// Column: the tile covers world x from `x` to `x + 1` tile edges.
    pub x: i32,
}

impl std::fmt::Display for TileId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", self.x, self.y)
    }
}
