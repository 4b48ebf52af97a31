//! Neighbours within a radius.

use std::ops::Range;

use rayon::prelude::*;

/// Cells are numbered up to here (2^62); what lies further out shares the last.
const FARTHEST: f64 = (1_u64 << 62) as f64;

/// Points sorted into cubes whose edge is the radius of the search.
#[derive(Debug)]
pub(super) struct Grid {
    radius_m: f64,
    /// By cell, within a cell in the order given.
    points: Vec<[f64; 3]>,
    /// For each of `points`, its index in the cloud given.
    given: Vec<usize>,
    /// Occupied cells, ascending.
    cells: Vec<[i64; 3]>,
    /// Where the points of each cell begin; one more at the end.
    starts: Vec<usize>,
}

/// Sums over a neighbourhood, of offsets from the point whose it is: exact enough at any distance from the
/// world's origin.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Moments {
    pub(super) count: usize,
    sum: [f64; 3],
    /// xx, xy, xz, yy, yz, zz.
    products: [f64; 6],
}

impl Moments {
    #[inline]
    pub(super) fn add(&mut self, [x, y, z]: [f64; 3]) {
        self.count += 1;
        for (sum, value) in self.sum.iter_mut().zip([x, y, z]) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += value;
        }
    }

    /// The unbiased covariance (divided by count − 1), m²: xx, xy, xz, yy, yz, zz. At least two points.
    pub(super) fn covariance(&self) -> [f64; 6] {
        let [x, y, z] = self.sum;
        let count = self.count as f64;
        let of_means = [x * x, x * y, x * z, y * y, y * z, z * z];
        std::array::from_fn(|k| (self.products[k] - of_means[k] / count) / (count - 1.0))
    }
}

impl Grid {
    /// Points that are not finite are left out.
    pub(super) fn new(cloud: &[[f64; 3]], radius_m: f64) -> Self {
        let finite = |(_, point): &(usize, &[f64; 3])| point.iter().all(|c| c.is_finite());
        let mut keyed: Vec<([i64; 3], usize)> = cloud
            .iter()
            .enumerate()
            .filter(finite)
            .map(|(given, &point)| (cell_of(point, radius_m), given))
            .collect();
        // No two are alike, so that the order is one.
        keyed.par_sort_unstable();
        let mut cells: Vec<[i64; 3]> = Vec::new();
        let mut starts = Vec::new();
        for (place, &(cell, _)) in keyed.iter().enumerate() {
            if cells.last() != Some(&cell) {
                cells.push(cell);
                starts.push(place);
            }
        }
        starts.push(keyed.len());
        let given: Vec<usize> = keyed.into_iter().map(|(_, given)| given).collect();
        Self { radius_m, points: given.iter().map(|&k| cloud[k]).collect(), given, cells, starts }
    }

    /// For every cell in order, what `of_point` makes of its points in order: their neighbourhoods are
    /// looked up together.
    pub(super) fn map_cells<T: Send>(
        &self,
        of_point: impl Fn(usize, [f64; 3], &Around<'_>) -> Option<T> + Sync,
    ) -> Vec<T> {
        let of_cell = |(k, &cell): (usize, &[i64; 3])| {
            let around = self.around_cell(cell);
            let range = self.starts[k]..self.starts[k + 1];
            let values = range.filter_map(|at| of_point(self.given[at], self.points[at], &around));
            values.collect::<Vec<T>>()
        };
        let of_cells: Vec<Vec<T>> = self.cells.par_iter().enumerate().map(of_cell).collect();
        of_cells.into_iter().flatten().collect()
    }

    /// The neighbourhood of any point.
    pub(super) fn around(&self, point: [f64; 3]) -> Around<'_> {
        self.around_cell(cell_of(point, self.radius_m))
    }

    /// Cells are sorted by x, then y, then z: the three above each other follow one another.
    fn around_cell(&self, [x, y, z]: [i64; 3]) -> Around<'_> {
        let column = |k: i64| {
            let (x, y) = (x + k / 3 - 1, y + k % 3 - 1);
            let first = self.cells.partition_point(|&cell| cell < [x, y, z - 1]);
            let beyond = self.cells[first..].iter().take_while(|&&cell| cell <= [x, y, z + 1]);
            self.starts[first]..self.starts[first + beyond.count()]
        };
        Around { grid: self, columns: std::array::from_fn(|k| column(k as i64)) }
    }
}

/// The 27 cells around a place.
#[derive(Debug)]
pub(super) struct Around<'a> {
    grid: &'a Grid,
    columns: [Range<usize>; 9],
}

