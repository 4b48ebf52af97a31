//! The query along a ray, and its answer.

use dmp_map::Independence;
use dmp_sensor::Ray;

/// A ray to cast. A ray that begins beyond ±5e7 m, where no map is, or whose direction is no unit
/// vector, finds nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))] // Rays are read out of order: each from one cache line.
pub struct Query {
    /// The ray, and the measured range z.
    pub ray: Ray,
    /// Segment of the drive in which it was measured; `None` for a map without segments, where no surfel is
    /// independent.
    pub segment: Option<i32>,
}

/// The predictions along a ray; ranges in metres from the ray's origin, `None` for a miss.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))] // Written out of order, as queries are read.
pub struct Answer {
    /// z1: the first surfel crossed.
    pub first_m: Option<f64>,
    /// zn: the crossing nearest to the measured range, if one lies within the window; of two equally near, the nearer
    /// to the sensor.
    pub nearest_m: Option<f64>,
    /// zc: the first independent surfel crossed.
    pub independent_m: Option<f64>,
    /// Whether a surfel crossed between the sensor and [`CastSettings::return_m`] behind the return is independent at
    /// the wider reach: the place was seen on another visit. Surfels farther along the ray are irrelevant for the
    /// place.
    pub revisited: bool,
}

impl Answer {
    /// One of its ranges.
    #[inline]
    pub fn range_m(&self, hit: Hit) -> Option<f64> {
        match hit {
            Hit::First => self.first_m,
            Hit::Nearest => self.nearest_m,
            Hit::Independent => self.independent_m,
        }
    }
}

/// One of the three ranges of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hit {
    /// z1.
    #[default]
    First,
    /// zn.
    Nearest,
    /// zc.
    Independent,
}

/// A disc of the map, as a ray crosses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HitDisc {
    /// Its centre, world frame, metres.
    pub centre_in_world_m: [f64; 3],
    /// Its unit normal in the world frame, turned towards the ray's origin.
    pub normal_in_world: [f32; 3],
}

/// The settings of a caster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CastSettings {
    /// Crossings farther than this are misses, as with a real sensor, metres.
    pub horizon_m: f64,
    /// Half-width of the window around the measured range for zn, metres.
    pub window_m: f64,
    /// Segments to each side of a ray's own that are not independent of it.
    pub reach: i32,
    /// The same for `revisited`.
    pub revisit_reach: i32,
    /// The search ends this far behind the measured range, metres: infinite for the predictions of the scores.
    pub beyond_m: f64,
    /// A crossing up to this far behind the measured range may still belong to the measured surface, metres. Packets of
    /// rays go that far.
    pub return_m: f64,
    /// The requested answers.
    pub wanted: Wanted,
}

/// The requested answers of the three.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wanted {
    /// Only z1, the paper's: the others are `None`.
    First,
    /// z1, zn and zc.
    #[default]
    Three,
}

impl Default for CastSettings {
    fn default() -> Self {
        Self {
            horizon_m: 200.0,
            window_m: 5.0,
            reach: 1,
            revisit_reach: Independence::SAME_VISIT,
            beyond_m: f64::INFINITY,
            return_m: 0.5,
            wanted: Wanted::Three,
        }
    }
}

impl CastSettings {
    pub(crate) fn independence(&self, segment: Option<i32>) -> [Option<Independence>; 2] {
        [self.reach, self.revisit_reach].map(|reach| segment.map(|s| Independence::of(s, reach)))
    }
}
