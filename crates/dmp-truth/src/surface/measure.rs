//! Measures tile by tile, in parallel.

use std::collections::HashMap;

use dmp_disk::{TileBuckets, TileId};
use rayon::prelude::*;

use super::gather::{PointBuckets, Reference};
use super::grid::{Cell, Grid};
use super::report::at_thresholds;
use super::tally::Tally;
use super::targets::Targets;
use super::{Extent, SurfaceError, SurfaceReport, Triangle};

/// Share of the memory that the indices of all threads may take.
const INDEX_SHARE: f64 = 0.5;
/// Bytes that a point being thinned takes, at most.
const THIN_BYTES: u64 = 128;

/// Somebody who follows a measurement; called from several threads at once. `()` watches nothing.
pub trait SurfaceWatch: Sync {
    /// Measuring begins: the number of points of both sides.
    fn begin(&self, points: u64) {
        let _ = points;
    }

    /// So many more are done.
    fn advance(&self, points: u64) {
        let _ = points;
    }

    /// Whether to stop: asked before every tile. The measurement ends with [`SurfaceError::Cancelled`].
    fn cancelled(&self) -> bool {
        false
    }
}

impl SurfaceWatch for () {}

impl Reference {
    /// Measures both sides against each other, tile by tile.
    ///
    /// # Errors
    /// When there is no reference, when nothing of the map lies within the cap of it, or the scratch
    /// files cannot be read.
    pub fn measure(self, watch: &dyn SurfaceWatch) -> Result<SurfaceReport, SurfaceError> {
        let (counts, evaluated) = (self.counts, &self.evaluated);
        if counts.points + counts.triangles == 0 {
            return Err(SurfaceError::EmptyReference { dropped: counts.dropped });
        }
        let settings = &evaluated.settings;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build();
        let pool = pool.map_err(|source| SurfaceError::Threads { threads: settings.threads, source })?;
        let share_bytes = (INDEX_SHARE * settings.memory() as f64) as u64 / settings.threads as u64;
        let (to_reference, to_map) = (Tally::new(settings), Tally::new(settings));
        let side = |queries, points, triangles, tally| Side {
            grid: evaluated.grid,
            share_bytes,
            queries,
            points,
            triangles,
            tally,
            watch,
        };
        let reference_points = [&self.points.own, &self.points.borders];
        let map_points = [&evaluated.sorted.own, &evaluated.sorted.borders];
        let accuracy =
            side(vec![&evaluated.sorted.own], reference_points, Some(&self.triangles), &to_reference);
        let completeness = side(vec![&self.points.own, &self.samples], map_points, None, &to_map);

        watch.begin(accuracy.total() + completeness.total());
        pool.install(|| accuracy.measure().and_then(|()| completeness.measure()))?;
        let mut unreached = to_map.sums();
        to_map.add_beyond(&mut unreached, self.unreached);
        to_map.merge(&unreached);

        let near = to_reference.distances().filter(|distances| distances.beyond_cap < distances.count);
        let accuracy = near.ok_or(SurfaceError::NoOverlap {
            cap_m: settings.cap_m,
            map: evaluated.counts.extent,
            reference: counts.extent,
        })?;
        let completeness = to_map.distances();
        let scratch_bytes = [&evaluated.sorted.own, &evaluated.sorted.borders, &self.samples]
            .iter()
            .chain(&reference_points)
            .map(|buckets| buckets.scratch_bytes())
            .sum::<u64>()
            + self.triangles.scratch_bytes();
        Ok(SurfaceReport {
            chamfer_m: completeness.as_ref().map(|back| 0.5 * (accuracy.mean_m + back.mean_m)),
            thresholds: at_thresholds(&settings.thresholds_m, &accuracy, completeness.as_ref()),
            accuracy,
            completeness,
            evaluated: evaluated.counts,
            reference: counts,
            resolution_m: to_reference.resolution_m(),
            scratch_bytes,
        })
    }
}

/// One direction: from queries to targets.
struct Side<'a> {
    grid: Grid,
    share_bytes: u64,
    queries: Vec<&'a PointBuckets>,
    points: [&'a PointBuckets; 2],
    triangles: Option<&'a TileBuckets<[f64; 9]>>,
    tally: &'a Tally,
    watch: &'a dyn SurfaceWatch,
}

