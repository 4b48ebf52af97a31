//! Two layers of one surface in a cloud that does not say when its points were seen.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use nalgebra::Vector3;

use super::flat::normal_of;
use super::sampled::{SampledCells, middle_m};
use super::summary::{DoubledPlace, Layers};
use crate::MapError;
use crate::grid::{Lattice, MixHasher};

/// Columns across a cell in both directions: a curb or a step stands in few of them, a second layer in all.
const COLUMNS: usize = 3;
/// Steps of a column along the normal.
const BINS: usize = 128;
/// How far the steps go from the middle, in voxel edges: a cell is 2 v wide, its corners are √3 v from its middle.
const REACH: f64 = 1.75;
/// Points that a column needs, and columns that a cell needs.
const COLUMN_POINTS: u32 = 20;
const LEAST_COLUMNS: usize = 5;
/// Each of two layers has at least this share of a column's points.
const LEAST_SHARE: f64 = 0.15;
/// Two layers are this many times as far apart as each is thick. Points of one bell, cut at the best place, give 2.7;
/// evenly spread ones 3.5.
const APART: f64 = 4.0;

/// Looks for second layers in the sampled cells of a cloud, whose points are read once more.
#[derive(Debug)]
pub struct LayerSearch {
    lattice: Lattice,
    by_cell: HashMap<[u32; 3], usize, BuildHasherDefault<MixHasher>>,
    cells: Vec<Columns>,
}

/// The points of a cell, by column and by their place along the normal.
#[derive(Debug)]
struct Columns {
    middle_m: Vector3<f64>,
    /// Two along the surface, then the normal.
    axes: [Vector3<f64>; 3],
    counts: Vec<u32>,
}

impl SampledCells {
    /// Begins a search in the cells whose points have a plane.
    pub fn search_layers(&self, lattice: &Lattice) -> LayerSearch {
        let mut search = LayerSearch { lattice: *lattice, by_cell: HashMap::default(), cells: Vec::new() };
        for (cell, sums) in self.cells() {
            let Some(normal) = normal_of(sums) else { continue };
            let normal = Vector3::from(normal);
            let along = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
            let axes = [along, normal.cross(&along), normal];
            let middle_m = Vector3::from(middle_m(lattice, cell));
            search.by_cell.insert(cell, search.cells.len());
            search.cells.push(Columns { middle_m, axes, counts: Vec::new() });
        }
        search
    }
}

impl LayerSearch {
    /// Adds points in world metres.
    ///
    /// # Errors
    /// When one lies outside the world.
    pub fn add(&mut self, points_in_world_m: &[[f64; 3]]) -> Result<(), MapError> {
        let edge_m = self.lattice.voxel_m();
        for &point in points_in_world_m {
            let cell = self.lattice.in_voxel(point)?.voxel.map(|v| v >> 1);
            let Some(&at) = self.by_cell.get(&cell) else { continue };
            let columns = &mut self.cells[at];
            columns.counts.resize(COLUMNS * COLUMNS * BINS, 0);
            let from_middle = Vector3::from(point) - columns.middle_m;
            let [a, b, place] = columns.axes.map(|axis| axis.dot(&from_middle) / edge_m);
            let [a, b] = [a, b].map(|along| share_to(COLUMNS, along));
            let bin = share_to(BINS, place / REACH);
            columns.counts[(a * COLUMNS + b) * BINS + bin] += 1;
        }
        Ok(())
    }

    /// The layers of all cells.
    pub fn found(&self) -> Layers {
        let bin_m = REACH * 2.0 * self.lattice.voxel_m() / BINS as f64;
        Layers::of(self.cells.iter().filter_map(|cell| {
            let layers_m = cell.layers_bins()? * bin_m;
            Some(DoubledPlace { place_m: cell.middle_m.into(), layers_m })
        }))
    }
}

/// Which of `count` equal parts of −1 to 1.
fn share_to(count: usize, at: f64) -> usize {
    (f64::midpoint(at, 1.0) * count as f64).clamp(0.0, count as f64 - 1.0) as usize
}

impl Columns {
    /// How far the layers of two thirds of the columns are apart, in bins; 0 for a single layer, `None` with too few points.
    fn layers_bins(&self) -> Option<f64> {
        let columns = self.counts.chunks_exact(BINS);
        let dense = columns.filter(|counts| counts.iter().sum::<u32>() >= COLUMN_POINTS);
        let found: Vec<Option<f64>> = dense.map(two_layers).collect();
        if found.len() < LEAST_COLUMNS {
            return None;
        }
        let mut apart: Vec<f64> = found.iter().copied().flatten().collect();
        apart.sort_by(f64::total_cmp);
        Some(if 3 * apart.len() >= 2 * found.len() { apart[apart.len() / 2] } else { 0.0 })
    }
}

/// Cuts points at the place that makes both parts thinnest (Otsu 1979); how far their means are apart, if they are two
/// layers.
fn two_layers(counts: &[u32]) -> Option<f64> {
    // A bin's points are spread over it.
    let of = |range: &[(f64, f64)]| {
        let n: f64 = range.iter().map(|(_, n)| n).sum();
        let mean = range.iter().map(|(at, n)| at * n).sum::<f64>() / n;
        let spread = range.iter().map(|(at, n)| (at - mean) * (at - mean) * n).sum::<f64>() + n / 12.0;
        (n, mean, spread)
    };
    let filled: Vec<(f64, f64)> =
        (0..).zip(counts).filter(|(_, n)| **n > 0).map(|(at, &n)| (f64::from(at), f64::from(n))).collect();
    let all: f64 = filled.iter().map(|(_, n)| n).sum();
    let cuts = (1..filled.len()).map(|cut| (of(&filled[..cut]), of(&filled[cut..])));
    let best = cuts.min_by(|(a, b), (c, d)| (a.2 + b.2).total_cmp(&(c.2 + d.2)));
    let ((below, low, spread_below), (above, high, spread_above)) = best?;
    let thick = ((spread_below + spread_above) / all).sqrt();
    let are_layers = below.min(above) >= LEAST_SHARE * all && high - low > APART * thick;
    are_layers.then_some(high - low)
}
