//! Holds the surfel that predicts each return of posed scans.
//!
//! A residual is smooth in the pose as long as a return's ray meets one surfel. So that surfel is found once and held, as a plane
//! in `f64`; [`PosedReturn::against`] has the residual and its derivatives. At the rim of a surfel, and where one covers another,
//! the surfel changes: a probe casts the ray a little to four sides and compares.

use std::ops::Range;

use dmp_map::{MapError, TileSource};
use dmp_sensor::{Gradient, Isometry3, Plane, PosedReturn, Ray, Vector3, moved_by};

use crate::caster::Caster;
use crate::casting::CastBuffers;
use crate::query::{Answer, Hit, HitDisc, Query};

/// Copies of a disc in several tiles differ by rounding, metres.
const SAME_DISC_M: f64 = 1e-4;
/// Sides to which a probe goes.
const SIDES: usize = 4;

/// Points as they are stored, metres in the sensor's frame.
#[derive(Debug, Clone, Copy)]
pub enum Points<'a> {
    /// Of logs.
    Single(&'a [[f32; 3]]),
    /// Of programs.
    Double(&'a [[f64; 3]]),
}

/// Scans, one behind the other, each with a pose.
#[derive(Debug, Clone, Copy)]
pub struct PosedScans<'a> {
    /// The returns of all scans.
    pub points: Points<'a>,
    /// Behind the last return of each scan.
    pub ends: &'a [usize],
    /// The pose of each scan, in the frame of the map that they are cast into.
    pub world_from_body: &'a [Isometry3<f64>],
    /// Where the sensor sits on the body.
    pub body_from_sensor: Isometry3<f64>,
    /// How the body of each scan turns and moves, in its own frame: a rotation vector, rad/s, then a velocity, m/s. It does so
    /// steadily throughout the scan.
    pub twists_in_body: Option<&'a [[f64; 6]]>,
    /// When each return was measured, after the pose of its scan holds, seconds: it is posed by its twist.
    pub times_s: Option<&'a [f64]>,
    /// What to add to these times, seconds.
    pub later_s: f64,
    /// A factor on all ranges.
    pub scale: f64,
    /// The segment of the drive in which each scan was measured.
    pub segments: Option<&'a [i32]>,
}

/// What predicts a return.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Held {
    /// A surfel.
    Surfel {
        /// Its plane in the world; the normal faces the sensor.
        plane: Plane,
        /// Whether a probe met another surfel, or none.
        changes: bool,
    },
    /// Nothing at the requested range, though the ray meets the map.
    Other,
    /// Nothing: the ray meets no surfel.
    Miss,
}

/// What to hold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HoldSettings {
    /// The surfel of this range.
    pub hit: Hit,
    /// How far to the side probes meet the surfel's plane, metres; `None` for no probes.
    pub probe_m: Option<f64>,
}

/// Per-thread buffers of [`Caster::hold`].
#[derive(Debug, Default)]
pub struct HoldBuffers {
    queries: Vec<Query>,
    probes: Vec<Query>,
    answers: Vec<Answer>,
    discs: Vec<Option<HitDisc>>,
    of_probes: Vec<Option<HitDisc>>,
    of_caster: CastBuffers,
}

impl Points<'_> {
    /// Their number.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(points) => points.len(),
            Self::Double(points) => points.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    fn point_m(&self, number: usize) -> Vector3<f64> {
        match self {
            Self::Single(points) => Vector3::from(points[number].map(f64::from)),
            Self::Double(points) => Vector3::from(points[number]),
        }
    }
}

