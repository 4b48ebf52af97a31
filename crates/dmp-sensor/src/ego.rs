//! Which returns are the vehicle that carries the sensor.

/// Edge of the cells in which the vehicle is looked for, metres.
const CELL_M: f64 = 0.1;
/// The vehicle ends within this distance of the sensor, metres. Further away, a floor or a wall that keeps
/// its distance must not be mistaken for it.
const REACH_M: f64 = 5.0;
/// A cell that is hit in more than this share of the scans looked at belongs to the vehicle.
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
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
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
        (self.box_m.is_some() && self.box_contains(point_in_sensor_m))
            || (self.cells.may_contain(point_in_sensor_m) && self.cells_contain(point_in_sensor_m))
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
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "Vec<Cell>", into = "Vec<Cell>")]
struct CellSet {
    lowest: Cell,
    /// Cells along x, y and z; none in an empty set.
    size: [u32; 3],
    bits: Vec<u64>,
    count: usize,
    /// A box in metres around the cells and a little more, none for no cells: a cheap look at most returns.
    around_m: Option<([f32; 3], [f32; 3])>,
}

/// As it is written down: the cells, by z, y and x.
impl From<CellSet> for Vec<Cell> {
    fn from(set: CellSet) -> Self {
        let [x, y, z] = set.size.map(|size| 0..size as i32);
        let cells = z.flat_map(|z| y.clone().map(move |y| (y, z)));
        let cells = cells.flat_map(|(y, z)| x.clone().map(move |x| [x, y, z]));
        let cells = cells.map(|offset| std::array::from_fn(|k| set.lowest[k] + offset[k]));
        cells.filter(|&cell| set.contains(cell)).collect()
    }
}

impl From<Vec<Cell>> for CellSet {
    /// Cells that are further away than any of a vehicle are excluded: they would make a large box.
    fn from(mut cells: Vec<Cell>) -> Self {
        cells.retain(|cell| cell.iter().all(|c| (-REACH_CELLS..=REACH_CELLS).contains(c)));
        Self::of(&cells)
    }
}

impl CellSet {
    fn of(cells: &[Cell]) -> Self {
        let bound = |k: usize| Some((cells.iter().map(|c| c[k]).min()?, cells.iter().map(|c| c[k]).max()?));
        let (Some(x), Some(y), Some(z)) = (bound(0), bound(1), bound(2)) else { return Self::default() };
        let lowest = [x.0, y.0, z.0];
        let size = [x, y, z].map(|(low, high)| high.abs_diff(low) + 1);
        let all = size.iter().map(|&n| n as usize).product::<usize>();
        let metres = |cells: i32| cells as f32 * CELL_M as f32;
        let around_m = (lowest.map(|c| metres(c - 1)), [x.1, y.1, z.1].map(|c| metres(c + 2)));
        let mut set =
            Self { lowest, size, bits: vec![0; all.div_ceil(64)], count: 0, around_m: Some(around_m) };
        for place in cells.iter().filter_map(|&cell| set.place(cell)).collect::<Vec<_>>() {
            let (word, bit) = (&mut set.bits[place / 64], 1 << (place % 64));
            set.count += usize::from(*word & bit == 0);
            *word |= bit;
        }
        set
    }

    /// The bit of a cell; `None` outside the box.
    #[inline]
    fn place(&self, cell: Cell) -> Option<usize> {
        let [x, y, z] = std::array::from_fn(|k| cell[k].wrapping_sub(self.lowest[k]) as u32);
        let [size_x, size_y, size_z] = self.size;
        let inside = x < size_x && y < size_y && z < size_z;
        inside.then(|| ((z * size_y + y) * size_x + x) as usize)
    }

    /// `false` only for points in none of the cells.
    #[inline]
    fn may_contain(&self, point_in_sensor_m: [f32; 3]) -> bool {
        let inside = |(low, high): ([f32; 3], [f32; 3])| {
            (0..3).all(|k| point_in_sensor_m[k] > low[k] && point_in_sensor_m[k] < high[k])
        };
        self.around_m.is_some_and(inside)
    }

    #[inline]
    fn contains(&self, cell: Cell) -> bool {
        self.place(cell).is_some_and(|place| self.bits[place / 64] >> (place % 64) & 1 == 1)
    }
}

/// No cell within 5 m of the sensor is further from its own than this, along any axis.
const REACH_CELLS: i32 = 51;
/// Cells along each edge of the box that holds them.
const VOTING_EDGE: usize = 2 * REACH_CELLS as usize + 1;

/// Votes of some scans on which cells are the vehicle. Order-free: votes merge by addition.
///
/// Takes 9 MB once a scan has voted: a place for each cell that may be the vehicle.
#[derive(Debug, Clone, Default)]
pub struct EgoVotes {
    scans: u32,
    /// Of each cell: the votes, and the number of the scan that voted last, counted from 1.
    hits: Vec<(u32, u32)>,
}

