//! A solid thing of a world, and what a ray meets of one.

use nalgebra::Vector3;

use super::shape::{Entry, Shape};

/// Share of the light that comes back from the ground, seen straight on.
pub(crate) const GROUND_REFLECTIVITY: f64 = 0.25;

/// What a ray met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Surface {
    /// The ground: street, pavement, hill.
    Ground,
    /// A house, with everything that is built onto it.
    Building,
    /// A flight of stairs, a terrace, and the low walls and benches on them.
    Stairs,
    /// A lamp post, sign post or bollard.
    Pole,
    /// A tree or a hedge.
    Plant,
    /// A car that stands.
    ParkedCar,
    /// A car that drives.
    MovingCar,
    /// Somebody who walks.
    Person,
}

impl Surface {
    /// Whether it moves.
    pub fn is_moving(self) -> bool {
        matches!(self, Self::MovingCar | Self::Person)
    }
}

/// The first surface along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Range from the ray's origin, metres.
    pub range_m: f64,
    /// Cosine of the angle between the ray and the surface's normal, in (0, 1].
    pub cos_incidence: f64,
    /// Share of the light that comes back from the surface, seen straight on.
    pub reflectivity: f64,
    /// What it is.
    pub surface: Surface,
}

impl Hit {
    pub(crate) fn of(entry: &Entry, direction: Vector3<f64>, reflectivity: f64, surface: Surface) -> Self {
        let cos_incidence = (-entry.normal.dot(&direction)).clamp(f64::MIN_POSITIVE, 1.0);
        Self { range_m: entry.range_m, cos_incidence, reflectivity, surface }
    }
}

/// A solid thing of a world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solid {
    pub(crate) shape: Shape,
    pub(crate) reflectivity: f64,
    pub(crate) surface: Surface,
}
