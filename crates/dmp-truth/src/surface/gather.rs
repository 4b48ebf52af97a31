//! Sorts both sides of a comparison into tiles on disk.

use dmp_disk::{TileBuckets, TileId};
use dmp_map::TriangleSampler;
use dmp_sensor::{Isometry3, Point3};

use super::grid::{Grid, SLACK_M, in_world};
use super::{EvaluatedCounts, Extent, ReferenceCounts, SurfaceError, SurfaceSettings, Triangle};

/// Share of the memory that each of the buckets may take before it goes to disk.
const BUCKET_SHARE: f64 = 1.0 / 16.0;
/// Most samples of a mesh.
const MAX_SAMPLES: u64 = 1 << 32;

pub(super) type PointBuckets = TileBuckets<[f64; 3]>;

/// Points sorted into the tiles they belong to, and into those over whose border they may be nearest.
#[derive(Debug)]
pub(super) struct SortedPoints {
    pub(super) own: PointBuckets,
    pub(super) borders: PointBuckets,
}

fn budget_bytes(settings: &SurfaceSettings) -> usize {
    (BUCKET_SHARE * settings.memory() as f64) as usize
}

impl SortedPoints {
    fn new(settings: &SurfaceSettings) -> Result<Self, SurfaceError> {
        let new = || PointBuckets::new(budget_bytes(settings), &settings.work_folder);
        Ok(Self { own: new()?, borders: new()? })
    }

    fn add_over_borders(&mut self, grid: &Grid, home: TileId, point: [f64; 3]) -> Result<(), SurfaceError> {
        for tile in grid.reach(&Extent { low_m: point, high_m: point }).tiles() {
            if tile != home {
                self.borders.add(tile, point)?;
            }
        }
        Ok(())
    }

    pub(super) fn is_empty(&self, tile: TileId) -> bool {
        self.own.count(tile) + self.borders.count(tile) == 0
    }
}

/// The points of a map, sorted into tiles of the reference's world.
#[derive(Debug)]
pub struct EvaluatedPoints {
    pub(super) settings: SurfaceSettings,
    pub(super) grid: Grid,
    pub(super) sorted: SortedPoints,
    pub(super) counts: EvaluatedCounts,
    reference_from_map: Isometry3<f64>,
}

impl EvaluatedPoints {
    /// Nothing yet; `reference_from_map` moves every point into the reference's frame.
    ///
    /// # Errors
    /// When a setting makes no sense, or the scratch files cannot be made.
    pub fn new(settings: &SurfaceSettings, reference_from_map: Isometry3<f64>) -> Result<Self, SurfaceError> {
        settings.check()?;
        Ok(Self {
            grid: Grid::new(settings.tile_edge_m, settings.cap_m, settings.thin_m),
            sorted: SortedPoints::new(settings)?,
            counts: EvaluatedCounts { points: 0, dropped: 0, extent: Extent::NONE },
            settings: settings.clone(),
            reference_from_map,
        })
    }

    /// Adds points in the map's frame, metres. What is not finite, or beyond ±5e7 m once it is moved, is
    /// excluded and counted.
    ///
    /// # Errors
    /// When a scratch file cannot be written.
    pub fn add(&mut self, points_in_map_m: &[[f64; 3]]) -> Result<(), SurfaceError> {
        for &point in points_in_map_m {
            let point: [f64; 3] = (self.reference_from_map * Point3::from(point)).coords.into();
            if !in_world(&point) {
                self.counts.dropped += 1;
                continue;
            }
            self.counts.points += 1;
            self.counts.extent.include(&point);
            let home = self.grid.tile_of(&point);
            self.sorted.own.add(home, point)?;
            self.sorted.add_over_borders(&self.grid, home, point)?;
        }
        Ok(())
    }

    /// All points are there: now comes the reference.
    ///
    /// # Errors
    /// When there was no point, or scratch files cannot be made.
    pub fn against_reference(self) -> Result<Reference, SurfaceError> {
        if self.counts.points == 0 {
            return Err(SurfaceError::EmptyMap { dropped: self.counts.dropped });
        }
        let settings = &self.settings;
        Ok(Reference {
            points: SortedPoints::new(settings)?,
            samples: PointBuckets::new(budget_bytes(settings), &settings.work_folder)?,
            triangles: TileBuckets::new(budget_bytes(settings), &settings.work_folder)?,
            unreached: 0,
            sampler: TriangleSampler::new(settings.spacing_m, MAX_SAMPLES),
            counts: ReferenceCounts {
                points: 0,
                triangles: 0,
                dropped: 0,
                area_m2: 0.0,
                samples: 0,
                extent: Extent::NONE,
            },
            evaluated: self,
        })
    }
}

/// The reference, sorted into tiles beside the evaluated points.
#[derive(Debug)]
pub struct Reference {
    pub(super) evaluated: EvaluatedPoints,
    pub(super) points: SortedPoints,
    pub(super) samples: PointBuckets,
    pub(super) triangles: TileBuckets<[f64; 9]>,
    /// Points and samples with no evaluated point anywhere near: they need not be sorted.
    pub(super) unreached: u64,
    sampler: TriangleSampler,
    pub(super) counts: ReferenceCounts,
}

