//! Casts rays in arrays into a map.
//!
//! The casting threads write results directly into arrays made by numpy. numpy allocates large pages, which cost a
//! fraction of small ones.

use dmp_cast::{Answer, CastBuffers, Caster, Hit, HitDisc, Query};
use dmp_map::{MapError, Store};
use dmp_sensor::Ray;
use dmp_sensor::{Isometry3, Point3, Vector3};

/// Directions whose squared length is this near to one count as unit vectors, up to rounding.
const ROUNDING: f64 = 1e-12;

/// Rays as arrays.
pub(crate) struct Rays<'a> {
    pub(crate) origins: &'a [[f64; 3]],
    pub(crate) directions: &'a [[f64; 3]],
    pub(crate) measured_m: Option<&'a [f64]>,
    pub(crate) segments: Option<&'a [i32]>,
    pub(crate) world_from_own: Isometry3<f64>,
}

impl Rays<'_> {
    /// Number of rays; `None` if the arrays differ in length.
    pub(crate) fn count(&self) -> Option<usize> {
        let count = self.origins.len();
        let others =
            [Some(self.directions.len()), self.measured_m.map(<[f64]>::len), self.segments.map(<[i32]>::len)];
        others.into_iter().flatten().all(|other| other == count).then_some(count)
    }

    // Inlined so that the query is written in place: copying a struct just written in pieces stalls.
    #[inline]
    fn query(&self, ray: usize) -> Query {
        Query {
            ray: Ray {
                origin_in_world: (self.world_from_own * Point3::from(self.origins[ray])).into(),
                direction_in_world: (self.world_from_own * unit(self.directions[ray])).into(),
                range_m: self.measured_m.map_or(f64::INFINITY, |ranges| ranges[ray]),
            },
            segment: self.segments.map(|segments| segments[ray]),
        }
    }
}

/// The direction at unit length; a zero vector stays as it is and meets nothing.
#[inline]
fn unit(direction: [f64; 3]) -> Vector3<f64> {
    let direction = Vector3::from(direction);
    // Divisions are slow, and most directions already have unit length.
    if (direction.norm_squared() - 1.0).abs() <= ROUNDING {
        return direction;
    }
    direction.try_normalize(0.0).unwrap_or(direction)
}

/// The output arrays, in the order of the rays.
pub(crate) struct Found<'a> {
    pub(crate) first_m: &'a mut [f64],
    /// The following ones only on request.
    pub(crate) nearest_m: Option<&'a mut [f64]>,
    pub(crate) independent_m: Option<&'a mut [f64]>,
    pub(crate) normals: Option<&'a mut [[f32; 3]]>,
}

impl<'a> Found<'a> {
    /// Whether it has exactly this many elements.
    pub(crate) fn is_of(&self, count: usize) -> bool {
        let ranges =
            [&self.nearest_m, &self.independent_m].map(|ranges| ranges.as_ref().map(|ranges| ranges.len()));
        let normals = self.normals.as_ref().map(|normals| normals.len());
        let [nearest, independent] = ranges;
        let counts = [Some(self.first_m.len()), nearest, independent, normals];
        counts.into_iter().flatten().all(|other| other == count)
    }

    /// Pieces of it with this many rays each.
    pub(crate) fn chunks(self, size: usize) -> impl Iterator<Item = Chunk<'a>> {
        let (nearest_m, independent_m) = (pieces(self.nearest_m, size), pieces(self.independent_m, size));
        let others = nearest_m.zip(independent_m).zip(pieces(self.normals, size));
        let columns = self.first_m.chunks_mut(size).zip(others).enumerate();
        columns.map(move |(k, (first_m, ((nearest_m, independent_m), normals)))| Chunk {
            start: k * size,
            found: Found { first_m, nearest_m, independent_m, normals },
        })
    }
}

/// Pieces of a column; without a column, endless `None`s.
fn pieces<T>(column: Option<&mut [T]>, size: usize) -> impl Iterator<Item = Option<&mut [T]>> {
    let pieces = column.into_iter().flat_map(move |column| column.chunks_mut(size));
    pieces.map(Some).chain(std::iter::repeat_with(|| None))
}

/// The output for rays from `start` on.
pub(crate) struct Chunk<'a> {
    start: usize,
    found: Found<'a>,
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Buffers {
    queries: Vec<Query>,
    answers: Vec<Answer>,
    discs: Vec<Option<HitDisc>>,
    of_caster: CastBuffers,
}

/// The rays to cast into a map.
pub(crate) struct Casting<'a> {
    pub(crate) caster: &'a Caster<Store>,
    pub(crate) rays: Rays<'a>,
    pub(crate) own_from_world: Isometry3<f64>,
}

impl Casting<'_> {
    /// Fills a chunk.
    pub(crate) fn cast(&self, chunk: Chunk<'_>, buffers: &mut Buffers) -> Result<(), MapError> {
        let Buffers { queries, answers, discs, of_caster } = buffers;
        let Chunk { start, found } = chunk;
        queries.clear();
        queries.extend((start..start + found.first_m.len()).map(|ray| self.rays.query(ray)));
        match found.normals {
            None => self.caster.cast(queries, answers, of_caster)?,
            Some(filled) => {
                self.caster.cast_with_discs(queries, answers, (Hit::First, &mut *discs), of_caster)?;
                for (filled, disc) in filled.iter_mut().zip(&*discs) {
                    let normal = disc.map(|disc| Vector3::from(disc.normal_in_world.map(f64::from)));
                    let in_own = |n: Vector3<f64>| (self.own_from_world * n).map(|c| c as f32).into();
                    *filled = normal.map_or([f32::NAN; 3], in_own);
                }
            }
        }
        write(found.first_m, answers, |answer| answer.first_m);
        if let Some(nearest_m) = found.nearest_m {
            write(nearest_m, answers, |answer| answer.nearest_m);
        }
        if let Some(independent_m) = found.independent_m {
            write(independent_m, answers, |answer| answer.independent_m);
        }
        Ok(())
    }
}

fn write(ranges_m: &mut [f64], answers: &[Answer], range_m: impl Fn(&Answer) -> Option<f64>) {
    for (range, answer) in ranges_m.iter_mut().zip(answers) {
        *range = range_m(answer).unwrap_or(f64::NAN);
    }
}
