//! Counts what an evaluation must hold in memory: runs, poses, tiles with sums.

use std::collections::HashSet;

use dmp_map::Lattice;
use dmp_reduce::RunSums;
use dmp_runs::{EvaluateError, Means, Run, Settings};

/// Memory of a tile's sums: they are in a growing table.
pub(crate) const TILE_SUMS_BYTES: usize = 2 * (size_of::<RunSums>() + size_of::<[u64; 2]>());

/// What an evaluation holds beside the scans, allocated before the rest is shared out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) runs: usize,
    /// Number of its own poses, and of tiles with sums, of all runs together.
    pub(crate) poses: usize,
    pub(crate) tiles: usize,
}

impl Extent {
    /// For an evaluation of whole runs.
    ///
    /// # Errors
    /// When the voxel edge is invalid.
    pub(crate) fn of_runs(runs: &[Run], settings: &Settings, means: &Means) -> Result<Self, EvaluateError> {
        // Above this count there is no room anyway: the evaluation is rejected.
        let most = means.memory_bytes / TILE_SUMS_BYTES;
        let edge_m = least_tile_edge_m(settings)?;
        let tiles = |run: &Run| {
            let places = run.trajectory.poses().iter().map(|pose| [pose.translation.x, pose.translation.y]);
            tiles_in_reach(places, edge_m, settings.max_range_m, most)
        };
        Ok(Self {
            runs: runs.len(),
            poses: runs.iter().map(|run| run.trajectory.len()).sum(),
            tiles: runs.iter().map(tiles).sum(),
        })
    }
}

/// The edge of the smallest possible tiles.
fn least_tile_edge_m(settings: &Settings) -> Result<f64, EvaluateError> {
    let chosen = settings.scales.lengths().voxels_m.into_iter().fold(f64::INFINITY, f64::min);
    Ok(Lattice::new(settings.voxel_m.unwrap_or(chosen))?.tile_edge_m())
}

/// Upper bound for the tiles that returns from some positions lie in; counts up to `most` and a few.
fn tiles_in_reach(places_m: impl Iterator<Item = [f64; 2]>, edge_m: f64, reach_m: f64, most: usize) -> usize {
    let steps = (reach_m / edge_m).ceil() as i64;
    let mut tiles = HashSet::new();
    let mut last = None;
    for place in places_m {
        let [x, y] = place.map(|c| (c / edge_m).floor() as i64);
        if last.replace([x, y]) == Some([x, y]) {
            continue;
        }
        let columns = |x| (y.saturating_sub(steps)..=y.saturating_add(steps)).map(move |y| [x, y]);
        tiles.extend((x.saturating_sub(steps)..=x.saturating_add(steps)).flat_map(columns));
        if tiles.len() > most {
            break;
        }
    }
    tiles.len()
}

#[cfg(test)]
mod tests {
    use std::iter;

    use super::*;

    #[test]
    fn tiles_are_counted_around_the_way_and_no_further_than_there_is_room() {
        let along = |count: u32, step_m: f64| (0..count).map(move |k| [f64::from(k) * step_m, 3.0]);
        // A hundred metres either way are four tiles, at a place that is in one.
        assert_eq!(tiles_in_reach(along(1, 1.0), 32.0, 100.0, usize::MAX), 81);
        assert_eq!(tiles_in_reach(along(321, 1.0), 32.0, 100.0, usize::MAX), 9 * 19);
        assert_eq!(tiles_in_reach(along(1, 1.0), 32.0, 20.0, usize::MAX), 9);
        let scattered = tiles_in_reach(along(1_000_000, 1000.0), 32.0, 100.0, 5000);
        assert!((5000..5100).contains(&scattered), "{scattered}");
        assert!(tiles_in_reach(iter::once([1e300, -1e300]), 32.0, 100.0, 5000) > 0);
    }
}
