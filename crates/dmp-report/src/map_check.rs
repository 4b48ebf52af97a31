//! What is found of one map alone.

use dmp_map::Thickness;
use serde::Serialize;

/// What `dmp map check` finds of a cloud, or of a store. Places are in its frame.
#[derive(Debug, Clone, Serialize)]
pub struct MapCheck {
    /// Format of the JSON.
    pub schema: &'static str,
    /// The file.
    pub path: String,
    /// Finite points; null for a store, which holds none.
    pub points: Option<u64>,
    /// Points that are not finite, excluded.
    pub points_dropped: u64,
    /// Surfels of its map.
    pub surfels: u64,
    /// Voxel edge, metres; cells are twice as wide.
    pub voxel_m: f64,
    /// How thick its flat places are, and where surfaces stand twice; null if flat places are too few, and for a
    /// store. A cloud does not tell visits apart: two layers are seen where they do not melt into one.
    pub thickness: Option<Thickness>,
    /// Gaps in the plan.
    pub holes: Holes,
    /// What was done with the file, in words.
    pub notes: Vec<String>,
    /// For pictures.
    #[serde(skip)]
    pub plan: GroundPlan,
    /// Flat cells: their middles and how thick they are, metres.
    #[serde(skip)]
    pub flat: Vec<([f64; 3], f64)>,
}

impl MapCheck {
    /// The format of the JSON.
    pub const SCHEMA: &'static str = "dmp-map-check/1";
}

/// Gaps in the plan that are surrounded by surfaces: what was not scanned, and what stands there, as a house.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Holes {
    /// Their number, from four columns on.
    pub count: u64,
    /// Their area, m².
    pub area_m2: f64,
    /// Area with surfaces, m².
    pub covered_m2: f64,
    /// A place in the largest, metres, and its area, m².
    pub largest: Option<([f64; 2], f64)>,
}

/// Which columns of the plan hold surfaces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GroundPlan {
    /// Lowest x and y, metres.
    pub corner_m: [f64; 2],
    /// Width of a column, metres.
    pub column_m: f64,
    /// Columns along x.
    pub width: usize,
    /// Columns, those along x consecutive.
    pub columns: Vec<PlanColumn>,
}

/// What a column of the plan holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PlanColumn {
    /// Nothing; it lies around the map.
    #[default]
    Outside,
    /// Surfaces.
    Covered,
    /// Nothing; surfaces surround it.
    Hole,
}

/// Holes with fewer columns are gaps between points.
const LEAST_COLUMNS: usize = 4;

impl GroundPlan {
    /// Marks what is surrounded by surfaces.
    pub fn holes(&mut self) -> Holes {
        let area_m2 = |columns: usize| columns as f64 * self.column_m * self.column_m;
        let covered = self.columns.iter().filter(|column| **column == PlanColumn::Covered).count();
        let mut holes = Holes { covered_m2: area_m2(covered), ..Holes::default() };
        let mut seen: Vec<bool> = self.columns.iter().map(|column| *column == PlanColumn::Covered).collect();
        for first in 0..self.columns.len() {
            let (region, is_surrounded) = region(&mut seen, self.width, first);
            if !is_surrounded || region.len() < LEAST_COLUMNS {
                continue;
            }
            region.iter().for_each(|&at| self.columns[at] = PlanColumn::Hole);
            let of_hole_m2 = region.len() as f64 * self.column_m * self.column_m;
            holes.count += 1;
            holes.area_m2 += of_hole_m2;
            if holes.largest.is_none_or(|(_, largest_m2)| of_hole_m2 > largest_m2) {
                holes.largest = Some((self.middle_m(region[region.len() / 2]), of_hole_m2));
            }
        }
        holes
    }

    fn middle_m(&self, at: usize) -> [f64; 2] {
        let [x, y] = [at % self.width, at / self.width].map(|n| n as f64 + 0.5);
        [self.corner_m[0] + x * self.column_m, self.corner_m[1] + y * self.column_m]
    }
}

/// The columns that are not seen yet and hang together with this one, and whether none lies on the border.
fn region(seen: &mut [bool], width: usize, first: usize) -> (Vec<usize>, bool) {
    let (mut region, mut is_surrounded) = (Vec::new(), true);
    if seen[first] {
        return (region, false);
    }
    let height = seen.len() / width;
    seen[first] = true;
    region.push(first);
    let mut next = 0;
    while let Some(&at) = region.get(next) {
        next += 1;
        let (x, y) = (at % width, at / width);
        is_surrounded &= x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        let left_right =
            [x.checked_sub(1), Some(x + 1)].map(|x| x.filter(|x| *x < width).map(|x| y * width + x));
        let down_up =
            [y.checked_sub(1), Some(y + 1)].map(|y| y.filter(|y| *y < height).map(|y| y * width + x));
        for beside in left_right.into_iter().chain(down_up).flatten() {
            if !std::mem::replace(&mut seen[beside], true) {
                region.push(beside);
            }
        }
    }
    (region, is_surrounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_surrounded_is_a_hole() {
        let rows =
            [".........", ".#######.", ".#....#..", ".#....#..", ".######..", "....#.#..", "....##..."];
        let of = |c| if c == '#' { PlanColumn::Covered } else { PlanColumn::Outside };
        let columns: Vec<PlanColumn> = rows.iter().flat_map(|row| row.chars().map(of)).collect();
        let mut plan = GroundPlan { corner_m: [100.0, -7.0], column_m: 0.5, width: 9, columns };
        let holes = plan.holes();
        // The gap of one column is none.
        assert_eq!((holes.count, holes.area_m2, holes.covered_m2), (1, 2.0, 0.25 * 21.0));
        let (place_m, area_m2) = holes.largest.unwrap();
        assert_eq!(area_m2, 2.0);
        assert!((101.0..103.0).contains(&place_m[0]) && (-6.0..-5.0).contains(&place_m[1]), "{place_m:?}");
        assert_eq!(plan.columns.iter().filter(|column| **column == PlanColumn::Hole).count(), 8);
        assert_eq!(GroundPlan::default().holes(), Holes::default());
    }
}