impl PosedScans<'_> {
    /// Whether all arrays have the length that the returns and the scans call for.
    pub fn is_whole(&self) -> bool {
        let (returns, scans) = (self.points.len(), self.ends.len());
        let of_scans = [self.twists_in_body.map(<[_]>::len), self.segments.map(<[_]>::len)];
        self.ends.is_sorted()
            && self.ends.last().copied().unwrap_or(0) == returns
            && self.world_from_body.len() == scans
            && of_scans.into_iter().flatten().all(|len| len == scans)
            && self.times_s.is_none_or(|times_s| times_s.len() == returns)
    }

    /// Goes through some returns: the scan of each, and the return with its pose.
    #[inline]
    pub fn each(&self, returns: Range<usize>, mut visit: impl FnMut(usize, &PosedReturn)) {
        let mut scan = self.ends.partition_point(|&end| end <= returns.start);
        let mut posed: Option<(usize, Option<f64>, PosedReturn)> = None;
        for number in returns {
            while self.ends[scan] <= number {
                scan += 1;
            }
            let time_s = self.times_s.map(|times_s| times_s[number]);
            // Neighbours share their scan, and often their time.
            let mut one = match posed {
                Some((of_scan, at_s, one)) if of_scan == scan && at_s == time_s => one,
                _ => self.posed_at(scan, time_s),
            };
            one.point_in_sensor_m = self.points.point_m(number) * self.scale;
            visit(scan, &one);
            posed = Some((scan, time_s, one));
        }
    }

    fn posed_at(&self, scan: usize, time_s: Option<f64>) -> PosedReturn {
        let world_from_body = self.world_from_body[scan];
        let [a, b, c, x, y, z] = self.twists_in_body.map_or([0.0; 6], |twists| twists[scan]);
        let (turn_rate, velocity) = (Vector3::new(a, b, c), Vector3::new(x, y, z));
        let after_s = time_s.unwrap_or(0.0) + self.later_s;
        let body_from_sensor = if after_s == 0.0 || self.twists_in_body.is_none() {
            self.body_from_sensor
        } else {
            moved_by(&(turn_rate * after_s), &(velocity * after_s)) * self.body_from_sensor
        };
        PosedReturn {
            world_from_body,
            body_from_sensor,
            velocity_m_s: world_from_body.rotation * velocity,
            turn_rate_rad_s: world_from_body.rotation * turn_rate,
            point_in_sensor_m: Vector3::zeros(),
        }
    }

    /// A row of the Jacobian: by rotation and translation of the body, by those of the extrinsic, by [`Self::later_s`] (NaN
    /// without twists), and by [`Self::scale`].
    #[inline]
    pub fn row(&self, gradient: &Gradient) -> [f64; 14] {
        let mut row = [0.0; 14];
        row[..6].copy_from_slice(gradient.by_body.as_slice());
        row[6..12].copy_from_slice(gradient.by_extrinsic.as_slice());
        row[12] = if self.twists_in_body.is_some() { gradient.by_time_m_s } else { f64::NAN };
        row[13] = gradient.by_scale_m / self.scale;
        row
    }
}

impl<M: TileSource> Caster<M> {
    /// What predicts each of some returns, in order; `held` is overwritten.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged.
    pub fn hold(
        &self,
        scans: &PosedScans<'_>,
        returns: Range<usize>,
        settings: HoldSettings,
        held: &mut Vec<Held>,
        buffers: &mut HoldBuffers,
    ) -> Result<(), MapError> {
        let HoldBuffers { queries, probes, answers, discs, of_probes, of_caster } = buffers;
        let HoldSettings { hit, probe_m } = settings;
        queries.clear();
        scans.each(returns, |scan, posed| {
            let segment = scans.segments.map(|segments| segments[scan]);
            queries.push(Query { ray: ray_of(posed), segment });
        });
        self.cast_with_discs(queries, answers, (hit, &mut *discs), of_caster)?;
        held.clear();
        held.extend(discs.iter().zip(&*answers).map(|(disc, answer)| match disc {
            Some(disc) => Held::Surfel { plane: plane_of(disc), changes: false },
            None if answer.first_m.is_some() => Held::Other,
            None => Held::Miss,
        }));
        let Some(probe_m) = probe_m else { return Ok(()) };
        probes.clear();
        for (query, range_m) in queries.iter().zip(answers.iter().map(|answer| answer.range_m(hit))) {
            probes.extend(range_m.into_iter().flat_map(|range_m| to_the_sides(query, probe_m / range_m)));
        }
        self.cast_with_discs(probes, answers, (hit, &mut *of_probes), of_caster)?;
        let mut sides = of_probes.chunks_exact(SIDES);
        for (held, disc) in held.iter_mut().zip(&*discs) {
            if let (Held::Surfel { changes, .. }, Some(disc)) = (held, disc) {
                let same = |other: &Option<HitDisc>| other.is_some_and(|other| is_same(disc, &other));
                *changes = !sides.next().is_some_and(|sides| sides.iter().all(same));
            }
        }
        Ok(())
    }
}

fn ray_of(posed: &PosedReturn) -> Ray {
    let world_from_sensor = posed.world_from_body * posed.body_from_sensor;
    let range_m = posed.point_in_sensor_m.norm();
    Ray {
        origin_in_world: world_from_sensor.translation.vector.into(),
        direction_in_world: (world_from_sensor.rotation * (posed.point_in_sensor_m / range_m)).into(),
        range_m,
    }
}

fn plane_of(disc: &HitDisc) -> Plane {
    let normal = Vector3::from(disc.normal_in_world.map(f64::from));
    Plane { mean_m: Vector3::from(disc.centre_in_world_m), normal: normal.normalize() }
}

fn is_same(one: &HitDisc, other: &HitDisc) -> bool {
    let apart_m = Vector3::from(one.centre_in_world_m) - Vector3::from(other.centre_in_world_m);
    apart_m.norm() < SAME_DISC_M && one.normal_in_world == other.normal_in_world
}

/// The same ray turned a little to four sides.
fn to_the_sides(query: &Query, turn_rad: f64) -> [Query; SIDES] {
    let way = Vector3::from(query.ray.direction_in_world);
    let across = way.cross(&if way.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() }).normalize();
    let up = way.cross(&across);
    [across, -across, up, -up].map(|side| {
        let direction_in_world = (way + side * turn_rad).normalize().into();
        Query { ray: Ray { direction_in_world, ..query.ray }, ..*query }
    })
}
