//! What a room is built of, put where a wall says.

use dmp_sensor::Vector3;

use super::plan::Face;
use crate::parts::shape::Shape;
use crate::random::Random;

/// A solid thing in a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    /// Share of the readings that a depth camera loses on it: what is dark or shines.
    pub(super) lost: f64,
}

/// Share of the readings lost on ordinary surfaces.
const ORDINARY: f64 = 0.02;

/// Puts solids into a room, by places along walls.
#[derive(Debug)]
pub(super) struct Fitting {
    pub(super) solids: Vec<Solid>,
    pub(super) random: Random,
    /// Of what is put in next.
    lost: f64,
}

/// From and to, metres.
pub(super) type Span = [f64; 2];

impl Fitting {
    pub(super) fn new(seed: u64) -> Self {
        let random = Random::new(seed, &[b'r'.into(), b'f'.into()]);
        Self { solids: Vec::new(), random, lost: ORDINARY }
    }

    /// What `make` puts in is dark or shines: readings get lost on it.
    pub(super) fn dark(&mut self, make: impl FnOnce(&mut Self)) {
        self.lost = self.random.between(0.3, 0.7);
        make(self);
        self.lost = ORDINARY;
    }

    pub(super) fn put(&mut self, shape: Shape) {
        self.solids.push(Solid { shape, lost: self.lost });
    }

    /// A box by its place along a wall, off the wall into the room (negative: into the wall) and in height.
    pub(super) fn block(&mut self, face: &Face, along: Span, off: Span, z: Span) {
        let corner = |k: usize| {
            let [x, y] = face.at(along[k], off[k]);
            Vector3::new(x, y, z[k])
        };
        self.put(Shape::upright(corner(0), corner(1)));
    }

    /// A box that stands a little turned, by the middle of its place.
    pub(super) fn turned(&mut self, [x, y]: [f64; 2], [long, wide]: [f64; 2], z: Span, yaw: f64) {
        let (sin_yaw, cos_yaw) = libm::sincos(yaw);
        let centre = Vector3::new(x, y, f64::midpoint(z[0], z[1]));
        let half = Vector3::new(long / 2.0, wide / 2.0, (z[1] - z[0]) / 2.0);
        self.put(Shape::Box { centre, half, cos_yaw, sin_yaw });
    }

    pub(super) fn cylinder(&mut self, [x, y]: [f64; 2], radius_m: f64, z: Span) {
        self.put(Shape::Cylinder { foot: Vector3::new(x, y, z[0]), radius_m, height_m: z[1] - z[0] });
    }

    pub(super) fn ball(&mut self, centre: [f64; 3], radius_m: f64) {
        self.put(Shape::Ellipsoid { centre: Vector3::from(centre), half: Vector3::repeat(radius_m) });
    }
}

impl Face {
    /// The place so far along the wall and off it into the room.
    pub(super) fn at(&self, along_m: f64, off_m: f64) -> [f64; 2] {
        let [ax, ay] = self.along;
        [self.start[0] + ax * along_m - ay * off_m, self.start[1] + ay * along_m + ax * off_m]
    }

    /// Direction of the wall on the plan, radians.
    pub(super) fn heading_rad(&self) -> f64 {
        libm::atan2(self.along[1], self.along[0])
    }
}