impl EgoVotes {
    /// Lets one scan vote: every cell within 5 m of the sensor with at least one of its `returns` (finite,
    /// within the used ranges, sensor frame) gets one vote.
    pub fn add_scan(&mut self, returns: impl Iterator<Item = [f32; 3]>) {
        let near =
            |p: &[f32; 3]| p.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>() <= REACH_M * REACH_M;
        self.scans += 1;
        self.hits.resize(VOTING_EDGE.pow(3), (0, 0));
        for cell in returns.filter(near).map(cell_of) {
            if let Some((votes, last)) = place_of_voter(cell).and_then(|place| self.hits.get_mut(place)) {
                *votes += u32::from(*last != self.scans);
                *last = self.scans;
            }
        }
    }

    /// Adds the votes of other scans.
    pub fn merge(&mut self, other: &Self) {
        self.scans += other.scans;
        self.hits.resize(self.hits.len().max(other.hits.len()), (0, 0));
        for (mine, theirs) in self.hits.iter_mut().zip(&other.hits) {
            *mine = (mine.0 + theirs.0, 0);
        }
    }

    /// The cells hit in more than 80 % of the scans; none where fewer than ten scans voted, since
    /// then chance alone passes.
    pub fn mask(&self) -> EgoMask {
        if self.scans < 10 {
            return EgoMask::default();
        }
        let needed = SHARE * f64::from(self.scans);
        let enough = self.hits.iter().enumerate().filter(|(_, (votes, _))| f64::from(*votes) > needed);
        let cells: Vec<Cell> = enough.map(|(place, _)| voter_at(place)).collect();
        EgoMask { cells: CellSet::of(&cells), box_m: None }
    }
}

/// Where the votes of a cell stand; `None` for one that is too far away.
#[inline]
fn place_of_voter(cell: Cell) -> Option<usize> {
    let [x, y, z] = cell.map(|c| c.wrapping_add(REACH_CELLS) as u32 as usize);
    (x.max(y).max(z) < VOTING_EDGE).then(|| (z * VOTING_EDGE + y) * VOTING_EDGE + x)
}

fn voter_at(place: usize) -> Cell {
    let (x, y, z) = (place % VOTING_EDGE, place / VOTING_EDGE % VOTING_EDGE, place / VOTING_EDGE.pow(2));
    [x, y, z].map(|c| c as i32 - REACH_CELLS)
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn votes_are_those_of_sets(
            scans in prop::collection::vec(prop::collection::vec(prop::array::uniform3(-3.2f32..3.2), 0..60), 10..14),
            common in prop::collection::vec(prop::array::uniform3(-2.88f32..2.88), 0..5),
        ) {
            let scans: Vec<_> = scans.into_iter().map(|scan| [scan, common.clone()].concat()).collect();
            let mut hits: HashMap<Cell, usize> = HashMap::new();
            let (mut all, mut halves) = (EgoVotes::default(), [EgoVotes::default(), EgoVotes::default()]);
            for (k, scan) in scans.iter().enumerate() {
                for cell in scan.iter().copied().map(cell_of).collect::<HashSet<_>>() {
                    *hits.entry(cell).or_default() += 1;
                }
                all.add_scan(scan.iter().copied().chain([[5.01, 0.0, 0.0]]));
                halves[k % 2].add_scan(scan.iter().copied());
            }
            let needed = SHARE * scans.len() as f64;
            let cells: Vec<Cell> =
                hits.into_iter().filter(|(_, hits)| *hits as f64 > needed).map(|(cell, _)| cell).collect();
            let expected = EgoMask { cells: CellSet::of(&cells), box_m: None };
            let [mut first, second] = halves;
            first.merge(&second);
            prop_assert_eq!(first.mask(), expected.clone());
            prop_assert_eq!(all.mask(), expected);
        }

        #[test]
        fn cells_are_a_set(
            cells in prop::collection::vec(prop::array::uniform3(-51..=51i32), 0..40),
            others in prop::collection::vec(prop::array::uniform3(-60..=60i32), 0..40),
        ) {
            let (set, expected) = (CellSet::of(&cells), cells.iter().copied().collect::<HashSet<Cell>>());
            prop_assert_eq!(set.count, expected.len());
            for cell in cells.into_iter().chain(others).chain([[i32::MIN; 3], [i32::MAX; 3]]) {
                prop_assert_eq!(set.contains(cell), expected.contains(&cell));
                for part in [0.0, 0.5, 0.999_999] {
                    let point = cell.map(|c| ((f64::from(c) + part) * CELL_M) as f32);
                    prop_assert!(set.may_contain(point) || !expected.contains(&cell_of(point)));
                }
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
