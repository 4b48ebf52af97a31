//! Neighbours within a metre.

use std::collections::HashMap;

/// Points closer than this are neighbours, metres (`KNN_RAD` of map-metrics).
pub(super) const RADIUS_M: f64 = 1.0;

/// Points by cubes whose edge is the radius.
pub(super) struct Grid<'a> {
    cloud: &'a [[f64; 3]],
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl<'a> Grid<'a> {
    pub(super) fn new(cloud: &'a [[f64; 3]]) -> Self {
        let mut cells: HashMap<_, Vec<usize>> = HashMap::new();
        for (k, point) in cloud.iter().enumerate() {
            cells.entry(cell_of(point)).or_default().push(k);
        }
        Self { cloud, cells }
    }

    /// Offsets from `centre` to its neighbours, itself included where it is in the cloud: exact at any distance from the
    /// origin.
    pub(super) fn offsets(&self, centre: &[f64; 3]) -> Vec<[f64; 3]> {
        let [x, y, z] = cell_of(centre);
        let around = (0..27).map(|k| [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1]);
        let members = around.filter_map(|cell| self.cells.get(&cell)).flatten();
        let offsets = members.map(|&k| -> [f64; 3] { std::array::from_fn(|c| self.cloud[k][c] - centre[c]) });
        offsets.filter(|offset| dot(offset, offset) < RADIUS_M * RADIUS_M).collect()
    }
}

fn cell_of(point: &[f64; 3]) -> [i64; 3] {
    point.map(|c| (c / RADIUS_M).floor() as i64)
}

pub(super) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The unbiased covariance of offsets, m²: xx, xy, xz, yy, yz, zz. At least two points.
pub(super) fn covariance(offsets: &[[f64; 3]]) -> [f64; 6] {
    const AXES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    let count = offsets.len() as f64;
    let mean = |k: usize| offsets.iter().map(|offset| offset[k]).sum::<f64>() / count;
    let mean = [mean(0), mean(1), mean(2)];
    AXES.map(|(k, l)| {
        offsets.iter().map(|o| (o[k] - mean[k]) * (o[l] - mean[l])).sum::<f64>() / (count - 1.0)
    })
}
