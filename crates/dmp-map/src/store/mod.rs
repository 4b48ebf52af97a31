//! The store: one immutable file of checksummed tiles.
//!
//! Header, blobs, directory, footer; all numbers little-endian. A blob holds codes of surfels, compressed. The
//! directory at the end says for every tile where its two blobs are and what bounds its surfels.
//! `docs/store-format.md` has every byte.

mod bytes;
mod columns;
mod join;
mod layout;
mod load;
mod read;
mod write;

pub use join::join_stores;
pub use layout::{Blob, Origin, TileEntry, VERSION};
pub use load::OwnDisc;
pub use read::Store;
pub(crate) use write::StoreWriter;
pub use write::{Durability, StoreSummary};