impl Side<'_> {
    fn tiles(&self) -> Vec<TileId> {
        let mut tiles: Vec<TileId> = self.queries.iter().flat_map(|buckets| buckets.tiles()).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    fn queries_in(&self, tile: TileId) -> u64 {
        self.queries.iter().map(|buckets| buckets.count(tile)).sum()
    }

    fn total(&self) -> u64 {
        self.tiles().into_iter().map(|tile| self.queries_in(tile)).sum()
    }

    fn measure(&self) -> Result<(), SurfaceError> {
        let mut tiles = self.tiles();
        // The fullest first, so that no thread is left alone with one at the end.
        tiles.sort_by_key(|&tile| (std::cmp::Reverse(self.queries_in(tile)), tile));
        tiles.par_iter().with_max_len(1).try_for_each(|&tile| {
            if self.watch.cancelled() {
                return Err(SurfaceError::Cancelled);
            }
            self.measure_cell(&self.grid.cell(tile))?;
            self.watch.advance(self.queries_in(tile));
            Ok(())
        })
    }

    /// Measures the queries of a cell; in quarters where its index would take more than a thread's share.
    fn measure_cell(&self, cell: &Cell) -> Result<(), SurfaceError> {
        if self.bytes_of(cell)? > self.share_bytes
            && let Some(quarters) = cell.quarters(self.grid.margin_m)
        {
            return quarters.iter().try_for_each(|quarter| self.measure_cell(quarter));
        }
        let targets = self.targets_of(cell)?;
        let (mut sums, mut voxels) = (self.tally.sums(), HashMap::<[i64; 3], (f64, [f64; 3])>::new());
        self.each_query(cell, |point| {
            match self.grid.voxel(point) {
                None => self.tally.add(&mut sums, targets.nearest(point)),
                // Of a voxel's points the one nearest to its centre counts, whatever their order.
                Some((voxel, off2)) => {
                    let kept = voxels.entry(voxel).or_insert((off2, *point));
                    let order = off2.total_cmp(&kept.0);
                    let order = point.iter().zip(&kept.1).fold(order, |o, (a, b)| o.then(a.total_cmp(b)));
                    if order.is_lt() {
                        *kept = (off2, *point);
                    }
                }
            }
        })?;
        for (_, point) in voxels.values() {
            self.tally.add(&mut sums, targets.nearest(point));
        }
        self.tally.merge(&sums);
        Ok(())
    }

    fn each_query(&self, cell: &Cell, mut each: impl FnMut(&[f64; 3])) -> Result<(), SurfaceError> {
        for buckets in &self.queries {
            buckets.read(cell.tile, |point| {
                if cell.owns(self.grid.key(point)) {
                    each(point);
                }
                Ok::<(), SurfaceError>(())
            })?;
        }
        Ok(())
    }

    fn each_target(
        &self,
        cell: &Cell,
        mut each_point: impl FnMut(&[f64; 3]),
        mut each_triangle: impl FnMut(Triangle),
    ) -> Result<(), SurfaceError> {
        for buckets in self.points {
            buckets.read(cell.tile, |point| {
                if cell.is_reached_by(&Extent { low_m: *point, high_m: *point }, self.grid.margin_m) {
                    each_point(point);
                }
                Ok::<(), SurfaceError>(())
            })?;
        }
        let Some(triangles) = self.triangles else { return Ok(()) };
        triangles.read(cell.tile, |&[ax, ay, az, bx, by, bz, cx, cy, cz]| {
            let triangle = [[ax, ay, az], [bx, by, bz], [cx, cy, cz]];
            let mut extent = Extent::NONE;
            triangle.iter().for_each(|corner| extent.include(corner));
            if cell.is_reached_by(&extent, self.grid.margin_m) {
                each_triangle(triangle);
            }
            Ok::<(), SurfaceError>(())
        })
    }

    fn targets_of(&self, cell: &Cell) -> Result<Targets, SurfaceError> {
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        self.each_target(cell, |point| points.push(*point), |triangle| triangles.push(triangle))?;
        Ok(Targets::new(points, triangles))
    }

    /// What measuring the cell takes, bytes: from the counts of a whole tile; a part is counted out.
    fn bytes_of(&self, cell: &Cell) -> Result<u64, SurfaceError> {
        let (mut queries, mut points, mut triangles) = (0, 0, 0);
        if cell.whole {
            queries = self.queries_in(cell.tile);
            points = self.points.iter().map(|buckets| buckets.count(cell.tile)).sum();
            triangles = self.triangles.map_or(0, |buckets| buckets.count(cell.tile));
        } else {
            self.each_query(cell, |_| queries += 1)?;
            self.each_target(cell, |_| points += 1, |_| triangles += 1)?;
        }
        let thinned = if self.grid.thins() { queries } else { 0 };
        Ok(points * Targets::POINT_BYTES + triangles * Targets::TRIANGLE_BYTES + thinned * THIN_BYTES)
    }
}
