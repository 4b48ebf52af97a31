//! Counts how rays met surfels, out of core.

use std::path::Path;

use dmp_disk::{ScratchFile, TileId};

use crate::MapError;
use crate::open_tiles::{OpenTiles, Sums};

/// How rays met one surfel. Counts stop at 2³² − 1, which no order of adding changes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Met {
    /// Rays that crossed it and measured something well beyond.
    pub through: u32,
    /// Rays that crossed it about where they measured something.
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
    /// The surfel, as [`crate::Tile::surfels`] has it.
    pub surfel: u32,
    /// Whether the ray measured something there; otherwise it went on.
    pub on: bool,
}

/// Counts of one surfel put aside.
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

/// Counts how rays met the surfels of a map, out of core.
///
/// Any number of threads count through `&self`; counts are integers, so the tally does not depend on their
/// order. Tiles unused for longest go to a scratch file when the budget is exceeded, and are summed in the
/// end.
#[derive(Debug)]
pub struct Tally {
    open: OpenTiles<Vec<Met>>,
    scratch: ScratchFile<Record>,
}

impl Tally {
    /// An empty tally that keeps about `budget_bytes` of counts in memory, the rest in a file without a
    /// name in `scratch_folder`.
    ///
    /// # Errors
    /// When the scratch file cannot be made.
    pub fn new(budget_bytes: usize, scratch_folder: &Path) -> Result<Self, MapError> {
        Ok(Self { open: OpenTiles::new(budget_bytes), scratch: ScratchFile::new(scratch_folder)? })
    }

    /// Bytes of counts put aside so far.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch.bytes()
    }

    /// Counts crossings of a tile that has `surfels` surfels, copies over its borders among them.
    ///
    /// # Errors
    /// When the scratch file cannot be written.
    ///
    /// # Panics
    /// Where a crossing is of a surfel beyond those.
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

    /// The counts of a tile's `surfels` surfels, copies over its borders among them.
    ///
    /// # Errors
    /// When the scratch file cannot be read back as it was written.
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
