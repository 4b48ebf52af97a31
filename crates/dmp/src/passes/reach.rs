//! The tiles near the path of a sensor, by rows.

use std::collections::BTreeMap;

use dmp_map::{TileId, TileSpan};

/// For every row of tiles the first and last column in reach.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TilesInReach(BTreeMap<i32, (i32, i32)>);

impl TilesInReach {
    /// The tiles of edge `edge_m` at most `steps` from those of some positions.
    pub(crate) fn of(positions_m: impl Iterator<Item = [f64; 2]>, steps: i32, edge_m: f64) -> Self {
        let mut reach = Self::default();
        let mut last = None;
        for position_m in positions_m {
            let at = tile_at(position_m, edge_m);
            if last.replace(at) != Some(at) {
                reach.add(at, steps);
            }
        }
        reach
    }

    fn add(&mut self, at: TileId, steps: i32) {
        for (y, low, high) in rows_around(at, steps) {
            let columns = self.0.entry(y).or_insert((low, high));
            *columns = (columns.0.min(low), columns.1.max(high));
        }
    }

    /// Whether it has a tile.
    pub(crate) fn contains(&self, tile: TileId) -> bool {
        self.0.get(&tile.y).is_some_and(|&(low, high)| (low..=high).contains(&tile.x))
    }

    /// Whether it has a tile at most `steps` from that of a position.
    pub(crate) fn is_near(&self, position_m: [f64; 2], steps: i32, edge_m: f64) -> bool {
        rows_around(tile_at(position_m, edge_m), steps)
            .any(|(y, from, to)| self.0.get(&y).is_some_and(|&(low, high)| low <= to && from <= high))
    }

    /// Whether it has a tile in common with a span.
    pub fn meets(&self, span: &TileSpan) -> bool {
        self.0.iter().any(|(&y, &(low, high))| {
            let (first, last) = (TileId { y, x: low }, TileId { y, x: high });
            span.from.is_none_or(|from| from <= last) && span.to.is_none_or(|to| first < to)
        })
    }
}

fn tile_at(position_m: [f64; 2], edge_m: f64) -> TileId {
    let [x, y] = position_m.map(|metres| (metres / edge_m).floor() as i32);
    TileId { y, x }
}

/// The rows around a tile, and their columns.
fn rows_around(at: TileId, steps: i32) -> impl Iterator<Item = (i32, i32, i32)> {
    let (low, high) = (at.x.saturating_sub(steps), at.x.saturating_add(steps));
    (at.y.saturating_sub(steps)..=at.y.saturating_add(steps)).map(move |y| (y, low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_reach_is_known_by_rows() {
        let reach = TilesInReach::of([[1.0, 9.0], [55.0, 11.0]].into_iter(), 2, 10.0);
        assert_eq!(reach.0.get(&-2), Some(&(-2, 2)));
        assert_eq!(reach.0.get(&0), Some(&(-2, 7)));
        assert_eq!(reach.0.get(&3), Some(&(3, 7)));
        let tile = |(y, x)| TileId { y, x };
        assert!(
            reach.contains(tile((3, 7))) && !reach.contains(tile((3, 8))) && !reach.contains(tile((4, 7)))
        );
        assert!(reach.is_near([95.0, 35.0], 2, 10.0) && !reach.is_near([105.0, 35.0], 2, 10.0));
        let span = |from, to| TileSpan { from: Some(tile(from)), to: Some(tile(to)) };
        assert!(reach.meets(&TileSpan::default()));
        assert!(reach.meets(&span((3, 7), (3, 8))) && !reach.meets(&span((3, 8), (9, 9))));
        assert!(reach.meets(&span((-9, 0), (-2, -1))) && !reach.meets(&span((-9, 0), (-2, -2))));
    }
}