impl Around<'_> {
    /// Every point closer than the radius to `centre`, which lies in the middle cell, in the grid's order:
    /// its offset from `centre`, the square of its distance and its index in the cloud.
    #[inline]
    pub(super) fn each_neighbour(&self, centre: [f64; 3], mut visit: impl FnMut([f64; 3], f64, usize)) {
        let square_m2 = self.grid.radius_m * self.grid.radius_m;
        for range in &self.columns {
            for at in range.clone() {
                let point = self.grid.points[at];
                let offset = [point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]];
                let distance_m2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
                if distance_m2 < square_m2 {
                    visit(offset, distance_m2, self.grid.given[at]);
                }
            }
        }
    }

    /// The sums over all neighbours.
    #[inline]
    pub(super) fn moments(&self, centre: [f64; 3]) -> Moments {
        let mut moments = Moments::default();
        self.each_neighbour(centre, |offset, _, _| moments.add(offset));
        moments
    }

    /// The sums over the `count` nearest neighbours; of two equally near, the first in the cloud.
    /// `found` is scratch.
    pub(super) fn nearest_moments(
        &self,
        centre: [f64; 3],
        count: usize,
        found: &mut Vec<(f64, usize, [f64; 3])>,
    ) -> Moments {
        found.clear();
        self.each_neighbour(centre, |offset, distance_m2, given| found.push((distance_m2, given, offset)));
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut moments = Moments::default();
        found.iter().take(count).for_each(|&(_, _, offset)| moments.add(offset));
        moments
    }
}

fn cell_of(point: [f64; 3], radius_m: f64) -> [i64; 3] {
    // So far from the ends of the integers that neighbours have numbers too.
    point.map(|c| (c / radius_m).floor().clamp(-FARTHEST, FARTHEST) as i64)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Evenly spread numbers from 0 to 1 (splitmix64).
    pub(in super::super) fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    fn brute(cloud: &[[f64; 3]], centre: [f64; 3], radius_m: f64) -> Vec<usize> {
        let square = |p: &[f64; 3]| (0..3).map(|k| (p[k] - centre[k]) * (p[k] - centre[k])).sum::<f64>();
        (0..cloud.len()).filter(|&k| square(&cloud[k]) < radius_m * radius_m).collect()
    }

    #[test]
    fn neighbours_are_those_of_brute_force() {
        let mut next = random(1);
        let far = [5e5, -4e6, 0.0];
        let mut cloud: Vec<[f64; 3]> =
            (0..1500).map(|_| far.map(|c| c + (6.0 * next() - 3.0).round() / 2.0 + next())).collect();
        cloud[7][1] = f64::NAN;
        cloud[8][2] = f64::INFINITY;
        for radius_m in [0.3, 1.0, 9.0] {
            let grid = Grid::new(&cloud, radius_m);
            let mut compared = 0;
            for &centre in cloud.iter().filter(|p| p.iter().all(|c| c.is_finite())).step_by(7) {
                let mut found = Vec::new();
                grid.around(centre).each_neighbour(centre, |_, _, given| found.push(given));
                found.sort_unstable();
                assert_eq!(found, brute(&cloud, centre, radius_m));
                compared += found.len();
            }
            assert!(compared > 214);
        }
    }

    #[test]
    fn the_nearest_are_the_nearest() {
        let mut next = random(2);
        let cloud: Vec<[f64; 3]> = (0..400).map(|_| [next(), next(), next()]).collect();
        let grid = Grid::new(&cloud, 1.0);
        let centre = [0.4, 0.5, 0.6];
        let mut by_distance: Vec<f64> =
            cloud.iter().map(|p| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum()).collect();
        by_distance.sort_by(f64::total_cmp);
        let mut found = Vec::new();
        let moments = grid.around(centre).nearest_moments(centre, 12, &mut found);
        let trace = moments.products[0] + moments.products[3] + moments.products[5];
        assert_eq!(moments.count, 12);
        assert!((trace - by_distance[..12].iter().sum::<f64>()).abs() < 1e-12);
    }

    #[test]
    fn the_ends_of_the_numbers_do_not_overflow() {
        let cloud = [[1e300, 0.0, -1e300], [1e300, 0.0, -1e300], [0.0; 3]];
        let grid = Grid::new(&cloud, 1.0);
        assert_eq!(grid.around(cloud[0]).moments(cloud[0]).count, 2);
        assert_eq!(Grid::new(&[], 1.0).around([0.0; 3]).moments([0.0; 3]).count, 0);
    }
}
