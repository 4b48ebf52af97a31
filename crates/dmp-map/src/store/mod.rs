//! The store: one immutable file of checksummed tiles.
//!
//! Header, blobs, directory, footer; all numbers little-endian. There are two forms: the archive holds codes of
//! surfels, compressed; what a cast-ready file holds is up to the caster, which uses it where it is mapped. The
//! directory at the end says for every tile where its two blobs are and what bounds its surfels.
//! `docs/store-format.md` has every byte.

mod archive;
mod columns;
mod layout;
mod read;
mod write;

pub(crate) use archive::StoreWriter;
pub use archive::{OwnDisc, Store, Tile};
pub use layout::{Blob, Form, Origin, TileEntry, VERSION};
pub use read::{MappedBytes, StoredTiles};
pub use write::{Durability, StoreSummary, StoredTilesWriter};
