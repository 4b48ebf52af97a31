//! The surface of a room that can be seen, as triangles.

use std::f64::consts::{PI, TAU};

use dmp_sensor::Vector3;

use super::furnished::Room;
use crate::parts::shape::Shape;

/// Farthest that the triangles of something round lie within it, metres.
const WITHIN_M: f64 = 5e-4;
/// A face is tested for visibility from this near, at this many places along each side.
const NEAR_M: f64 = 1e-3;
const LOOKS: usize = 8;

/// A corner-to-corner triangle, counter-clockwise seen from outside.
pub(super) type Triangle = [[f64; 3]; 3];

impl Room {
    /// The room's surface as triangles, counter-clockwise as seen from within the room, metres. Sides that lie
    /// behind others altogether, such as the backs of walls, are excluded.
    pub fn triangles(&self) -> Vec<[[f64; 3]; 3]> {
        let mut triangles = Vec::new();
        for solid in &self.solids {
            match solid.shape {
                Shape::Box { centre, half, cos_yaw, sin_yaw } => {
                    let turned = |v: Vector3<f64>| {
                        centre
                            + Vector3::new(cos_yaw * v.x - sin_yaw * v.y, sin_yaw * v.x + cos_yaw * v.y, v.z)
                    };
                    for face in faces(half).map(|face| face.map(turned)) {
                        if self.can_be_seen(&face) {
                            triangles.extend(halves(face));
                        }
                    }
                }
                Shape::Cylinder { foot, radius_m, height_m } => {
                    tube(foot, radius_m, height_m, &mut triangles);
                }
                Shape::Ellipsoid { centre, half } => ball(centre, half, &mut triangles),
            }
        }
        triangles
    }

    /// Whether any of the places spread over a face has room before it, within the room.
    fn can_be_seen(&self, face: &[Vector3<f64>; 4]) -> bool {
        let [a, b, _, d] = *face;
        let before = (b - a).cross(&(d - a)).normalize() * NEAR_M;
        let share = |k: usize| (k as f64 + 0.5) / LOOKS as f64;
        let places =
            (0..LOOKS * LOOKS).map(|k| a + (b - a) * share(k % LOOKS) + (d - a) * share(k / LOOKS) + before);
        places.into_iter().any(|place| self.is_empty_at(place))
    }

    /// Whether a place is within the room and in no solid.
    fn is_empty_at(&self, place: Vector3<f64>) -> bool {
        let [w, d, h] = self.options.size_m;
        let deepest_m = super::plan::DEEPEST_M + NEAR_M;
        let within = |at: f64, size: f64| (-deepest_m..=size + deepest_m).contains(&at);
        let in_room = within(place.x, w) && within(place.y, d) && (0.0..=h).contains(&place.z);
        in_room && !self.solids.iter().any(|solid| holds(&solid.shape, place))
    }
}

fn holds(shape: &Shape, place: Vector3<f64>) -> bool {
    match *shape {
        Shape::Box { centre, half, cos_yaw, sin_yaw } => {
            let v = place - centre;
            let into = [cos_yaw * v.x + sin_yaw * v.y, cos_yaw * v.y - sin_yaw * v.x, v.z];
            (0..3).all(|k| into[k].abs() <= half[k])
        }
        Shape::Cylinder { foot, radius_m, height_m } => {
            let v = place - foot;
            libm::hypot(v.x, v.y) <= radius_m && (0.0..=height_m).contains(&v.z)
        }
        Shape::Ellipsoid { centre, half } => (place - centre).component_div(&half).norm() <= 1.0,
    }
}

/// The sides of a box about the origin, counter-clockwise from outside.
fn faces(half: Vector3<f64>) -> [[Vector3<f64>; 4]; 6] {
    std::array::from_fn(|n| {
        let (axis, sign) = (n / 2, if n % 2 == 0 { 1.0 } else { -1.0 });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let round = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut corners = round.map(|[s, t]| {
            let mut corner = Vector3::zeros();
            (corner[axis], corner[u], corner[v]) = (sign * half[axis], s * half[u], t * half[v]);
            corner
        });
        if sign < 0.0 {
            corners.reverse();
        }
        corners
    })
}

fn halves([a, b, c, d]: [Vector3<f64>; 4]) -> [Triangle; 2] {
    [[a, b, c], [a, c, d]].map(|triangle| triangle.map(Into::into))
}

/// Corners of the polygon for a circle, a multiple of four.
fn corners(radius_m: f64) -> usize {
    let half_rad = libm::acos((1.0 - WITHIN_M / radius_m).max(0.0));
    (PI / half_rad / 4.0).ceil().max(2.0) as usize * 4
}

/// Sine and cosine of the k-th of so many corners of a circle.
fn corner(k: usize, corners: usize) -> (f64, f64) {
    libm::sincos(TAU * (k % corners) as f64 / corners as f64)
}

fn tube(foot: Vector3<f64>, radius_m: f64, height_m: f64, triangles: &mut Vec<Triangle>) {
    let parts = corners(radius_m);
    let top = Vector3::new(0.0, 0.0, height_m);
    let at = |k: usize| {
        let (sin, cos) = corner(k, parts);
        foot + Vector3::new(radius_m * cos, radius_m * sin, 0.0)
    };
    for k in 0..parts {
        let (a, b) = (at(k), at(k + 1));
        triangles.extend(halves([a, b, b + top, a + top]));
        triangles.push([foot + top, a + top, b + top].map(Into::into));
        triangles.push([foot, b, a].map(Into::into));
    }
}

fn ball(centre: Vector3<f64>, half: Vector3<f64>, triangles: &mut Vec<Triangle>) {
    let parts = corners(half.max());
    let at = |ring: usize, k: usize| {
        // From the south pole to the north pole in half a circle.
        let (sin_up, cos_up) = libm::sincos(TAU * (ring as f64 / parts as f64 - 0.25));
        let (sin, cos) = corner(k, parts);
        centre + half.component_mul(&Vector3::new(cos_up * cos, cos_up * sin, sin_up))
    };
    for ring in 0..parts / 2 {
        for k in 0..parts {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            if ring > 0 {
                triangles.push([a, b, c].map(Into::into));
            }
            if ring + 1 < parts / 2 {
                triangles.push([a, c, d].map(Into::into));
            }
        }
    }
}
