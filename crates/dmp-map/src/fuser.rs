//! From points to a store: sums of voxels, tile by tile, out of core.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use dmp_disk::{DiskError, PartRecords, ScratchFile, TileId};

use crate::MapError;
use crate::code::SurfelCode;
use crate::lattice::Lattice;
use crate::merged::Merged;
use crate::moments::VoxelRecord;
use crate::open_tiles::{OpenTiles, Sums};
use crate::recent_voxels::RecentVoxels;
use crate::store::{Durability, Origin, StoreSummary};
use crate::tile_moments::{PartOfVoxel, TileMoments};
use crate::tile_span::TileSpan;
use crate::tile_surfels::{TileSurfels, surfels_of};
use crate::tile_table::TileTable;
use crate::write_map::{SummedTiles, write_map};

/// Parts of voxels that go into a tile at a time, while they are still in fast memory.
const BATCH: usize = 256;

impl Sums for TileMoments {
    fn bytes(&self) -> usize {
        Self::bytes(self)
    }
}

/// What a voxel takes in the scratch file each time that its tile is put aside.
pub const SCRATCH_VOXEL_BYTES: usize = size_of::<VoxelRecord>();

/// Fuses points into a surfel map, out of core.
///
/// Any number of threads add points through `&self`; every sum is an exact integer, so the map does not
/// depend on their order. When the tiles in memory outgrow the budget, those unused for longest go to a
/// scratch file as partial sums and are merged when the map is finished.
#[derive(Debug)]
pub struct MapFuser {
    lattice: Lattice,
    open: OpenTiles<TileMoments>,
    points: AtomicU64,
    scratch: ScratchFile<VoxelRecord>,
}

/// Per-thread buffers of [`MapFuser::add`].
#[derive(Debug, Default)]
pub struct FuseBuffers {
    recent: RecentVoxels,
    by_tile: TileTable<Vec<PartOfVoxel>>,
}

impl MapFuser {
    /// An empty map whose tiles in memory stay below about `budget_bytes`; partial tiles go to a file
    /// without a name in `scratch_folder`, which vanishes with the process.
    ///
    /// # Errors
    /// When the scratch file cannot be made.
    pub fn new(lattice: Lattice, budget_bytes: usize, scratch_folder: &Path) -> Result<Self, MapError> {
        Ok(Self {
            lattice,
            open: OpenTiles::new(budget_bytes),
            points: AtomicU64::new(0),
            scratch: ScratchFile::new(scratch_folder)?,
        })
    }

    /// As [`MapFuser::new`], with the partial tiles in the file `scratch`: with what [`MapFuser::put_down`] gave,
    /// another process goes on from there.
    ///
    /// # Errors
    /// When the scratch file cannot be made.
    pub fn with_scratch(lattice: Lattice, budget_bytes: usize, scratch: &Path) -> Result<Self, MapError> {
        Ok(Self {
            lattice,
            open: OpenTiles::new(budget_bytes),
            points: AtomicU64::new(0),
            scratch: ScratchFile::named(scratch)?,
        })
    }

    /// The map as far as it was fused when it was put down: `state` is what [`MapFuser::put_down`] gave.
    ///
    /// # Errors
    /// When the scratch file cannot be opened, or is shorter than it was.
    pub fn resume(
        lattice: Lattice,
        budget_bytes: usize,
        scratch: &Path,
        state: &[u8],
    ) -> Result<Self, MapError> {
        let Some((points, list)) = state.split_first_chunk() else {
            let detail = format!("it has {} bytes", state.len());
            return Err(MapError::Damaged { path: scratch.to_path_buf(), part: "list of parts", detail });
        };
        Ok(Self {
            lattice,
            open: OpenTiles::new(budget_bytes),
            points: AtomicU64::new(u64::from_le_bytes(*points)),
            scratch: ScratchFile::resume(scratch, list)?,
        })
    }

    /// Puts all tiles into the scratch file and brings it to disk, and returns what a resumed process needs.
    /// For when nobody is adding points.
    ///
    /// # Errors
    /// When the scratch file cannot be written.
    pub fn put_down(&self) -> Result<Vec<u8>, MapError> {
        for tile in self.open.tiles() {
            if let Some(moments) = self.open.take(tile) {
                self.scratch.append(tile, moments.into_records())?;
            }
        }
        let mut state = self.points().to_le_bytes().to_vec();
        state.extend(self.scratch.list()?);
        Ok(state)
    }

