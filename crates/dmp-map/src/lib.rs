//! The chunked surfel map: fuse points out of core, store tiles on disk, load them under a byte budget.
//!
//! # Brief overview
//! A [`MapFuser`] takes points in world metres from any number of threads. Per voxel of a [`Lattice`] it keeps exact
//! integer sums, and the [`Support`]: which segments of the drive saw the voxel. Sums beyond its memory budget are
//! spilled to a scratch file. [`MapFuser::finish`] computes [`Surfel`]s from the sums and writes them tile by tile into
//! a [`Store`]: one immutable, checksummed file. A [`Tile`] is loaded at a time, usually through a
//! [`BudgetCache`](dmp_disk::BudgetCache).
//!
//! [`Patches`] are rigid pieces of a map that are fused once. A [`PlacedPatches`] is the map of patches at given poses;
//! its tiles are computed on demand.
//!
//! The same points give the same bytes, for any number of threads, budget and order.
//!
//! ```
//! use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Origin, Store};
//!
//! let folder = tempfile::tempdir()?;
//! let fuser = MapFuser::new(Lattice::new(0.2)?, 64 << 20, folder.path())?;
//! let wall: Vec<[f64; 3]> = (0..9000).map(|i| [5.0, f64::from(i % 100) * 0.05, f64::from(i / 100) * 0.05]).collect();
//! fuser.add(&wall, Some(0), &mut FuseBuffers::default())?;
//! let summary = fuser.finish(&folder.path().join("wall.dmpmap"), &Origin::of("a wall"), Durability::Temporary, &|_, _| ())?;
//! let store = Store::open(&summary.path)?;
//! let surfels: usize = store.entries().map(|e| e.own.surfels as usize).sum();
//! assert!(surfels > 400 && store.origin().text == "a wall");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod fuser;
mod grid;
mod left_out;
mod patch;
mod store;
mod sums;
mod surfels;
mod tally;
mod thickness;
mod thinned;
mod triangle_sampler;
mod voxels;
mod write_map;

pub use dmp_disk::TileId;
pub use error::MapError;
pub use fuser::{FuseBuffers, MapFuser, SCRATCH_VOXEL_BYTES};
#[doc(hidden)]
pub use grid::UNITS_PER_M;
pub use grid::{Lattice, TileSpan, TileTable};
pub use left_out::PlacesLeftOut;
pub use patch::{PatchBuilder, PatchWriter, Patches, PlacedPatches, Placement, PointsOfVoxel};
pub use store::{Blob, Durability, Origin, OwnDisc, Store, StoreSummary, TileEntry, VERSION, join_stores};
pub use sums::{SumsBlock, SumsFile, SumsList, merge_sums};
#[doc(hidden)]
pub use surfels::{LooseSurfels, WorldSurfel};
pub use surfels::{Surfel, Tile, TileExtent, TileSource, smallest_eigenvector};
pub use tally::{Crossing, Met, Tally};
pub use thickness::{DoubledPlace, LayerSearch, Layers, SampledCells, ScanSample, Thickness};
pub use thinned::thin_map;
pub use triangle_sampler::TriangleSampler;
pub use voxels::{BRICK_EDGE, Independence, Support, fused_bytes};
