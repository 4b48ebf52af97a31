//! Predicts when each tile of every map is needed.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use dmp_map::{Store, TileEntry, TileId, TileSource};
use dmp_runs::RunPoses;

use crate::passes::plan::Plan;

/// Distance that a sensor travels before the tiles within its reach are updated, metres.
const STEP_M: f64 = 2.0;
/// Approximate memory of a surfel in a tile ready for casting, bytes: docs/performance.md.
pub(crate) const SURFEL_BYTES: u64 = 60;

/// A tile of a run's map.
pub(crate) type RunTile = (usize, TileId);

/// When each tile of every run's map is within the sensor's reach: known before a ray is cast, since the
/// trajectories are. Time counts in jobs, in reading order.
#[derive(Debug)]
pub(crate) struct Schedule {
    /// For each tile the first and last job of each visit.
    visits: HashMap<RunTile, Vec<(u32, u32)>>,
    /// For each job the tiles whose visit begins with it.
    begin: Vec<Vec<RunTile>>,
    /// Peak bytes of tiles in reach.
    bytes_in_reach: u64,
    now: AtomicUsize,
}

impl Schedule {
    /// The schedule of `jobs`, each with ordinals of planned frames, for a sensor with range `reach_m`.
    /// `runs` are the sensor's poses and the map, for each run. `O(frames · tiles in reach)` time at worst,
    /// memory by the number of visits.
    pub(crate) fn new<'a>(
        plan: &Plan,
        runs: &[(&RunPoses, &Store)],
        jobs: impl Iterator<Item = &'a Vec<usize>>,
        reach_m: f64,
    ) -> Self {
        let mut schedule = Self::empty();
        let mut near: Vec<Near> = runs.iter().map(|_| Near::default()).collect();
        for (job, ordinals) in jobs.enumerate() {
            schedule.begin.push(Vec::new());
            for ordinal in ordinals {
                let frame = &plan.frames()[*ordinal];
                for (number, (near, (poses, map))) in near.iter_mut().zip(runs).enumerate() {
                    let Some(pose) = poses.of_frame(frame) else { continue };
                    let place = pose.translation.vector;
                    let renewed = near.move_to([place.x, place.y], *map, reach_m);
                    if renewed || near.job != Some(job) {
                        near.job = Some(job);
                        near.tiles.iter().for_each(|&tile| schedule.visit((number, tile), job));
                    }
                    if renewed {
                        let surfels = |tile| map.entry(tile).map_or(0, TileEntry::surfels);
                        near.bytes = near.tiles.iter().map(|&tile| surfels(tile) * SURFEL_BYTES).sum();
                    }
                }
                let bytes = near.iter().map(|near| near.bytes).sum();
                schedule.bytes_in_reach = schedule.bytes_in_reach.max(bytes);
            }
        }
        schedule
    }

    fn empty() -> Self {
        Self { visits: HashMap::new(), begin: Vec::new(), bytes_in_reach: 0, now: AtomicUsize::new(0) }
    }

    fn visit(&mut self, tile: RunTile, job: usize) {
        let visits = self.visits.entry(tile).or_default();
        let now = job as u32;
        match visits.last_mut() {
            Some((_, last)) if *last + 1 >= now => *last = now,
            _ => {
                visits.push((now, now));
                self.begin[job].push(tile);
            }
        }
    }

    /// The tiles that come into reach with a job.
    pub(crate) fn begin(&self, job: usize) -> &[RunTile] {
        self.begin.get(job).map_or(&[], Vec::as_slice)
    }

    /// Sets the oldest job still at work.
    pub(crate) fn move_to(&self, job: usize) {
        self.now.fetch_max(job, Ordering::Relaxed);
    }

    /// Number of jobs until a tile is next in reach: 0 if it is now, the largest number if never again.
    pub(crate) fn next_use(&self, tile: &RunTile) -> u64 {
        let now = self.now.load(Ordering::Relaxed) as u32;
        let Some(visits) = self.visits.get(tile) else { return u64::MAX };
        let next = visits.partition_point(|&(_, last)| last < now);
        visits.get(next).map_or(u64::MAX, |&(first, _)| u64::from(first.saturating_sub(now)))
    }

    /// Peak bytes of tiles in reach, ready for casting, over all runs.
    pub(crate) fn bytes_in_reach(&self) -> u64 {
        self.bytes_in_reach
    }

    /// Number of tiles ever in reach in the first `jobs` jobs, and number of visits.
    pub(crate) fn tiles_and_visits(&self, jobs: usize) -> (u64, u64) {
        let is_met =
            |visits: &&Vec<(u32, u32)>| visits.first().is_some_and(|&(first, _)| (first as usize) < jobs);
        let tiles = self.visits.values().filter(is_met).count() as u64;
        (tiles, self.begin.iter().take(jobs).map(|tiles| tiles.len() as u64).sum())
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// The tiles around one run's sensor.
#[derive(Debug, Default)]
struct Near {
    place: Option<[f64; 2]>,
    tiles: Vec<TileId>,
    bytes: u64,
    job: Option<usize>,
}

impl Near {
    /// Updates the tiles if the sensor moved far enough; returns whether it did.
    fn move_to(&mut self, place: [f64; 2], map: &dyn TileSource, reach_m: f64) -> bool {
        let [x, y] = place;
        if self.place.is_some_and(|[x0, y0]| square(x - x0) + square(y - y0) < square(STEP_M)) {
            return false;
        }
        self.place = Some(place);
        self.tiles.clear();
        let (edge_m, reach_m) = (map.tile_edge_m(), reach_m + STEP_M);
        let Some([low, high]) = map.tile_bounds() else { return true };
        let range = |c: f64, low: i32, high: i32| {
            let column = |c: f64| (c / edge_m).floor() as i32;
            column(c - reach_m).max(low)..=column(c + reach_m).min(high)
        };
        for ty in range(y, low.y, high.y) {
            for tx in range(x, low.x, high.x) {
                let tile = TileId { x: tx, y: ty };
                // From the nearest point of the tile.
                let apart =
                    |c: f64, t: i32| (f64::from(t) * edge_m - c).max(c - f64::from(t + 1) * edge_m).max(0.0);
                if square(apart(x, tx)) + square(apart(y, ty)) <= square(reach_m)
                    && map.tile_extent(tile).is_some()
                {
                    self.tiles.push(tile);
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use dmp_map::{LooseSurfels, WorldSurfel};

    use super::*;

    fn street() -> LooseSurfels {
        let surfel = |k: i32| WorldSurfel {
            centre_in_world_m: [f64::from(k) * 10.0 + 5.0, 5.0, 0.0],
            normal: [0.0, 0.0, 1.0],
            third_lowest: 0,
            third_highest: 0,
        };
        LooseSurfels::new(10.0, 0.4, (0..100).map(surfel)).unwrap()
    }

    #[test]
    fn a_sensor_sees_the_tiles_around_it() {
        let (map, mut near) = (street(), Near::default());
        assert!(near.move_to([505.0, 5.0], &map, 20.0));
        let columns: Vec<i32> = near.tiles.iter().map(|tile| tile.x).collect();
        assert_eq!(columns, [48, 49, 50, 51, 52]);
        assert!(!near.move_to([506.0, 5.0], &map, 20.0), "it went less than a step");
        assert!(near.move_to([505.0, 105.0], &map, 20.0) && near.tiles.is_empty());
    }

    #[test]
    fn visits_end_and_begin_again() {
        let tile = |x: i32| (0, TileId { x, y: 0 });
        let mut schedule = Schedule::empty();
        schedule.begin.resize(10, Vec::new());
        for (x, jobs) in [(1, &[0usize, 1, 2, 7, 8][..]), (2, &[4])] {
            jobs.iter().for_each(|&job| schedule.visit(tile(x), job));
        }
        assert_eq!(schedule.tiles_and_visits(10), (2, 3));
        assert_eq!(
            (schedule.begin(0), schedule.begin(7), schedule.begin(3)),
            (&[tile(1)][..], &[tile(1)][..], &[][..])
        );
        let next = |now: usize| {
            schedule.move_to(now);
            [1, 2, 3].map(|x| schedule.next_use(&tile(x)))
        };
        assert_eq!(next(1), [0, 3, u64::MAX]);
        assert_eq!(next(3), [4, 1, u64::MAX]);
        assert_eq!(next(5), [2, u64::MAX, u64::MAX]);
        assert_eq!(next(9), [u64::MAX; 3]);
    }
}
