//! The sums of one cell of 2 v: by voxel, by segment and by single scans.

use serde::{Deserialize, Serialize};

use crate::grid::Lattice;
use crate::voxels::Moments;

/// Groups of segments that are kept apart in a cell; with more, neighbours are joined.
const MOST_GROUPS: usize = 16;

/// The sums of a cell's points.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct CellSums {
    /// By voxel, from the voxel's corner.
    pub(super) voxels: Vec<(i32, Moments)>,
    /// By segments, 2^level of them together, from the cell's corner.
    pub(super) groups: Vec<(i32, Moments)>,
    pub(super) level: u32,
    /// Σ (p − p̄)(p − p̄)ᵀ over the points that one scan has in one voxel, rounded for each scan, and its degrees of
    /// freedom.
    pub(super) of_scans: [i64; 6],
    pub(super) of_scans_freedom: u64,
}

impl CellSums {
    /// Adds all points that one scan has in a voxel; points without a segment are of no scan.
    pub(super) fn add(
        &mut self,
        lattice: &Lattice,
        voxel: [u32; 3],
        moments: &Moments,
        segment: Option<i32>,
    ) {
        let odd = voxel.map(|v| v & 1);
        let number = (odd[2] << 2 | odd[1] << 1 | odd[0]) as i32;
        sums_of(&mut self.voxels, number).merge_shifted(moments, [0; 3]);
        let shift = odd.map(|odd| i64::from(odd * lattice.voxel_units()));
        sums_of(&mut self.groups, segment.unwrap_or(0) >> self.level).merge_shifted(moments, shift);
        while self.groups.len() > MOST_GROUPS {
            self.level += 1;
            for (group, sums) in std::mem::take(&mut self.groups) {
                sums_of(&mut self.groups, group >> 1).merge_shifted(&sums, [0; 3]);
            }
        }
        if segment.is_none() {
            return;
        }
        let n = i128::from(moments.count);
        let [x, y, z] = moments.sum.map(i128::from);
        let squares = [x * x, x * y, x * z, y * y, y * z, z * z];
        for ((sum, product), square) in self.of_scans.iter_mut().zip(moments.products).zip(squares) {
            *sum += ((n * i128::from(product) - square) / n) as i64;
        }
        self.of_scans_freedom += moments.count - 1;
    }
}

/// The sums with this key in a list that is sorted by keys.
fn sums_of(list: &mut Vec<(i32, Moments)>, key: i32) -> &mut Moments {
    let at = list.binary_search_by_key(&key, |&(key, _)| key).unwrap_or_else(|at| {
        list.insert(at, (key, Moments::default()));
        at
    });
    &mut list[at].1
}
