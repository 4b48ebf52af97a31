//! Records by tile, out of core.

mod budget_cache;
mod scratch_file;
mod tile_buckets;
mod tile_id;

pub use budget_cache::{BudgetCache, NextUse, Weight};
pub use scratch_file::{PartRecords, ScratchFile};
pub use tile_buckets::TileBuckets;
pub use tile_id::TileId;
