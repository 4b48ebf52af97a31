//! The voxels of a map that rays contradict: traces of moving objects.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::hash::BuildHasherDefault;
use std::path::Path;
use std::sync::Arc;

use dmp_disk::{BudgetCache, TileId, Weight};

use crate::MapError;
use crate::grid::{MixHasher, Voxel};
use crate::store::{Durability, Origin, Store, StoreWriter, TileEntry};
use crate::surfels::{SurfelCode, borders_of};
use crate::tally::{Met, Tally};

/// The voxels of a map that rays have shown to be free, looked up under a byte budget.
///
/// They are a separate store with the surfels of those voxels.
#[derive(Debug)]
pub struct FreeVoxels {
    store: Store,
    tiles: BudgetCache<TileId, VoxelSet>,
}

/// Per-thread buffers of [`FreeVoxels::mark`].
#[derive(Debug, Default)]
pub struct MarkBuffers {
    tiles: HashMap<TileId, Arc<VoxelSet>, BuildHasherDefault<MixHasher>>,
}

/// Voxels of a tile, sorted.
#[derive(Debug)]
struct VoxelSet(Vec<Voxel>);

impl Weight for VoxelSet {
    fn weight_bytes(&self) -> usize {
        self.0.capacity() * size_of::<Voxel>() + 64
    }
}

impl FreeVoxels {
    /// Collects the voxels of `map` whose surfels' counts satisfy `is_free`. They go to the file `path`, which is
    /// unlinked; about `budget_bytes` of them are in memory.
    ///
    /// # Errors
    /// When the map or the tally cannot be read, or the file cannot be written.
    pub fn find(
        map: &Store,
        tally: &Tally,
        is_free: impl Fn(Met) -> bool,
        path: &Path,
        budget_bytes: usize,
    ) -> Result<Self, MapError> {
        let lattice = map.lattice();
        let mut writer = StoreWriter::create(path, lattice, &Origin::of("voxels that are free"))?;
        let tiles: BTreeSet<TileId> = map.entries().map(|entry| entry.tile).collect();
        // Copies of a tile's discs follow its neighbours' own, in the order of the tiles they come from.
        let mut copies_before: HashMap<TileId, usize, BuildHasherDefault<MixHasher>> = HashMap::default();
        let mut of_copies = CopyCounts { tally, tiles: HashMap::new() };
        for &id in &tiles {
            let mut content = map.own_codes(id)?;
            let surfels = map.entry(id).map_or(0, TileEntry::surfels);
            of_copies.forget_rows_below(id.y - 1);
            let mut met = tally.of_tile(id, surfels as usize)?;
            met.truncate(content.codes.len());
            for (neighbour, index) in borders_of(&lattice, id, &content).iter().map(|c| (c.0, c.1.index)) {
                let Some(entry) = map.entry(neighbour) else { continue };
                let before = copies_before.entry(neighbour).or_default();
                let place = *before;
                *before += 1;
                let counts = of_copies.of_tile(entry)?;
                if let (Some(met), Some(count)) = (met.get_mut(index), counts.get(place)) {
                    met.merge(count);
                }
            }
            let mut met = met.into_iter();
            content.codes.retain(|_| met.next().is_some_and(&is_free));
            writer.write_own(id, &content)?;
        }
        writer.finish(Durability::Temporary)?;
        Ok(Self { store: Store::open_once(path)?, tiles: BudgetCache::new(budget_bytes) })
    }

    /// The number of free voxels.
    pub fn count(&self) -> u64 {
        self.store.surfels()
    }

    /// Sets for each point, world metres, whether its voxel is free; `marks` is overwritten.
    ///
    /// # Errors
    /// When a point lies outside the world, or a tile is damaged.
    pub fn mark(
        &self,
        points_in_world_m: impl Iterator<Item = [f64; 3]>,
        marks: &mut Vec<bool>,
        buffers: &mut MarkBuffers,
    ) -> Result<(), MapError> {
        marks.clear();
        buffers.tiles.clear();
        let lattice = self.store.lattice();
        for point in points_in_world_m {
            let (tile, voxel) = lattice.locate(point)?;
            if self.store.entry(tile).is_none() {
                marks.push(false);
                continue;
            }
            let voxels = match buffers.tiles.entry(tile) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(self.tiles.get(tile, || self.load(tile))?),
            };
            marks.push(voxels.0.binary_search(&voxel).is_ok());
        }
        Ok(())
    }

    fn load(&self, id: TileId) -> Result<VoxelSet, MapError> {
        let content = self.store.own_codes(id)?;
        let voxel = |code: &SurfelCode| {
            let [x, y, z] = code.voxel;
            Voxel { x: x as u16, y: y as u16, z }
        };
        let mut voxels: Vec<Voxel> = content.codes.iter().map(voxel).collect();
        voxels.sort_unstable();
        Ok(VoxelSet(voxels))
    }
}

/// Counts of the copies in each tile, read once and kept while their rows are in use.
struct CopyCounts<'a> {
    tally: &'a Tally,
    tiles: HashMap<TileId, Vec<Met>>,
}

impl CopyCounts<'_> {
    fn of_tile(&mut self, entry: &TileEntry) -> Result<&[Met], MapError> {
        Ok(match self.tiles.entry(entry.tile) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let mut counts = self.tally.of_tile(entry.tile, entry.surfels() as usize)?;
                new.insert(counts.split_off(entry.own.surfels as usize))
            }
        })
    }

    /// Tiles come row by row: those two rows back are not needed again.
    fn forget_rows_below(&mut self, row: i32) {
        self.tiles.retain(|tile, _| tile.y >= row);
    }
}
