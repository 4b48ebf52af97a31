//! Discs, and the tiles that hold them.

mod code;
mod loose_surfels;
mod normal;
mod surfel;
mod tile;
mod tile_source;
mod tile_surfels;

pub(crate) use code::{Decoder, NormalCode, SLOPE_STEPS, SurfelCode};
pub use loose_surfels::{LooseSurfels, WorldSurfel};
pub use normal::smallest_eigenvector;
pub use surfel::Surfel;
pub use tile::{Tile, TileExtent};
pub use tile_source::TileSource;
pub(crate) use tile_surfels::{TileSurfels, borders_of, surfels_of, surfels_of_cells};
