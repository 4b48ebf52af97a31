//! The store: one immutable file of checksummed tiles.
//!
//! Header, blobs, directory, footer; all numbers little-endian. A blob has compressed codes of surfels. The directory
//! at the end has for every tile the positions of its two blobs and the bounds of its surfels. `docs/store-format.md`
//! has every byte.

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
