//! The square tiles that points are sorted into, and what reaches over their borders.

use dmp_map::TileId;

use super::Extent;

/// Coordinates beyond this are excluded, metres: tile numbers must fit.
const WORLD_LIMIT_M: f64 = 5e7;
/// Added to the reach of a tile, metres: far more than the rounding of any coordinate in the world.
pub(super) const SLACK_M: f64 = 1e-3;

pub(super) fn in_world(point: &[f64; 3]) -> bool {
    // False for NaN.
    point.iter().all(|c| c.abs() <= WORLD_LIMIT_M)
}

/// Columns of the world, square in x and y, and the voxels of which one point counts.
#[expect(clippy::struct_field_names, reason = "lengths carry their unit")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    edge_m: f64,
    /// How far from a tile something can lie and still be nearest to one of its points.
    pub(super) margin_m: f64,
    thin_m: Option<f64>,
}

/// Columns and rows, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TileRange {
    low: TileId,
    high: TileId,
}

impl TileRange {
    pub(super) fn count(&self) -> u64 {
        let side = |low: i32, high: i32| (i64::from(high) - i64::from(low) + 1) as u64;
        side(self.low.x, self.high.x).saturating_mul(side(self.low.y, self.high.y))
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileId> + use<> {
        let Self { low, high } = *self;
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| TileId { y, x }))
    }

    pub(super) fn contains(&self, tile: TileId) -> bool {
        (self.low.x..=self.high.x).contains(&tile.x) && (self.low.y..=self.high.y).contains(&tile.y)
    }
}

impl Grid {
    pub(super) fn new(edge_m: f64, cap_m: f64, thin_m: Option<f64>) -> Self {
        let margin_m = cap_m + thin_m.unwrap_or(0.0) + SLACK_M;
        // Copies over borders stay the smaller part.
        Self { edge_m: edge_m.max(8.0 * margin_m), margin_m, thin_m }
    }

    pub(super) fn thins(&self) -> bool {
        self.thin_m.is_some()
    }

    /// The voxel that a point thins out with, and its squared distance from the voxel's centre.
    pub(super) fn voxel(&self, point: &[f64; 3]) -> Option<([i64; 3], f64)> {
        let thin_m = self.thin_m?;
        let voxel = point.map(|c| (c / thin_m).floor() as i64);
        let off: [f64; 3] = std::array::from_fn(|k| point[k] - (voxel[k] as f64 + 0.5) * thin_m);
        Some((voxel, off.iter().map(|d| d * d).sum()))
    }

    /// The place in x and y that decides which tile a point belongs to: the centre of its voxel, so that
    /// no voxel is cut in two.
    pub(super) fn key(&self, point: &[f64; 3]) -> [f64; 2] {
        match (self.voxel(point), self.thin_m) {
            (Some((voxel, _)), Some(thin_m)) => {
                [(voxel[0] as f64 + 0.5) * thin_m, (voxel[1] as f64 + 0.5) * thin_m]
            }
            _ => [point[0], point[1]],
        }
    }

    /// The tile that a point of the world belongs to.
    pub(super) fn tile_of(&self, point: &[f64; 3]) -> TileId {
        let [x, y] = self.key(point);
        TileId { x: self.index(x), y: self.index(y) }
    }

    fn index(&self, c: f64) -> i32 {
        (c / self.edge_m).floor() as i32
    }

    /// The tiles that something with this extent may be nearest in.
    pub(super) fn reach(&self, extent: &Extent) -> TileRange {
        let index = |c: f64| self.index(c);
        let [low, high] = [extent.low_m.map(|c| c - self.margin_m), extent.high_m.map(|c| c + self.margin_m)];
        TileRange {
            low: TileId { x: index(low[0]), y: index(low[1]) },
            high: TileId { x: index(high[0]), y: index(high[1]) },
        }
    }

    /// The whole of a tile.
    pub(super) fn cell(&self, tile: TileId) -> Cell {
        // A little more: which points are in a tile was decided by division, and the product may round the
        // other way.
        let corner = [f64::from(tile.x) * self.edge_m, f64::from(tile.y) * self.edge_m];
        let (low, high) = (corner.map(|c| c - SLACK_M), corner.map(|c| c + self.edge_m + SLACK_M));
        Cell { tile, low, high, whole: true }
    }
}

/// A tile, or a part of one that is too full to be measured at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    pub(super) tile: TileId,
    low: [f64; 2],
    high: [f64; 2],
    /// Whether it is the whole tile: then whatever is in the tile's buckets belongs to it.
    pub(super) whole: bool,
}

impl Cell {
    /// Whether a point with this key belongs to the cell.
    pub(super) fn owns(&self, key: [f64; 2]) -> bool {
        self.whole || (0..2).all(|k| self.low[k] <= key[k] && key[k] < self.high[k])
    }

    /// Whether something with this extent may be nearest to a point of the cell.
    pub(super) fn is_reached_by(&self, extent: &Extent, margin_m: f64) -> bool {
        let near = |k: usize| {
            extent.high_m[k] >= self.low[k] - margin_m && extent.low_m[k] <= self.high[k] + margin_m
        };
        self.whole || (near(0) && near(1))
    }

    /// Its four quarters; `None` where their borders would be most of them.
    pub(super) fn quarters(&self, margin_m: f64) -> Option<[Self; 4]> {
        if self.high[0] - self.low[0] < 2.0 * margin_m {
            return None;
        }
        let middle: [f64; 2] = std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]));
        Some([(0, 0), (0, 1), (1, 0), (1, 1)].map(|halves| {
            let span = |k: usize, half: i32| {
                if half == 0 { (self.low[k], middle[k]) } else { (middle[k], self.high[k]) }
            };
            let ((x0, x1), (y0, y1)) = (span(0, halves.0), span(1, halves.1));
            Self { tile: self.tile, low: [x0, y0], high: [x1, y1], whole: false }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_reached_from_its_own_tile_and_belongs_to_one_quarter() {
        for thin_m in [None, Some(0.3)] {
            let grid = Grid::new(16.0, 1.0, thin_m);
            for k in 0..2000 {
                let c = f64::from(k) * 0.0487 - 48.0;
                let point = [c + 4e6, 0.7 * c - 5e5, 0.1 * c];
                let mut extent = Extent::NONE;
                extent.include(&point);
                let tile = grid.tile_of(&point);
                assert!(grid.reach(&extent).contains(tile));
                assert!(grid.reach(&extent).tiles().count() as u64 == grid.reach(&extent).count());
                let quarters = grid.cell(tile).quarters(grid.margin_m).unwrap();
                let owners: Vec<_> = quarters.iter().filter(|q| q.owns(grid.key(&point))).collect();
                assert_eq!(owners.len(), 1, "{point:?}");
                assert!(owners[0].is_reached_by(&extent, grid.margin_m));
                let sixteenths = owners[0].quarters(grid.margin_m).unwrap();
                assert_eq!(sixteenths.iter().filter(|q| q.owns(grid.key(&point))).count(), 1);
            }
        }
    }

    #[test]
    fn borders_never_become_most_of_a_cell() {
        let grid = Grid::new(1.0, 1.0, None);
        let mut cell = grid.cell(TileId { x: 0, y: 0 });
        let mut depth = 0;
        while let Some([first, ..]) = cell.quarters(grid.margin_m) {
            (cell, depth) = (first, depth + 1);
        }
        assert_eq!(depth, 3);
    }
}
