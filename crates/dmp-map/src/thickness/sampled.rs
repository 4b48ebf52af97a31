//! A sample of a map's cells of 2 v, with exact sums by voxel, by segment and by single scans.

use std::collections::BTreeMap;
use std::hash::Hasher as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

use super::flat::FlatCell;
use super::summary::Thickness;
use crate::grid::{Lattice, MixHasher, UNITS_PER_M};
use crate::voxels::{Moments, PackedSums};

/// Cells that are kept: enough for a median to 4 %, in about 3 MB.
const MOST_CELLS: usize = 2048;
/// Bytes of a cell of a drive, about.
const CELL_BYTES: usize = 1700;
/// Groups of segments that are kept apart in a cell; with more, neighbours are joined.
const MOST_GROUPS: usize = 16;

/// The cells of a map with the lowest hashes. Sums are integers and the hash depends on the cell alone, so any order of
/// the points gives the same sample.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SampledCells {
    /// By hash and place, in cells from the origin of units.
    cells: BTreeMap<(u64, [u32; 3]), CellSums>,
    /// Cells with this hash or a higher one were left out.
    below: Option<u64>,
}

/// The sums of a cell's points, from its lowest corner.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CellSums {
    /// By voxel, from the voxel's corner.
    pub(super) voxels: Vec<(i32, Moments)>,
    /// By segments, 2^level of them together.
    pub(super) groups: Vec<(i32, Moments)>,
    pub(super) level: u32,
    /// Σ (p − p̄)(p − p̄)ᵀ over the points that one scan has in one voxel, rounded for each scan, and its degrees of
    /// freedom.
    pub(super) of_scans: [i64; 6],
    pub(super) of_scans_freedom: u64,
}

/// The sums with this key in a list that is sorted by keys.
fn sums_of(list: &mut Vec<(i32, Moments)>, key: i32) -> &mut Moments {
    let at = list.binary_search_by_key(&key, |&(key, _)| key).unwrap_or_else(|at| {
        list.insert(at, (key, Moments::default()));
        at
    });
    &mut list[at].1
}

impl CellSums {
    fn add(&mut self, lattice: &Lattice, voxel: [u32; 3], part: &PackedSums, segment: i32) {
        let moments = part.widened();
        let odd = voxel.map(|v| v & 1);
        sums_of(&mut self.voxels, (odd[2] << 2 | odd[1] << 1 | odd[0]) as i32)
            .merge_shifted(&moments, [0; 3]);
        let shift = odd.map(|odd| i64::from(odd * lattice.voxel_units()));
        sums_of(&mut self.groups, segment >> self.level).merge_shifted(&moments, shift);
        while self.groups.len() > MOST_GROUPS {
            self.level += 1;
            for (group, sums) in std::mem::take(&mut self.groups) {
                sums_of(&mut self.groups, group >> 1).merge_shifted(&sums, [0; 3]);
            }
        }
        // Sums of a part have 31 bits: their products have 62.
        let n = moments.count as i64;
        let [x, y, z] = moments.sum;
        let squares = [x * x, x * y, x * z, y * y, y * z, z * z];
        for ((sum, product), square) in self.of_scans.iter_mut().zip(moments.products).zip(squares) {
            *sum += (n * product - square) / n;
        }
        self.of_scans_freedom += moments.count - 1;
    }
}

impl SampledCells {
    /// Memory of a full sample, bytes.
    pub(crate) const BYTES: usize = MOST_CELLS * CELL_BYTES;

    fn add(&mut self, lattice: &Lattice, (hash, voxel, part): &Sampled, segment: i32) {
        if self.below.is_some_and(|below| *hash >= below) {
            return;
        }
        let cell = voxel.map(|v| v >> 1);
        self.cells.entry((*hash, cell)).or_default().add(lattice, *voxel, part, segment);
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

/// Hash of the cell, voxel, sums.
pub(crate) type Sampled = (u64, [u32; 3], PackedSums);

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
    pub(crate) fn sift(&self, voxel: [u32; 3], part: &PackedSums, sampled: &mut Vec<Sampled>) {
        let mut hasher = MixHasher::default();
        voxel.iter().for_each(|v| hasher.write_u32(v >> 1));
        let hash = hasher.finish();
        if hash < self.below.load(Ordering::Relaxed) {
            sampled.push((hash, voxel, *part));
        }
    }

    /// Adds what was collected of one scan, or of a block of it.
    pub(crate) fn add(&self, lattice: &Lattice, sampled: &mut Vec<Sampled>, segment: Option<i32>) {
        if sampled.is_empty() {
            return;
        }
        let mut cells = self.lock();
        for part in sampled.drain(..) {
            cells.add(lattice, &part, segment.unwrap_or(0));
        }
        self.below.store(cells.below.unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    pub(crate) fn lock(&self) -> std::sync::MutexGuard<'_, SampledCells> {
        self.cells.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
