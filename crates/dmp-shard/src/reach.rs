//! The tiles that the rays of some scans may hit.

use std::collections::BTreeMap;

use dmp::PlannedScore;
use dmp_map::{TileId, TileSpan};
use dmp_reduce::FrameSet;

/// For every row of tiles the first and last column in reach.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Reach(BTreeMap<i32, (i32, i32)>);

impl Reach {
    /// Of the rays of a run from the sensor's positions in some frames, plus a tile around: the sensor moves during a scan.
    pub(super) fn of(planned: &PlannedScore<'_>, run: usize, frames: &FrameSet, edge_m: f64) -> Self {
        let mut reach = Self::default();
        let steps = (planned.horizon_m() / edge_m).ceil() as i32 + 1;
        let tile = |metres: f64| (metres / edge_m).floor() as i32;
        let mut last = None;
        for [x, y, _] in frames.iter().filter_map(|scan| planned.position_m(run, scan)) {
            let [x, y] = [x, y].map(tile);
            if last.replace((x, y)) != Some((x, y)) {
                reach.add(x, y, steps);
            }
        }
        reach
    }

    fn add(&mut self, x: i32, y: i32, steps: i32) {
        let (low, high) = (x.saturating_sub(steps), x.saturating_add(steps));
        for row in y.saturating_sub(steps)..=y.saturating_add(steps) {
            let columns = self.0.entry(row).or_insert((low, high));
            *columns = (columns.0.min(low), columns.1.max(high));
        }
    }

    /// Whether it has a tile in common with a span.
    pub(super) fn meets(&self, span: &TileSpan) -> bool {
        self.0.iter().any(|(&y, &(low, high))| {
            let (first, last) = (TileId { y, x: low }, TileId { y, x: high });
            span.from.is_none_or(|from| from <= last) && span.to.is_none_or(|to| first < to)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_reach_is_known_by_rows() {
        let mut reach = Reach::default();
        reach.add(0, 0, 2);
        reach.add(5, 1, 2);
        assert_eq!(reach.0.get(&-2), Some(&(-2, 2)));
        assert_eq!(reach.0.get(&0), Some(&(-2, 7)));
        assert_eq!(reach.0.get(&3), Some(&(3, 7)));
        let span = |from: (i32, i32), to: (i32, i32)| {
            let tile = |(y, x)| Some(TileId { y, x });
            TileSpan { from: tile(from), to: tile(to) }
        };
        assert!(reach.meets(&TileSpan::default()));
        assert!(reach.meets(&span((3, 7), (3, 8))) && !reach.meets(&span((3, 8), (9, 9))));
        assert!(reach.meets(&span((-9, 0), (-2, -1))) && !reach.meets(&span((-9, 0), (-2, -2))));
    }
}