impl Reference {
    /// Adds points in the reference's frame, metres. What is not finite or beyond ±5e7 m is excluded and
    /// counted.
    ///
    /// # Errors
    /// When a scratch file cannot be written.
    pub fn add_points(&mut self, points_m: &[[f64; 3]]) -> Result<(), SurfaceError> {
        let grid = self.evaluated.grid;
        for &point in points_m {
            if !in_world(&point) {
                self.counts.dropped += 1;
                continue;
            }
            self.counts.points += 1;
            self.counts.extent.include(&point);
            let home = grid.tile_of(&point);
            // To be reached, where the crop lets it; and to be measured to, where there is a point to be.
            if self.is_wanted(&point) {
                self.add_query(home, point, false)?;
            } else if self.evaluated.sorted.own.count(home) > 0 {
                self.points.borders.add(home, point)?;
            }
            for tile in grid.reach(&Extent { low_m: point, high_m: point }).tiles() {
                if tile != home && self.evaluated.sorted.own.count(tile) > 0 {
                    self.points.borders.add(tile, point)?;
                }
            }
        }
        Ok(())
    }

    /// Adds triangles in the reference's frame, metres: distances are to their surface, completeness is
    /// that of samples on them. Those with a corner that is not finite or beyond ±5e7 m are excluded and
    /// counted; those without area are the segments or points that they are.
    ///
    /// # Errors
    /// When a scratch file cannot be written, or the area is too large for the spacing of the samples.
    pub fn add_triangles(&mut self, triangles_m: &[Triangle]) -> Result<(), SurfaceError> {
        for triangle in triangles_m {
            if !triangle.iter().all(in_world) {
                self.counts.dropped += 1;
                continue;
            }
            self.counts.triangles += 1;
            let mut extent = Extent::NONE;
            triangle.iter().for_each(|corner| extent.include(corner));
            triangle.iter().for_each(|corner| self.counts.extent.include(corner));
            self.sort_triangle(triangle, &extent)?;
            // The sampler is lent out while its samples are sorted.
            let mut sampler = std::mem::replace(&mut self.sampler, TriangleSampler::new(1.0, 0));
            let sampled = sampler.sample(triangle, |sample| {
                if self.is_wanted(&sample) {
                    self.counts.samples += 1;
                    self.add_query(self.evaluated.grid.tile_of(&sample), sample, true)?;
                }
                Ok::<(), SurfaceError>(())
            });
            self.sampler = sampler;
            sampled?;
        }
        self.counts.area_m2 = self.sampler.area_m2();
        Ok(())
    }

    /// Puts a triangle into every tile with evaluated points that it may be nearest to. A large one goes
    /// by the tiles that there are, not by those that it covers.
    fn sort_triangle(&mut self, triangle: &Triangle, extent: &Extent) -> Result<(), SurfaceError> {
        let record = *triangle.as_flattened().first_chunk::<9>().unwrap_or(&[0.0; 9]);
        let (range, occupied) = (self.evaluated.grid.reach(extent), &self.evaluated.sorted.own);
        if range.count() <= occupied.tile_count() as u64 {
            for tile in range.tiles().filter(|&tile| occupied.count(tile) > 0) {
                self.triangles.add(tile, record)?;
            }
        } else {
            for tile in occupied.tiles().into_iter().filter(|&tile| range.contains(tile)) {
                self.triangles.add(tile, record)?;
            }
        }
        Ok(())
    }

    fn is_wanted(&self, point: &[f64; 3]) -> bool {
        let settings = &self.evaluated.settings;
        !settings.crop || self.evaluated.counts.extent.reaches(point, settings.cap_m)
    }

    fn add_query(&mut self, home: TileId, point: [f64; 3], sample: bool) -> Result<(), SurfaceError> {
        let EvaluatedPoints { settings, sorted, counts, .. } = &self.evaluated;
        let reach_m = settings.cap_m + SLACK_M;
        // Thinned, it may share its voxel with others and must be seen beside them.
        if settings.thin_m.is_none() && (sorted.is_empty(home) || !counts.extent.reaches(&point, reach_m)) {
            self.unreached += 1;
            return Ok(());
        }
        let bucket = if sample { &mut self.samples } else { &mut self.points.own };
        Ok(bucket.add(home, point)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner of a mesh that is kilometres too high makes more samples than a disk holds.
    #[test]
    fn samples_that_no_point_is_near_are_counted_and_not_kept() {
        let mut map = EvaluatedPoints::new(&SurfaceSettings::default(), Isometry3::identity()).unwrap();
        map.add(&[[1.0, 1.0, 0.0]]).unwrap();
        let mut reference = map.against_reference().unwrap();
        reference.add_triangles(&[[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 2_900.0]]]).unwrap();
        let home = reference.evaluated.grid.tile_of(&[1.0, 1.0, 0.0]);
        let kept = reference.samples.count(home);
        assert!((1..1_000).contains(&kept), "{kept} of {}", reference.counts.samples);
        assert_eq!(reference.unreached + kept, reference.counts.samples);
    }
}
