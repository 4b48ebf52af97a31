//! A score in parts: on any number of machines, by any scheduler, with the same bits.
//!
//! A [`ShardPlan`] has everything that is common to all parts. Each part of a stage is a function from files
//! to files in the plan's folder:
//!
//! ```text
//! plan ──> fuse i/n ──> merge j/m ──> cast k/c ──> reduce
//!    └──────────────────────────────> drift l/d ──┘
//! ```
//!
//! `fuse` poses some scans with every run and writes sums of voxels. `merge` adds up those of some tiles and
//! computes surfels. `cast` casts some scans into all maps. `drift` registers the visits of some pairs.
//! `reduce` adds everything up. Repeating a part writes the same bytes. Every part checks its input: it is of
//! this plan and whole, and no scan is missing or duplicated.

mod cast;
mod document;
mod drift;
mod error;
mod folder;
mod fuse;
mod merge;
mod needs;
mod opened;
mod part;
mod reduce;
mod stage;
mod suggest;

pub use document::{PlannedRun, ShardPlan};
pub use error::ShardError;
pub use needs::{NeededFile, Needs};
pub use opened::Shard;
pub use part::Part;
pub use stage::Stage as ShardStage;
pub use suggest::{Machine, Suggested};