    /// Points added so far.
    pub fn points(&self) -> u64 {
        self.points.load(Ordering::Relaxed)
    }

    /// Bytes of partial tiles put aside so far.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch.bytes()
    }

    /// The grid the map lives on.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Adds points in world metres, seen in `segment` (0 to `i32::MAX - 1`), or in no known segment.
    ///
    /// # Errors
    /// When a point lies outside the world, after which some of the others are in the map and [`Self::points`] knows
    /// of none; or when the scratch file cannot be written.
    pub fn add(
        &self,
        points_in_world_m: &[[f64; 3]],
        segment: Option<i32>,
        buffers: &mut FuseBuffers,
    ) -> Result<(), MapError> {
        let FuseBuffers { recent, by_tile } = buffers;
        for (_, list) in by_tile.all_mut() {
            list.clear();
        }
        recent.add(&self.lattice, points_in_world_m, |voxel, sums| {
            let (tile, voxel) = self.lattice.in_tile(voxel);
            let list = by_tile.entry(tile);
            list.push(PartOfVoxel { voxel, sums });
            if list.len() == BATCH {
                self.open.add(tile, |moments| moments.add(list, segment));
                list.clear();
            }
        })?;
        // Places the sensor has left keep no buffers.
        by_tile.retain(|list| !list.is_empty());
        for (tile, list) in by_tile.all_mut() {
            self.open.add(tile, |moments| moments.add(list, segment));
            list.clear();
        }
        self.points.fetch_add(points_in_world_m.len() as u64, Ordering::Relaxed);
        self.open.keep_budget(|tile, moments| self.scratch.append(tile, moments.into_records()))?;
        Ok(())
    }

    /// Turns the sums into surfels and writes the store at `path`; `origin` is kept in it.
    /// `on_tile` gets, after each batch, how many tiles are done, of how many.
    ///
    /// # Errors
    /// When the scratch file cannot be read back or the store cannot be written; then no store appears
    /// at `path`, and what was there before is untouched.
    pub fn finish(
        self,
        path: &Path,
        origin: &Origin,
        durability: Durability,
        on_tile: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<StoreSummary, MapError> {
        write_map(&self, TileSpan::default(), (path, origin, durability), on_tile)
    }

    /// The voxels of a tile by their cells: its parts are read side by side, so that of the tile itself little is in memory. What
    /// is in memory of it is taken.
    pub(crate) fn voxels_of(&self, tile: TileId) -> impl Iterator<Item = Result<VoxelRecord, DiskError>> {
        let of_disk = self.scratch.parts(tile).into_iter().map(Part::Aside);
        let in_memory = self.open.take(tile).map(|moments| Part::Open(moments.into_records()));
        Merged::new(of_disk.chain(in_memory).collect())
    }
}

impl SummedTiles for MapFuser {
    fn lattice(&self) -> Lattice {
        self.lattice
    }

    fn tiles(&self) -> Vec<TileId> {
        let mut tiles: BTreeSet<TileId> = self.scratch.tiles();
        tiles.extend(self.open.tiles());
        tiles.into_iter().collect()
    }

    fn most_bytes(&self, tile: TileId) -> usize {
        let voxels = self.scratch.records(tile) + self.open.look(tile, TileMoments::most_voxels).unwrap_or(0);
        voxels.saturating_mul(size_of::<SurfelCode>())
    }

    fn room_bytes(&self) -> usize {
        self.open.budget_bytes() / 2
    }

    fn surfels(&self, tile: TileId) -> Result<TileSurfels, MapError> {
        Ok(surfels_of(&self.lattice, self.voxels_of(tile))?)
    }
}

/// A part of a tile: what was put aside of it, or what is in memory.
enum Part<'a, I> {
    Aside(PartRecords<'a, VoxelRecord>),
    Open(I),
}

impl<I: Iterator<Item = VoxelRecord>> Iterator for Part<'_, I> {
    type Item = Result<VoxelRecord, DiskError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self {
            Self::Aside(records) => records.next(),
            Self::Open(records) => records.next().map(Ok),
        }
    }
}
