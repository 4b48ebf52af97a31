//! Scores of a map, as its patches lie and as they are moved.

use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Query};
use dmp_map::{MapError, PlacedPatches};
use dmp_reduce::{Residuals, Scales, SurfaceGroup};
use dmp_sensor::{Isometry3, Ray};
use rayon::prelude::*;

use super::build::{LoopMap, placement};
use super::changed::{Columns, Moved};
use super::rays::RayInPatch;
use super::sums::{MapScores, Sums};
use crate::LoopError;

/// Predictions are looked for up to this many times the largest range used, as in the whole score.
const HORIZON: f64 = 2.0;
/// Parts of a drive for each thread where several score one map.
const PARTS: usize = 4;
/// Rays that are cast together.
const BLOCK_RAYS: usize = 1 << 14;
/// What a map leaves of a ray: z − z' for the first crossing and for the nearest, metres; NaN where there is none.
#[derive(Debug, Clone, Copy)]
struct Left {
    first_m: f32,
    nearest_m: f32,
    /// Where the nearest crossing is, or the first, or the return.
    surface: SurfaceGroup,
}

impl Left {
    fn of(ray: &Ray, answer: &Answer, scales: Scales) -> Self {
        let predicted_m = answer.nearest_m.or(answer.first_m).unwrap_or(ray.range_m);
        let place_m = [0, 1, 2].map(|k| ray.origin_in_world[k] + predicted_m * ray.direction_in_world[k]);
        let residual =
            |range_m: Option<f64>| range_m.map_or(f32::NAN, |range_m| (ray.range_m - range_m) as f32);
        Self {
            first_m: residual(answer.first_m),
            nearest_m: residual(answer.nearest_m),
            surface: SurfaceGroup::of_place(place_m, scales),
        }
    }

    fn residuals(self) -> Residuals {
        let residual = |m: f32| (!m.is_nan()).then_some(f64::from(m));
        Residuals {
            first_m: residual(self.first_m),
            nearest_m: residual(self.nearest_m),
            surfaces: [self.surface; 2],
            ..Residuals::MISS
        }
    }
}

/// A map that others are compared with: where its patches lie, and what it leaves of each ray.
#[derive(Debug)]
pub(crate) struct Placed<'a> {
    map: &'a LoopMap,
    world_from_body: Vec<Isometry3<f64>>,
    /// By keyframe.
    left: Vec<Vec<Left>>,
    columns: Columns,
}

impl<'a> Placed<'a> {
    /// Casts all rays, of each keyframe on the next free thread.
    pub(crate) fn new(map: &'a LoopMap, world_from_body: Vec<Isometry3<f64>>) -> Result<Self, LoopError> {
        let caster = map.caster(&world_from_body, map.threads())?;
        let left = (0..world_from_body.len())
            .into_par_iter()
            .map_init(
                || Casting::new(map.scales),
                |casting, keyframe| {
                    let mut left = Vec::new();
                    casting.cast(&caster, &world_from_body[keyframe], map.rays[keyframe].all(), &mut left)?;
                    Ok(left)
                },
            )
            .collect::<Result<_, MapError>>()?;
        let columns = Columns::new(map, &world_from_body);
        Ok(Self { map, world_from_body, left, columns })
    }

    /// The score of this map itself.
    pub(crate) fn score(&self) -> Result<MapScores, LoopError> {
        let mut sums = self.map.sums();
        for (keyframe, left) in self.seen() {
            sums.enter(self.map.stretches[keyframe])?;
            left.iter().for_each(|left| sums.frame.add_return(&[left.residuals(); 2]));
        }
        sums.leave()?;
        Ok(MapScores { change: None, ..sums.score(1.0) })
    }

    /// The score of the map with its patches at `world_from_body`, whose places that did not change are as they were: by
    /// the thread that asks, or, where no other map is scored at the time, by all.
    pub(crate) fn moved_to(
        &self,
        world_from_body: &[Isometry3<f64>],
        by_all: bool,
    ) -> Result<MapScores, LoopError> {
        let map = self.map;
        let threads = if by_all { map.threads() } else { 1 };
        let caster = map.caster(world_from_body, threads)?;
        let moved = Moved::new(map, &self.world_from_body, &self.columns, world_from_body);
        let seen: Vec<(usize, &Vec<Left>)> = self.seen().collect();
        let stretches: Vec<_> = seen.chunk_by(|a, b| map.stretches[a.0] == map.stretches[b.0]).collect();
        let part = |stretches: &[&[(usize, &Vec<Left>)]]| {
            let mut part = Part::new(map);
            stretches.iter().flat_map(|seen| seen.iter()).try_for_each(|(keyframe, before)| {
                part.add(*keyframe, before, &moved, &caster, world_from_body)
            })?;
            part.end()
        };
        let size = if by_all { stretches.len().div_ceil(PARTS * threads) } else { stretches.len() };
        let parts: Vec<_> = stretches.chunks(size.max(1)).collect();
        let parts: Vec<Part> = match parts.as_slice() {
            [all] => vec![part(all)?],
            several => {
                several.par_iter().map(|stretches| part(stretches)).collect::<Result<_, LoopError>>()?
            }
        };
        let mut whole = Part::new(map);
        parts.iter().try_for_each(|part| whole.merge(part))?;
        Ok(whole.sums.score(whole.cast as f64 / whole.all.max(1) as f64))
    }

