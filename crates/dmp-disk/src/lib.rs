//! Working with more data than fits in memory: folders, files and caches that know nothing of maps.
//!
//! # Brief overview
//! A [`WorkFolder`] holds the files of one evaluation and its checkpoints; one process at a time works in it.
//! A [`ScratchFile`] keeps parts of tiles that do not fit in memory, [`TileBuckets`] sorts records into tiles
//! under a byte budget. A [`BudgetCache`] keeps loaded values under a byte budget. [`disk_space`] says how much
//! can still be written to a file system. [`OutputFile`] and [`OutputFolder`] are what the user asked for: they appear
//! whole or not at all; [`ContentMemo`] knows files again by what they hold; [`remove_unfinished`] is for a process that must end at once.
//!
//! Everything read back is compared with a checksum: what changed on disk is an error, never a wrong record.
//!
//! ```
//! use dmp_disk::{DiskError, TileBuckets, TileId};
//!
//! // 64 bytes of memory; the rest goes to disk.
//! let mut buckets: TileBuckets<[f64; 2]> = TileBuckets::new(64, &std::env::temp_dir())?;
//! let tile = TileId { x: 3, y: -1 };
//! for k in 0..100 {
//!     buckets.add(tile, [f64::from(k), 0.5])?;
//! }
//! let mut sum = 0.0;
//! buckets.read(tile, |record| {
//!     sum += record[0];
//!     Ok::<(), DiskError>(())
//! })?;
//! assert!(sum == 4950.0 && buckets.scratch_bytes() > 0);
//! # Ok::<(), DiskError>(())
//! ```

mod beside;
mod checkpoint;
mod disk_space;
mod error;
mod folder_lock;
mod input;
mod left_behind;
mod output_file;
mod output_folder;
mod place;
mod records;
mod unfinished;
mod work_folder;

pub use beside::folder_of;
pub use checkpoint::{read_checked, write_checked};
pub use disk_space::{DiskSpace, disk_space};
pub use error::DiskError;
pub use folder_lock::is_own_folder;
pub use input::{ContentHash, ContentMemo, FileState, NoHash, file_names, open_input};
pub use output_file::OutputFile;
pub use output_folder::OutputFolder;
pub use place::{is_stdout, place_of};
pub use records::{BudgetCache, NextUse, PartRecords, ScratchFile, TileBuckets, TileId, Weight};
pub use unfinished::{Unfinished, remove_unfinished};
pub use work_folder::WorkFolder;
