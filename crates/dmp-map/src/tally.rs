//! Counts how rays meet surfels, out of core.

use std::path::Path;

use dmp_disk::{ScratchFile, TileId};

use crate::MapError;
use crate::voxels::{OpenTiles, Sums};

/// How rays meet one surfel. Counts saturate at 2³² − 1, whatever the order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Met {
    /// Rays that cross it and measured a range well beyond.
    pub through: u32,
    /// Rays that cross it near their measured range.
    pub on: u32,
}

impl Met {
    /// Adds other rays' counts.
    pub fn merge(&mut self, other: &Self) {
        self.through = self.through.saturating_add(other.through);
        self.on = self.on.saturating_add(other.on);
    }
}

/// A ray's crossing of one surfel of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crossing {
    /// The surfel's index among the tile's own.
    pub surfel: u32,
    /// Whether the ray ended there; otherwise it passed through.
    pub on: bool,
}

/// Spilled counts of one surfel.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Record {
    surfel: u32,
    through: u32,
    on: u32,
}

impl Sums for Vec<Met> {
    fn bytes(&self) -> usize {
        self.len() * size_of::<Met>()
    }
}

/// Counts how rays meet the surfels of a map, out of core.
///
/// Any number of threads count through `&self`; counts are integers, so their order is irrelevant. Above the budget,
/// the least recently used tiles are spilled to a scratch file; they are summed at the end.
#[derive(Debug)]
pub struct Tally {
    open: OpenTiles<Vec<Met>>,
    scratch: ScratchFile<Record>,
}

impl Tally {
    /// An empty tally that keeps about `budget_bytes` of counts in memory and spills the rest to an unlinked file in
    /// `scratch_folder`.
    ///
    /// # Errors
    /// When the scratch file cannot be created.
    pub fn new(budget_bytes: usize, scratch_folder: &Path) -> Result<Self, MapError> {
        Ok(Self { open: OpenTiles::new(budget_bytes), scratch: ScratchFile::new(scratch_folder)? })
    }

    /// Bytes of counts spilled so far.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch.bytes()
    }

    /// Counts crossings of a tile that has `surfels` surfels of its own.
    ///
    /// # Errors
    /// When the scratch file cannot be written.
    ///
    /// # Panics
    /// When a crossing has a larger surfel index.
    pub fn add(&self, tile: TileId, surfels: usize, crossings: &[Crossing]) -> Result<(), MapError> {
        self.open.add(tile, |counts| {
            if counts.is_empty() {
                *counts = vec![Met::default(); surfels];
            }
            for crossing in crossings {
                let met = &mut counts[crossing.surfel as usize];
                let count = if crossing.on { &mut met.on } else { &mut met.through };
                *count = count.saturating_add(1);
            }
        });
        self.open.keep_budget(|tile, counts| {
            let counted = (0u32..).zip(&counts).filter(|(_, met)| **met != Met::default());
            let records: Vec<Record> =
                counted.map(|(surfel, met)| Record { surfel, through: met.through, on: met.on }).collect();
            self.scratch.append(tile, records)
        })?;
        Ok(())
    }

    /// The counts of a tile's own surfels, of which there are `surfels`.
    ///
    /// # Errors
    /// When the scratch file cannot be read back unchanged.
    pub fn of_tile(&self, tile: TileId, surfels: usize) -> Result<Vec<Met>, MapError> {
        let mut counts = vec![Met::default(); surfels];
        self.open.look(tile, |met| counts.copy_from_slice(met));
        self.scratch.read(tile, |record| {
            if let Some(count) = counts.get_mut(record.surfel as usize) {
                count.merge(&Met { through: record.through, on: record.on });
            }
            Ok::<(), MapError>(())
        })?;
        Ok(counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashMap;

    proptest! {
        #[test]
        fn it_counts_what_a_table_counts_whatever_the_budget(
            crossings in prop::collection::vec((-2i32..3, -2i32..3, 0u32..40, any::<bool>()), 0..200),
            budget_bytes in prop::sample::select(vec![0usize, 1000, usize::MAX]),
        ) {
            let folder = tempfile::tempdir().unwrap();
            let tally = Tally::new(budget_bytes, folder.path()).unwrap();
            let mut table: HashMap<(TileId, u32), Met> = HashMap::new();
            for &(x, y, surfel, on) in &crossings {
                let tile = TileId { y, x };
                tally.add(tile, 40, &[Crossing { surfel, on }]).unwrap();
                let met = Met { through: u32::from(!on), on: u32::from(on) };
                table.entry((tile, surfel)).or_default().merge(&met);
            }
            prop_assert!(budget_bytes > 0 || crossings.is_empty() || tally.scratch_bytes() > 0);
            for x in -2..3 {
                for y in -2..3 {
                    let tile = TileId { y, x };
                    for (surfel, met) in (0u32..).zip(tally.of_tile(tile, 40).unwrap()) {
                        prop_assert_eq!(met, table.get(&(tile, surfel)).copied().unwrap_or_default());
                    }
                }
            }
        }
    }
}
