use std::collections::{HashMap, HashSet};

/// Edge of the cells in which the vehicle is looked for, metres.
const CELL_M: f64 = 0.1;
/// The vehicle ends within this distance of the sensor, metres. Further away, a floor or a wall that keeps
/// its distance must not be taken for it.
const REACH_M: f64 = 5.0;
/// No coordinate of a point in such a cell comes up to this, metres: a cheap look at most returns.
const CELLS_END_M: f32 = 5.2;
/// A cell that is hit in more than this share of the sampled scans belongs to the vehicle.
const SHARE: f64 = 0.8;

type Cell = [i32; 3];

#[inline]
fn cell_of(point_in_sensor_m: [f32; 3]) -> Cell {
    point_in_sensor_m.map(|c| floor(f64::from(c) / CELL_M))
}

/// The largest integer that is not larger, within `i32`: `f64::floor` is a call into a library on processors that are
/// not asked for more than the oldest instructions.
#[inline]
fn floor(x: f64) -> i32 {
    let towards_zero = x as i32;
    towards_zero.saturating_sub(i32::from(f64::from(towards_zero) > x))
}

/// The vehicle as the sensor sees it: cells of 0.1 m, fixed in the sensor frame, that return an echo
/// wherever the vehicle goes. Left in the map it becomes a curtain along the path.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EgoMask {
    cells: CellSet,
    box_m: Option<([i64; 3], [i64; 3])>,
}

impl EgoMask {
    /// A mask that is a box in the sensor frame, from its smallest to its largest corner in millimetres.
    pub fn from_box_mm(min_mm: [i64; 3], max_mm: [i64; 3]) -> Self {
        Self { cells: CellSet::default(), box_m: Some((min_mm, max_mm)) }
    }

    /// Whether a return at `point_in_sensor_m` (finite) is on the vehicle.
    #[inline]
    pub fn contains(&self, point_in_sensor_m: [f32; 3]) -> bool {
        let may_be_in_cells = point_in_sensor_m.iter().all(|c| c.abs() < CELLS_END_M);
        (self.box_m.is_some() && self.box_contains(point_in_sensor_m))
            || (may_be_in_cells && self.cells_contain(point_in_sensor_m))
    }

    #[inline(never)]
    fn box_contains(&self, point_in_sensor_m: [f32; 3]) -> bool {
        self.box_m.is_some_and(|(min, max)| {
            let inside = |k: usize| {
                let mm = f64::from(point_in_sensor_m[k]) * 1e3;
                mm >= min[k] as f64 && mm <= max[k] as f64
            };
            (0..3).all(inside)
        })
    }

    #[inline(never)]
    fn cells_contain(&self, point_in_sensor_m: [f32; 3]) -> bool {
        self.cells.contains(cell_of(point_in_sensor_m))
    }

    /// Number of cells found on the vehicle.
    pub fn cells(&self) -> usize {
        self.cells.count
    }
}

/// Cells near the sensor: a bit for each of the box around them, since every return is looked up.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct CellSet {
    lowest: Cell,
    /// Cells along x, y and z; none in an empty set.
    size: [u32; 3],
    bits: Vec<u64>,
    count: usize,
}

impl CellSet {
    fn of(cells: &[Cell]) -> Self {
        let bound = |k: usize| Some((cells.iter().map(|c| c[k]).min()?, cells.iter().map(|c| c[k]).max()?));
        let (Some(x), Some(y), Some(z)) = (bound(0), bound(1), bound(2)) else { return Self::default() };
        let lowest = [x.0, y.0, z.0];
        let size = [x, y, z].map(|(low, high)| high.abs_diff(low) + 1);
        let all = size.iter().map(|&n| n as usize).product::<usize>();
        let mut set = Self { lowest, size, bits: vec![0; all.div_ceil(64)], count: 0 };
        for place in cells.iter().filter_map(|&cell| set.place(cell)).collect::<Vec<_>>() {
            let (word, bit) = (&mut set.bits[place / 64], 1 << (place % 64));
            set.count += usize::from(*word & bit == 0);
            *word |= bit;
        }
        set
    }

    /// Which bit stands for a cell; `None` outside the box.
    #[inline]
    fn place(&self, cell: Cell) -> Option<usize> {
        let [x, y, z] = std::array::from_fn(|k| cell[k].wrapping_sub(self.lowest[k]) as u32);
        let [size_x, size_y, size_z] = self.size;
        let inside = x < size_x && y < size_y && z < size_z;
        inside.then(|| ((z * size_y + y) * size_x + x) as usize)
    }

