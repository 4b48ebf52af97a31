//! Positions of a drive's scans in a run, by grid cell.

use std::collections::HashMap;

/// Positions of the scans in a run, by cells of the plane.
#[derive(Debug)]
pub(super) struct Whereabouts {
    pub(super) in_world_m: Vec<[f64; 3]>,
    cells: HashMap<[i64; 2], Vec<usize>>,
}

impl Whereabouts {
    /// Edge of the cells, metres.
    const CELL_M: f64 = 35.0;

    pub(super) fn new(in_world_m: Vec<[f64; 3]>) -> Self {
        let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for (scan, &[x, y, _]) in in_world_m.iter().enumerate() {
            cells.entry(Self::cell([x, y])).or_default().push(scan);
        }
        Self { in_world_m, cells }
    }

    fn cell(place_m: [f64; 2]) -> [i64; 2] {
        place_m.map(|c| (c / Self::CELL_M).floor() as i64)
    }

    pub(super) fn cell_of(&self, scan: usize) -> [i64; 2] {
        let [x, y, _] = self.in_world_m[scan];
        Self::cell([x, y])
    }

    /// The cells that cover `radius_m`, at most a cell's edge.
    pub(super) fn cells_around([x, y, _]: [f64; 3], radius_m: f64) -> impl Iterator<Item = [i64; 2]> + use<> {
        let (low, high) =
            (Self::cell([x - radius_m, y - radius_m]), Self::cell([x + radius_m, y + radius_m]));
        (low[0]..=high[0]).flat_map(move |i| (low[1]..=high[1]).map(move |j| [i, j]))
    }

    pub(super) fn within(&self, centre_m: [f64; 3], radius_m: f64) -> impl Iterator<Item = usize> + '_ {
        let scans = Self::cells_around(centre_m, radius_m).filter_map(|cell| self.cells.get(&cell)).flatten();
        scans.copied().filter(move |&scan| distance(self.in_world_m[scan], centre_m) <= radius_m)
    }
}

pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
