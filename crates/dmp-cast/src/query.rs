//! What is asked of a map along a ray, and what it answers.

use dmp_map::Independence;

/// A ray and what was measured along it. One that begins beyond ±5e7 m, where no map is, or whose direction is no unit
/// vector finds nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))] // Rays are taken out of order: each from one cache line.
pub struct Query {
    /// Where the ray starts, world frame, metres.
    pub origin_in_world_m: [f64; 3],
    /// Unit direction, world frame.
    pub direction_in_world: [f64; 3],
    /// The measured range z, metres.
    pub measured_m: f64,
    /// Segment of the drive in which it was measured; `None` for a map without segments, where no
    /// surfel counts as independent.
    pub segment: Option<i32>,
}

/// What the map predicts along a ray; ranges in metres from the ray's origin, `None` for a miss.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))] // Written out of order, as queries are read.
pub struct Answer {
    /// z1: the first surfel crossed.
    pub first_m: Option<f64>,
    /// zn: the crossing nearest to the measured range, if one lies within the window; of two equally
    /// near, the nearer to the sensor.
    pub nearest_m: Option<f64>,
    /// zc: the first independent surfel crossed.
    pub independent_m: Option<f64>,
    /// Whether a surfel crossed from the sensor up to [`CastSettings::return_m`] behind the return is independent at the wider
    /// reach: the place was seen on another visit. What the ray would meet further on says nothing of the place.
    pub revisited: bool,
}

/// How far and for what the caster looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CastSettings {
    /// Nothing beyond is seen, as with a real sensor: crossings further than this are misses, metres.
    pub horizon_m: f64,
    /// Half-width of the window around the measured range in which zn is looked for, metres.
    pub window_m: f64,
    /// Segments to each side of a ray's own that cannot vouch for it.
    pub reach: i32,
    /// The same for `revisited`.
    pub revisit_reach: i32,
    /// Nothing further than this behind the measured range is looked for, metres: infinite for the predictions
    /// that the scores are made of.
    pub beyond_m: f64,
    /// A crossing up to this far behind the measured range may still be of what was measured, metres. Rays go in packets
    /// as far as that.
    pub return_m: f64,
    /// Which answers are wanted.
    pub wanted: Wanted,
}

/// Which answers are wanted of the three.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wanted {
    /// z1 alone, the paper's: all else is `None`.
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
            revisit_reach: 5,
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
