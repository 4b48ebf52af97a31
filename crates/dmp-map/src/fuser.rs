//! Fuses points into voxel sums, tile by tile and out of core, and writes the store.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use dmp_disk::{DiskError, PartRecords, ScratchFile, TileId};

use crate::MapError;
use crate::grid::{Lattice, TileSpan, TileTable};
use crate::store::{Durability, Origin, StoreSummary};
use crate::surfels::{SurfelCode, TileSurfels, surfels_of};
use crate::thickness::{CellSampler, SampledCells, ScanSample};
use crate::voxels::{Merged, OpenTiles, PartOfVoxel, RecentVoxels, Sums, TileMoments, VoxelRecord};
use crate::write_map::{SummedTiles, write_map};

/// Parts of voxels added to a tile at a time, while still in cache.
const BATCH: usize = 256;

impl Sums for TileMoments {
    fn bytes(&self) -> usize {
        Self::bytes(self)
    }
}

/// Bytes of a voxel in the scratch file each time its tile is spilled.
pub const SCRATCH_VOXEL_BYTES: usize = size_of::<VoxelRecord>();

/// Fuses points into a surfel map, out of core.
///
/// Any number of threads add points through `&self`; every sum is an exact integer, so the order is irrelevant. When
/// the tiles in memory exceed the budget, the least recently used are spilled to a scratch file as partial sums. They
/// are merged when the map is finished.
#[derive(Debug)]
pub struct MapFuser {
    lattice: Lattice,
    open: OpenTiles<TileMoments>,
    points: AtomicU64,
    scratch: ScratchFile<VoxelRecord>,
    sampler: Box<CellSampler>,
}

/// Per-thread buffers of [`MapFuser::add`].
#[derive(Debug, Default)]
pub struct FuseBuffers {
    recent: RecentVoxels,
    by_tile: TileTable<Vec<PartOfVoxel>>,
    scan: ScanSample,
}

impl MapFuser {
    /// An empty map whose tiles in memory stay below about `budget_bytes`. Partial tiles are spilled to an unlinked
    /// file in `scratch_folder`, which vanishes with the process.
    ///
    /// # Errors
    /// When the scratch file cannot be created.
    pub fn new(lattice: Lattice, budget_bytes: usize, scratch_folder: &Path) -> Result<Self, MapError> {
        Ok(Self::with(lattice, budget_bytes, ScratchFile::new(scratch_folder)?))
    }

    /// As [`MapFuser::new`], with the partial tiles in the file `scratch`: another process can resume from it and the
    /// state of [`MapFuser::put_down`].
    ///
    /// # Errors
    /// When the scratch file cannot be created.
    pub fn with_scratch(lattice: Lattice, budget_bytes: usize, scratch: &Path) -> Result<Self, MapError> {
        Ok(Self::with(lattice, budget_bytes, ScratchFile::named(scratch)?))
    }

    fn with(lattice: Lattice, budget_bytes: usize, scratch: ScratchFile<VoxelRecord>) -> Self {
        let (open, points) = (OpenTiles::new(Self::tiles_bytes(budget_bytes)), AtomicU64::new(0));
        Self { lattice, open, points, scratch, sampler: Box::new(CellSampler::new(SampledCells::default())) }
    }

    /// Resumes a partially fused map: `state` is the result of [`MapFuser::put_down`].
    ///
    /// # Errors
    /// When the scratch file cannot be opened, or is too short.
    pub fn resume(
        lattice: Lattice,
        budget_bytes: usize,
        scratch: &Path,
        state: &[u8],
    ) -> Result<Self, MapError> {
        let Ok((points, cells, list)) = postcard::from_bytes::<(u64, SampledCells, Vec<u8>)>(state) else {
            let detail = format!("it has {} bytes", state.len());
            return Err(MapError::Damaged { path: scratch.to_path_buf(), part: "list of parts", detail });
        };
        let fuser = Self::with(lattice, budget_bytes, ScratchFile::resume(scratch, &list)?);
        Ok(Self { points: points.into(), sampler: Box::new(CellSampler::new(cells)), ..fuser })
    }

