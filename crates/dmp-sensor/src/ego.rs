use std::collections::{HashMap, HashSet};

/// Edge of the cells in which the vehicle is looked for, metres.
const CELL_M: f64 = 0.1;
/// The vehicle ends within this distance of the sensor, metres. Further away, a floor or a wall that keeps
/// its distance must not be taken for it.
const REACH_M: f64 = 5.0;
/// A cell that is hit in more than this share of the sampled scans belongs to the vehicle.
const SHARE: f64 = 0.8;

type Cell = [i32; 3];

fn cell_of(point_in_sensor_m: [f32; 3]) -> Cell {
    point_in_sensor_m.map(|c| (f64::from(c) / CELL_M).floor() as i32)
}

/// The vehicle as the sensor sees it: cells of 0.1 m, fixed in the sensor frame, that return an echo
/// wherever the vehicle goes. Left in the map it becomes a curtain along the path.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EgoMask {
    cells: HashSet<Cell>,
    box_m: Option<([i64; 3], [i64; 3])>,
}

impl EgoMask {
    /// A mask that is a box in the sensor frame, from its smallest to its largest corner in millimetres.
    pub fn from_box_mm(min_mm: [i64; 3], max_mm: [i64; 3]) -> Self {
        Self { cells: HashSet::new(), box_m: Some((min_mm, max_mm)) }
    }

    /// Whether a return at `point_in_sensor_m` (finite) is on the vehicle.
    #[inline]
    pub fn contains(&self, point_in_sensor_m: [f32; 3]) -> bool {
        if let Some((min, max)) = self.box_m {
            let inside = |k: usize| {
                let mm = f64::from(point_in_sensor_m[k]) * 1e3;
                mm >= min[k] as f64 && mm <= max[k] as f64
            };
            if (0..3).all(inside) {
                return true;
            }
        }
        !self.cells.is_empty() && self.cells.contains(&cell_of(point_in_sensor_m))
    }

    /// Number of cells found on the vehicle.
    pub fn cells(&self) -> usize {
        self.cells.len()
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
        EgoMask { cells: cells.collect(), box_m: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
