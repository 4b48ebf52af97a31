//! A sample of a map's cells of 2 v, with exact sums by voxel, by segment and by single scans.

use std::collections::BTreeMap;
use std::hash::Hasher as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

use super::cell_sums::CellSums;
use super::flat::FlatCell;
use super::summary::Thickness;
use crate::grid::{Lattice, MixHasher, UNITS_PER_M};
use crate::voxels::{Moments, PackedSums};

/// Cells that are kept: enough for a median to 4 %.
const MOST_CELLS: usize = 2048;
/// Bytes of a cell of a drive, about: many have few points.
const CELL_BYTES: usize = 1100;
/// The cells of a map with the lowest hashes. Sums are integers and the hash depends on the cell alone, so any order of
/// the points gives the same sample.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SampledCells {
    /// By hash and place, in cells from the origin of units.
    cells: BTreeMap<(u64, [u32; 3]), CellSums>,
    /// Cells with this hash or a higher one were left out.
    below: Option<u64>,
}

impl SampledCells {
    /// Memory of a full sample, bytes.
    pub(crate) const BYTES: usize = MOST_CELLS * CELL_BYTES;

    /// Adds all points that one scan has in a voxel.
    fn add(
        &mut self,
        lattice: &Lattice,
        (hash, voxel): (u64, [u32; 3]),
        moments: &Moments,
        segment: Option<i32>,
    ) {
        if self.below.is_some_and(|below| hash >= below) {
            return;
        }
        let cell = voxel.map(|v| v >> 1);
        self.cells.entry((hash, cell)).or_default().add(lattice, voxel, moments, segment);
        while self.cells.len() > MOST_CELLS
            && let Some(((hash, _), _)) = self.cells.pop_last()
        {
            self.below = Some(hash);
            // Other cells with the same hash go, too.
            self.cells.retain(|&(kept, _), _| kept < hash);
        }
    }

    /// The thickness of the map's flat places; `None` if these are too few. Visits are more than `reach` segments apart.
    pub fn thickness(&self, lattice: &Lattice, reach: i32) -> Option<Thickness> {
        let of_cell = |(cell, sums): (_, &CellSums)| {
            Some((middle_m(lattice, cell), FlatCell::of(sums, lattice, reach)?))
        };
        let dense = self.cells().filter(|(_, sums)| sums.is_dense()).count() as u64;
        Thickness::of(&self.cells().filter_map(of_cell).collect::<Vec<_>>(), dense)
    }

    /// The flat cells: their middles, world metres, and how thick they are, metres.
    pub fn flat_places(&self, lattice: &Lattice) -> Vec<([f64; 3], f64)> {
        let of_cell = |(cell, sums): (_, &CellSums)| {
            Some((middle_m(lattice, cell), FlatCell::of(sums, lattice, 0)?.thick_m))
        };
        self.cells().filter_map(of_cell).collect()
    }

    /// The cells, by their number from the origin of units.
    pub(super) fn cells(&self) -> impl Iterator<Item = ([u32; 3], &CellSums)> {
        self.cells.iter().map(|(&(_, cell), sums)| (cell, sums))
    }
}

/// The middle of a cell, world metres.
pub(super) fn middle_m(lattice: &Lattice, cell: [u32; 3]) -> [f64; 3] {
    let origin_m = lattice.origin_units() as f64 / UNITS_PER_M;
    cell.map(|c| (f64::from(c) + 0.5) * 2.0 * lattice.voxel_m() - origin_m)
}

/// The parts of voxels that one scan adds to sampled cells.
#[derive(Debug, Default)]
pub struct ScanSample {
    /// With the hash of the cell.
    parts: Vec<((u64, [u32; 3]), PackedSums)>,
}

/// A sample that many threads add to.
#[derive(Debug)]
pub(crate) struct CellSampler {
    cells: Mutex<SampledCells>,
    /// As in the cells, so that most parts are passed over without the lock.
    below: AtomicU64,
}

impl CellSampler {
    pub(crate) fn new(cells: SampledCells) -> Self {
        let below = AtomicU64::new(cells.below.unwrap_or(u64::MAX));
        Self { cells: Mutex::new(cells), below }
    }

    /// Collects a part of a voxel if its cell may be in the sample.
    #[inline]
    pub(crate) fn sift(&self, voxel: [u32; 3], part: &PackedSums, scan: &mut ScanSample) {
        let mut hasher = MixHasher::default();
        voxel.iter().for_each(|v| hasher.write_u32(v >> 1));
        let hash = hasher.finish();
        if hash < self.below.load(Ordering::Relaxed) {
            scan.parts.push(((hash, voxel), *part));
        }
    }

    /// Adds what was collected of one scan. The order of its parts is that of its points, and means nothing.
    pub(crate) fn add(&self, lattice: &Lattice, scan: &mut ScanSample, segment: Option<i32>) {
        if scan.parts.is_empty() {
            return;
        }
        scan.parts.sort_unstable_by_key(|&(place, _)| place);
        let mut cells = self.lock();
        for parts in scan.parts.chunk_by(|(a, _), (b, _)| a == b) {
            let mut moments = Moments::default();
            parts.iter().for_each(|(_, part)| moments.merge_shifted(&part.widened(), [0; 3]));
            cells.add(lattice, parts[0].0, &moments, segment);
        }
        scan.parts.clear();
        self.below.store(cells.below.unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    pub(crate) fn lock(&self) -> std::sync::MutexGuard<'_, SampledCells> {
        self.cells.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