    /// Spills all tiles to the scratch file, syncs it to disk, and returns the state for a resuming process. No thread
    /// may add points meanwhile.
    ///
    /// # Errors
    /// When the scratch file cannot be written.
    pub fn put_down(&self) -> Result<Vec<u8>, MapError> {
        for tile in self.open.tiles() {
            if let Some(moments) = self.open.take(tile) {
                self.scratch.append(tile, moments.into_records())?;
            }
        }
        let cells = self.sampler.lock();
        let state = postcard::to_allocvec(&(self.points(), &*cells, self.scratch.list()?));
        let cannot = MapError::io(Path::new("checkpoint"), "cannot store the sums of cells");
        state.map_err(|error| cannot(std::io::Error::other(error)))
    }

    /// Points added so far.
    pub fn points(&self) -> u64 {
        self.points.load(Ordering::Relaxed)
    }

    /// Bytes of partial tiles spilled so far.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch.bytes()
    }

    /// The grid of the map.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Memory for the sums of tiles in a budget: the sample of cells takes some, but leaves half.
    pub fn tiles_bytes(budget_bytes: usize) -> usize {
        budget_bytes.saturating_sub(SampledCells::BYTES).max(budget_bytes / 2)
    }

    /// Adds the points of one scan in world metres, seen in `segment` (0 to `i32::MAX - 1`), or in no known segment.
    ///
    /// # Errors
    /// As [`Self::add_block`].
    pub fn add(
        &self,
        points_in_world_m: &[[f64; 3]],
        segment: Option<i32>,
        buffers: &mut FuseBuffers,
    ) -> Result<(), MapError> {
        let mut scan = std::mem::take(&mut buffers.scan);
        let added = self.add_block(points_in_world_m, segment, buffers, &mut scan);
        self.end_scan(segment, &mut scan);
        buffers.scan = scan;
        added
    }

    /// Ends a scan whose points were added in blocks.
    pub fn end_scan(&self, segment: Option<i32>, scan: &mut ScanSample) {
        self.sampler.add(&self.lattice, scan, segment);
    }

    /// Adds some points of a scan, as [`Self::add`]; [`Self::end_scan`] ends it.
    ///
    /// # Errors
    /// When a point lies outside the world; then some of the other points are in the map but not counted in
    /// [`Self::points`]. Also when the scratch file cannot be written.
    pub fn add_block(
        &self,
        points_in_world_m: &[[f64; 3]],
        segment: Option<i32>,
        buffers: &mut FuseBuffers,
        scan: &mut ScanSample,
    ) -> Result<(), MapError> {
        let FuseBuffers { recent, by_tile, .. } = buffers;
        for (_, list) in by_tile.all_mut() {
            list.clear();
        }
        recent.add(&self.lattice, points_in_world_m, |voxel, sums| {
            self.sampler.sift(voxel, &sums, scan);
            let (tile, voxel) = self.lattice.in_tile(voxel);
            let list = by_tile.entry(tile);
            list.push(PartOfVoxel { voxel, sums });
            if list.len() == BATCH {
                self.open.add(tile, |moments| moments.add(list, segment));
                list.clear();
            }
        })?;
        // Tiles that the sensor has left keep no buffers.
        by_tile.retain(|list| !list.is_empty());
        for (tile, list) in by_tile.all_mut() {
            self.open.add(tile, |moments| moments.add(list, segment));
            list.clear();
        }
        self.points.fetch_add(points_in_world_m.len() as u64, Ordering::Relaxed);
        self.open.keep_budget(|tile, moments| self.scratch.append(tile, moments.into_records()))?;
        Ok(())
    }

    /// Computes surfels from the sums and writes the store at `path`, with `origin`. `on_tile` receives, after each
    /// batch, the number of finished tiles and their total.
    ///
    /// # Errors
    /// When the scratch file cannot be read back or the store cannot be written; then `path` is unchanged.
    pub fn finish(
        self,
        path: &Path,
        origin: &Origin,
        durability: Durability,
        on_tile: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<StoreSummary, MapError> {
        let summary = write_map(&self, TileSpan::default(), (path, origin, durability), on_tile)?;
        Ok(StoreSummary { cells: std::mem::take(&mut self.sampler.lock()), ..summary })
    }

    /// The voxels of a tile by their cells: its spilled parts are read in parallel, so that little is in memory. The
    /// part in memory is removed.
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

/// A part of a tile: spilled, or in memory.
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
