//! The integer grid of maps, and tables by its tiles.

mod integers;
mod lattice;
mod mix_hasher;
mod tile_span;
mod tile_table;
mod window;

pub(crate) use integers::rounded;
pub(crate) use lattice::{DEPTH_STEPS, InVoxel, VOXEL_OF_CELL_BITS, Voxel, WORLD_LIMIT_M};
pub use lattice::{Lattice, UNITS_PER_M};
pub(crate) use mix_hasher::MixHasher;
pub use tile_span::TileSpan;
pub use tile_table::TileTable;
pub(crate) use window::{Located, TOGETHER, Window, unpacked};