    #[inline]
    fn contains(&self, cell: Cell) -> bool {
        self.place(cell).is_some_and(|place| self.bits[place / 64] >> (place % 64) & 1 == 1)
    }
}

/// Votes of a sample of scans on which cells are the vehicle. Order-free: votes merge by addition.
#[derive(Debug, Clone, Default)]
pub struct EgoVotes {
    scans: u32,
    hits: HashMap<Cell, u32>,
}

impl EgoVotes {
    /// Lets one scan vote: every cell within 5 m of the sensor with at least one of its `returns` (finite,
    /// within the used ranges, sensor frame) gets one vote.
    pub fn add_scan(&mut self, returns: impl Iterator<Item = [f32; 3]>) {
        let near =
            |p: &[f32; 3]| p.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>() <= REACH_M * REACH_M;
        let cells: HashSet<Cell> = returns.filter(near).map(cell_of).collect();
        for cell in cells {
            *self.hits.entry(cell).or_default() += 1;
        }
        self.scans += 1;
    }

    /// Adds another sample's votes.
    pub fn merge(&mut self, other: Self) {
        self.scans += other.scans;
        for (cell, hits) in other.hits {
            *self.hits.entry(cell).or_default() += hits;
        }
    }

    /// The cells hit in more than 80 % of the scans; none where fewer than ten scans voted, since
    /// then chance alone passes.
    pub fn mask(&self) -> EgoMask {
        if self.scans < 10 {
            return EgoMask::default();
        }
        let needed = SHARE * f64::from(self.scans);
        let cells = self.hits.iter().filter(|&(_, &hits)| f64::from(hits) > needed).map(|(&cell, _)| cell);
        // All within 5 m: a box of at most 102 cells along each edge.
        EgoMask { cells: CellSet::of(&cells.collect::<Vec<_>>()), box_m: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn cells_are_a_set(
            cells in prop::collection::vec(prop::array::uniform3(-51..=51i32), 0..40),
            others in prop::collection::vec(prop::array::uniform3(-60..=60i32), 0..40),
        ) {
            let (set, expected) = (CellSet::of(&cells), cells.iter().copied().collect::<HashSet<Cell>>());
            prop_assert_eq!(set.count, expected.len());
            for cell in cells.into_iter().chain(others).chain([[i32::MIN; 3], [i32::MAX; 3]]) {
                prop_assert_eq!(set.contains(cell), expected.contains(&cell));
            }
        }

        #[test]
        fn rounding_down_is_that_of_the_library(x: f64, near in -60.0..60.0f64, n in -60..60i32, ulps in -2..=2i64) {
            let beside = f64::from_bits((f64::from(n).to_bits() as i64 + ulps).max(0) as u64);
            for x in [x, near, f64::from(n), beside, -beside, 3e9, -3e9] {
                prop_assert_eq!(floor(x), x.floor() as i32);
            }
        }
    }

    #[test]
    fn what_moves_with_the_sensor_is_the_vehicle() {
        let mut votes = EgoVotes::default();
        for scan in 0..20 {
            let bonnet = [2.03, 0.04, -1.01];
            let wall = [5.0 + scan as f32, 3.0, 0.0];
            // A floor ring that keeps its distance, as on a level road.
            let ring = [7.02, 0.01, -1.8];
            // A bush that is seen again and again, but not always.
            let bush = if scan % 2 == 0 { [4.0, 4.0, 0.5] } else { [40.0, 4.0, 0.5] };
            votes.add_scan([bonnet, bonnet, wall, ring, bush].into_iter());
        }
        let mask = votes.mask();
        assert_eq!(mask.cells(), 1);
        assert!(mask.contains([2.01, 0.01, -1.09]));
        assert!(!mask.contains([4.0, 4.0, 0.5]));
    }

    #[test]
    fn a_few_scans_accuse_nobody() {
        let mut votes = EgoVotes::default();
        votes.add_scan([[2.0, 0.0, 0.0]].into_iter());
        assert_eq!(votes.mask().cells(), 0);
    }

    #[test]
    fn a_box_is_taken_as_given() {
        let mask = EgoMask::from_box_mm([-1000, -500, -2000], [1000, 500, 0]);
        assert!(mask.contains([0.9, -0.5, -1.0]));
        assert!(!mask.contains([1.1, 0.0, -1.0]));
    }
}
