//! Maps from above: what the returns that lie in each cell of the ground say.

use dmp_reduce::Scales;

use super::seen::{SampledReturn, judged_by_m};
use crate::colour::{STEPS, step};
use crate::image::Image;

/// Edges that cells have, metres of a drive.
const EDGES_M: [f64; 12] = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 32.0, 50.0];
/// Cells along the longer side of a map at most.
const LONGEST: usize = 400;
/// A map shows so much beyond the way, metres of a drive.
const MARGIN_M: f64 = 50.0;
/// Fewer predicted returns say nothing of a cell.
const FEWEST: u32 = 2;

/// Where the cells of a map lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    /// Edge of a cell, metres.
    pub(crate) cell_m: f64,
    /// The corner with the smallest coordinates, metres in the world of a run.
    pub(crate) corner_m: [f64; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Grid {
    /// Cells for every place near the positions, as small as few enough of them can be; none where there are no
    /// positions.
    pub(crate) fn around(positions: impl Iterator<Item = [f64; 3]>, scales: Scales) -> Self {
        let metre_m = scales.lengths().metre_m;
        // Whole millimetres: a tenth of 3 is not 0.3.
        let mut edges_m = EDGES_M.map(|m| (1e3 * metre_m * m).round() / 1e3).into_iter();
        let Some([low, high]) = extent_m(positions, metre_m * MARGIN_M) else {
            return Self { cell_m: metre_m * EDGES_M[0], corner_m: [0.0; 2], columns: 0, rows: 0 };
        };
        let longest_m = (high[0] - low[0]).max(high[1] - low[1]);
        let fits = |edge_m: &f64| longest_m / edge_m <= LONGEST as f64;
        let cell_m = edges_m.find(fits).unwrap_or((longest_m / LONGEST as f64).ceil());
        let corner_m = low.map(|m| cell_m * (m / cell_m).floor());
        let cells =
            |axis: usize| (((high[axis] - corner_m[axis]) / cell_m).ceil() as usize).clamp(1, LONGEST + 1);
        Self { cell_m, corner_m, columns: cells(0), rows: cells(1) }
    }

    /// The part between two cells, both included.
    fn part(&self, [from, to]: [[usize; 2]; 2]) -> Self {
        let corner_m = [0, 1].map(|axis| self.corner_m[axis] + from[axis] as f64 * self.cell_m);
        let [columns, rows] = [0, 1].map(|axis| to[axis] + 1 - from[axis]);
        Self { cell_m: self.cell_m, corner_m, columns, rows }
    }

    /// The part around all cells for which `is_shown` holds; nothing where it holds for none.
    fn around_shown(&self, is_shown: impl Fn(usize) -> bool) -> ([[usize; 2]; 2], Self) {
        let shown = (0..self.columns * self.rows).filter(|cell| is_shown(*cell));
        let ends = shown.fold(None, |ends: Option<[[usize; 2]; 2]>, cell| {
            let at = [cell % self.columns, cell / self.columns];
            let [from, to] = ends.unwrap_or([at, at]);
            Some([
                [0, 1].map(|axis: usize| from[axis].min(at[axis])),
                [0, 1].map(|axis: usize| to[axis].max(at[axis])),
            ])
        });
        match ends {
            Some(ends) => (ends, self.part(ends)),
            None => ([[0; 2]; 2], Self { columns: 0, rows: 0, ..*self }),
        }
    }

    /// The cells of a part, row by row.
    fn cells_of<T: Copy>(&self, cells: &[T], from: [usize; 2], part: &Self) -> Vec<T> {
        let row = |row: usize| (row + from[1]) * self.columns + from[0];
        (0..part.rows).flat_map(|k| cells[row(k)..row(k) + part.columns].iter().copied()).collect()
    }

    fn cell_of(&self, at_m: [f64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| ((at_m[axis] - self.corner_m[axis]) / self.cell_m).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64;
        inside.then(|| y as usize * self.columns + x as usize)
    }
}

/// Smallest and largest x and y, with a margin.
fn extent_m(positions: impl Iterator<Item = [f64; 3]>, margin_m: f64) -> Option<[[f64; 2]; 2]> {
    let mut positions = positions.peekable();
    positions.peek()?;
    let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let [low, high] = positions.fold(none, |[low, high], at| {
        [
            [0, 1].map(|axis: usize| low[axis].min(at[axis])),
            [0, 1].map(|axis: usize| high[axis].max(at[axis])),
        ]
    });
    Some([low.map(|m| m - margin_m), high.map(|m| m + margin_m)])
}

/// What is summed in a cell.
pub(crate) trait Cell: Copy + Default {
    /// Returns in it.
    fn returns(&self) -> u32;
}

/// A map of cells from above.
#[derive(Debug)]
pub(crate) struct Cells<T> {
    pub(crate) grid: Grid,
    cut_m: f64,
    values: Vec<T>,
}

/// Residuals of one run, by cells of its world.
pub(crate) type Ground = Cells<Residuals>;

/// Residuals of two runs on the same returns, by cells of the world of the first.
pub(crate) type Difference = Cells<Both>;

impl<T: Cell> Cells<T> {
    pub(crate) fn new(grid: Grid, scales: Scales) -> Self {
        Self { grid, cut_m: cut_m(scales), values: vec![T::default(); grid.columns * grid.rows] }
    }

    fn cell_at(&mut self, at_m: [f64; 2]) -> Option<&mut T> {
        self.grid.cell_of(at_m).map(|cell| &mut self.values[cell])
    }

    /// Without the margins in which too few returns lie.
    pub(crate) fn trimmed(self) -> Self {
        let (ends, grid) = self.grid.around_shown(|cell| self.values[cell].returns() >= FEWEST);
        let values = self.grid.cells_of(&self.values, ends[0], &grid);
        Self { grid, values, ..self }
    }

    /// A pixel a cell, y upwards.
    fn image(&self, colour: impl Fn(&T) -> Option<u8>) -> Image {
        let Grid { columns, rows, .. } = self.grid;
        let mut image = Image::new(columns, rows);
        for (cell, colour) in self.values.iter().map(colour).enumerate() {
            if let Some(colour) = colour {
                image.set((cell % columns) as i32, (rows - 1 - cell / columns) as i32, colour);
            }
        }
        image
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Residuals {
    returns: u32,
    predicted: u32,
    revisited: u32,
    square_m2: f64,
}

impl Cell for Residuals {
    fn returns(&self) -> u32 {
        self.returns
    }
}

impl Residuals {
    fn rms_m(&self) -> Option<f64> {
        (self.predicted >= FEWEST).then(|| (self.square_m2 / f64::from(self.predicted)).sqrt())
    }
}

impl Ground {
    pub(crate) fn add(&mut self, at_m: [f64; 2], sampled: &SampledReturn) {
        let cut_m = self.cut_m;
        let Some(cell) = self.cell_at(at_m) else { return };
        cell.returns += 1;
        cell.revisited += u32::from(sampled.revisited);
        if let Some(residual_m) = sampled.residual_m {
            cell.predicted += 1;
            cell.square_m2 += cut_square_m2(residual_m, cut_m);
        }
    }

    /// Roots of mean squares of all cells that have one.
    pub(crate) fn rms_of_cells(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().filter_map(Residuals::rms_m)
    }

    /// Colours of residuals, the worst at `top_m`.
    pub(crate) fn residuals(&self, top_m: f64) -> Image {
        self.image(|cell| Some(1 + step(cell.rms_m()? / top_m) as u8))
    }

    /// 1 where most returns are predicted from another visit, 2 from other parts of the drive, 3 not at all.
    pub(crate) fn coverage(&self) -> Image {
        self.image(|cell| {
            let most = |count: u32| 2 * count > cell.returns;
            let number = 3 - u8::from(most(cell.predicted)).max(2 * u8::from(most(cell.revisited)));
            (cell.returns >= FEWEST).then_some(number)
        })
    }
}

/// Common returns, and the sums of the squares of both runs.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Both {
    returns: u32,
    squares_m2: [f64; 2],
}

impl Cell for Both {
    fn returns(&self) -> u32 {
        self.returns
    }
}

impl Both {
    /// Root of the mean square of the second less that of the first, metres: positive where the first is better.
    fn difference_m(&self) -> Option<f64> {
        let [first_m, second_m] =
            self.squares_m2.map(|square_m2| (square_m2 / f64::from(self.returns)).sqrt());
        (self.returns >= FEWEST).then_some(second_m - first_m)
    }
}

impl Difference {
    /// Adds a return that both predict.
    pub(crate) fn add(&mut self, at_m: [f64; 2], residuals_m: [f32; 2]) {
        let cut_m = self.cut_m;
        let Some(cell) = self.cell_at(at_m) else { return };
        cell.returns += 1;
        for (sum, residual_m) in cell.squares_m2.iter_mut().zip(residuals_m) {
            *sum += cut_square_m2(residual_m, cut_m);
        }
    }

    /// Sizes of the differences of all cells that have one.
    pub(crate) fn sizes_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().filter_map(Both::difference_m).map(f64::abs)
    }

    /// Colours from the first's side, at `top_m`, to the second's.
    pub(crate) fn sides(&self, top_m: f64) -> Image {
        self.image(|cell| Some(1 + step(0.5 - 0.5 * cell.difference_m()? / top_m).min(STEPS - 1) as u8))
    }
}

/// Residuals count up to this, metres: the coarser scale by which places are judged.
pub(crate) const fn cut_m(scales: Scales) -> f64 {
    judged_by_m(scales)[1]
}

fn cut_square_m2(residual_m: f32, cut_m: f64) -> f64 {
    let cut_m = f64::from(residual_m).abs().min(cut_m);
    cut_m * cut_m
}

/// The round number above nearly all of the values (19 of 20), between `least` and `most`.
pub(crate) fn round_top(values: impl Iterator<Item = f64>, least: f64, most: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let at = values.len() * 19 / 20;
    let value = if values.is_empty() { least } else { *values.select_nth_unstable_by(at, f64::total_cmp).1 };
    let round = [0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 1.5, 2.0, 5.0, 10.0];
    round.into_iter().find(|round| *round >= value).unwrap_or(most).clamp(least, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(residual_m: Option<f32>, revisited: bool) -> SampledReturn {
        SampledReturn { from_sensor_m: [0.0; 3], direction: [0.0, 0.6, -0.8], residual_m, revisited }
    }

    #[test]
    fn cells_are_where_the_returns_are() {
        let way = [[4e5, 5e6, 3.0], [4e5 + 20.0, 5e6 + 10.0, 3.0]];
        let grid = Grid::around(way.into_iter(), Scales::Drive);
        let expected = Grid { cell_m: 0.5, corner_m: [4e5 - 50.0, 5e6 - 50.0], columns: 240, rows: 220 };
        assert_eq!(grid, expected);
        let mut ground = Ground::new(grid, Scales::Drive);
        for (residual_m, revisited) in [(Some(0.3), true), (Some(-0.5), true), (None, false)] {
            ground.add([4e5 + 0.2, 5e6 + 0.7], &at(residual_m, revisited));
        }
        ground.add([4e5 + 9.1, 5e6], &at(Some(0.1), false));
        ground.add([4e5 + 900.0, 5e6], &at(Some(0.1), false));
        let rms: Vec<f64> = ground.rms_of_cells().collect();
        assert!(
            (rms[0] - 0.17_f64.sqrt()).abs() < 1e-6 && rms.len() == 1,
            "a return alone says nothing: {rms:?}"
        );
        let (column, row) = (100, 220 - 1 - 101);
        assert_eq!(ground.residuals(0.5).get(column, row), 1 + step(0.17_f64.sqrt() / 0.5) as u8);
        assert_eq!(ground.coverage().get(column, row), 1);
        assert_eq!(ground.residuals(0.5).get(column, row - 1), 0);
    }

    #[test]
    fn margins_are_left_out() {
        let grid = Grid { cell_m: 2.0, corner_m: [10.0, 20.0], columns: 7, rows: 5 };
        let mut ground = Ground::new(grid, Scales::Drive);
        for at_m in [[15.0, 23.0], [15.5, 23.5], [19.0, 27.0], [19.0, 27.0], [10.0, 20.0]] {
            ground.add(at_m, &at(Some(0.2), true));
        }
        let before = ground.coverage();
        let trimmed = ground.trimmed();
        assert_eq!(trimmed.grid, Grid { cell_m: 2.0, corner_m: [14.0, 22.0], columns: 3, rows: 3 });
        let after = trimmed.coverage();
        for (column, row) in [(0, 0), (0, 2), (2, 0), (1, 1)] {
            assert_eq!(after.get(column, row), before.get(column + 2, row + 1), "{column} {row}");
        }
        assert_eq!((after.get(0, 2), after.get(2, 0)), (1, 1));
        assert_eq!(Ground::new(grid, Scales::Drive).trimmed().grid.columns, 0);
    }

    #[test]
    fn differences_have_sides() {
        let grid = Grid { cell_m: 1.0, corner_m: [0.0; 2], columns: 3, rows: 1 };
        let mut difference = Difference::new(grid, Scales::Drive);
        for (x, residuals_m) in [(0.5, [0.1, -5.0]), (1.5, [0.2, -0.2]), (2.5, [1.0, 0.0])] {
            difference.add([x, 0.5], residuals_m);
            difference.add([x, 0.5], residuals_m);
        }
        let image = difference.sides(0.5);
        assert_eq!([0, 1, 2].map(|column| image.get(column, 0)), [1, 8, 15], "first, neither, second");
        let sizes: Vec<f64> = difference.sizes_m().collect();
        assert!(
            (sizes[0] - 1.9).abs() < 1e-6 && sizes[1].abs() < 1e-6 && (sizes[2] - 1.0).abs() < 1e-6,
            "{sizes:?}"
        );
    }

    #[test]
    fn long_ways_have_large_cells_and_no_way_has_none() {
        let edge_m = |length_m: f64| {
            Grid::around([[0.0; 3], [length_m, 300.0, 0.0]].into_iter(), Scales::Drive).cell_m
        };
        assert_eq!([100.0, 350.0, 19_000.0, 1e6].map(edge_m), [1.0, 2.0, 50.0, 2501.0]);
        let walk = [[0.0; 3], [10.0, 30.0, 0.0]];
        let room = Grid::around(walk.into_iter(), Scales::Room);
        assert!((room.cell_m - 0.1).abs() < 1e-12 && (room.corner_m[0] + 5.0).abs() < 1e-9, "{room:?}");
        let none = Grid::around([].into_iter(), Scales::Drive);
        assert_eq!((none.columns, Ground::new(none, Scales::Drive).coverage().width), (0, 0));
    }

    #[test]
    fn tops_are_round() {
        assert_eq!(round_top((0..100).map(|k| f64::from(k) / 100.0), 0.1, 2.0), 1.0);
        assert_eq!(round_top([0.01; 50].into_iter(), 0.1, 2.0), 0.1);
        assert_eq!(round_top([].into_iter(), 0.1, 2.0), 0.1);
        assert_eq!(round_top([77.0; 5].into_iter(), 0.1, 2.0), 2.0);
    }
}
