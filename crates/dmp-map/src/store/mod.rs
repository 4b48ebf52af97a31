//! The store: one immutable file of compressed, checksummed tiles.
//!
//! Header, tile blobs, directory, footer; all numbers little-endian. A blob is zstd over columns of
//! 32-bit numbers, eight a surfel. The directory at the end says for every tile where its own surfels
//! and the copies of its neighbours' border discs are, and what bounds them.

mod layout;
mod read;
mod write;

pub use layout::{TileEntry, VERSION};
pub use read::{Store, Tile};
pub(crate) use write::StoreWriter;
pub use write::{Durability, StoreSummary};