    /// What is left of the rays of each keyframe that has some.
    fn seen(&self) -> impl Iterator<Item = (usize, &Vec<Left>)> {
        self.left.iter().enumerate().filter(|(_, left)| !left.is_empty())
    }
}

/// Some stretches of a map whose patches moved.
struct Part {
    sums: Sums,
    /// Rays cast anew, of how many.
    cast: usize,
    all: usize,
    casting: Casting,
    left: Vec<Left>,
}

impl Part {
    fn new(map: &LoopMap) -> Self {
        let casting = Casting::new(map.scales);
        Self { sums: map.sums(), cast: 0, all: 0, casting, left: Vec::new() }
    }

    /// Adds a keyframe of which the map before left this.
    fn add(
        &mut self,
        keyframe: usize,
        before: &[Left],
        moved: &Moved<'_>,
        caster: &Caster<PlacedPatches<'_>>,
        world_from_body: &[Isometry3<f64>],
    ) -> Result<(), LoopError> {
        let (map, changed) = (moved.map(), moved.changed(keyframe));
        let rays = &map.rays[keyframe];
        self.sums.enter(map.stretches[keyframe])?;
        // Groups that changed and follow each other go together.
        let groups: Vec<_> = rays.groups().iter().zip(changed).collect();
        for groups in groups.chunk_by(|a, b| a.1 == b.1) {
            let [Some((first, changed)), Some((last, _))] = [groups.first(), groups.last()] else {
                continue;
            };
            let range = first.first..last.first + last.count;
            self.all += range.len();
            self.left.clear();
            if *changed {
                self.cast += range.len();
                let rays = &rays.all()[range.clone()];
                self.casting.cast(caster, &world_from_body[keyframe], rays, &mut self.left)?;
            } else {
                self.left.extend_from_slice(&before[range.clone()]);
            }
            for (before, after) in before[range].iter().zip(&self.left) {
                self.sums.frame.add_return(&[before.residuals(), after.residuals()]);
            }
        }
        Ok(())
    }

    fn end(mut self) -> Result<Self, LoopError> {
        self.sums.leave()?;
        Ok(self)
    }

    /// Adds other stretches that have ended.
    fn merge(&mut self, other: &Self) -> Result<(), LoopError> {
        self.cast += other.cast;
        self.all += other.all;
        self.sums.merge(&other.sums)
    }
}

impl LoopMap {
    /// Sums of nothing yet.
    fn sums(&self) -> Sums {
        Sums::new(self.scales, self.stretches.iter().max().map_or(0, |last| last + 1))
    }

    /// A caster into the map with its patches there, whose tiles may take the memory of this many maps.
    fn caster(
        &self,
        world_from_body: &[Isometry3<f64>],
        maps: usize,
    ) -> Result<Caster<PlacedPatches<'_>>, MapError> {
        let placed = PlacedPatches::new(&self.patches, world_from_body.iter().map(placement).collect())?;
        let settings = CastSettings {
            horizon_m: HORIZON * self.max_range_m,
            window_m: self.scales.lengths().near_m[0],
            return_m: self.scales.lengths().blocked_m,
            ..CastSettings::default()
        };
        Ok(Caster::new(placed, settings, maps * self.tile_bytes))
    }
}

/// A thread's buffers.
struct Casting {
    scales: Scales,
    rays: Vec<Ray>,
    queries: Vec<Query>,
    answers: Vec<Answer>,
    buffers: CastBuffers,
}

impl Casting {
    fn new(scales: Scales) -> Self {
        let (rays, queries, answers) = (Vec::new(), Vec::new(), Vec::new());
        Self { scales, rays, queries, answers, buffers: CastBuffers::default() }
    }

    /// Casts rays of a keyframe, and adds what the map leaves of them to `left`.
    fn cast(
        &mut self,
        caster: &Caster<PlacedPatches<'_>>,
        world_from_body: &Isometry3<f64>,
        rays: &[RayInPatch],
        left: &mut Vec<Left>,
    ) -> Result<(), MapError> {
        let Self { scales, rays: placed, queries, answers, buffers } = self;
        for rays in rays.chunks(BLOCK_RAYS) {
            placed.clear();
            placed.extend(rays.iter().map(|ray| ray.placed(world_from_body)));
            queries.clear();
            queries.extend(placed.iter().map(|&ray| Query { ray, segment: None }));
            caster.cast(queries, answers, buffers)?;
            left.extend(
                placed.iter().zip(answers.iter()).map(|(ray, answer)| Left::of(ray, answer, *scales)),
            );
        }
        Ok(())
    }
}
