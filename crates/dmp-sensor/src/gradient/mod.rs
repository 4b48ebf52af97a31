//! How far a return is from a surface, and how that changes with pose, extrinsic, clock and scale.
//!
//! A return at `x` of the sensor lies at `p = world_from_body · body_from_sensor · x`. Derivatives are by small motions, each a
//! rotation vector in rad, then a translation in m, behind `world_from_body` and behind `body_from_sensor` (right
//! perturbations); by the seconds for which the body moves on before the return is placed; and by a factor on the range. The
//! surface is a plane that stays where it is: which surfel of a map a ray meets is not differentiated.
//!
//! Both residuals have one derivative. With `n` the plane's normal, `d` the bearing and `z'` the predicted range, the crossing
//! `z' d` moves off the plane as any point of the sensor does, and the range follows by `1 / n·d`.

mod twist;

use nalgebra::{Isometry3, Vector3, Vector6};

pub use twist::moved_by;

/// A return of a sensor on a body whose pose and velocity are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedReturn {
    /// The pose of the body when the return was made.
    pub world_from_body: Isometry3<f64>,
    /// Where the sensor sits on the body.
    pub body_from_sensor: Isometry3<f64>,
    /// How fast the origin of the body moves then, in the world frame, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// How fast the body turns then: a rotation vector per second in the world frame, rad/s.
    pub turn_rate_rad_s: Vector3<f64>,
    /// The return in the sensor's frame, metres.
    pub point_in_sensor_m: Vector3<f64>,
}

/// A plane of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Any of its points, metres.
    pub mean_m: Vector3<f64>,
    /// Its unit normal, towards either side.
    pub normal: Vector3<f64>,
}

/// Which number of a return is compared with a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ResidualKind {
    /// Measured minus predicted range, `z − z'` (Zhang & Chen 2021, eq. 6–7).
    #[default]
    Range,
    /// The distance of the return from the plane, positive behind it as seen from the sensor: `n·d (z − z')`, `n·d > 0`.
    Plane,
}

/// A residual with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient {
    /// What it is now, metres.
    pub residual_m: f64,
    /// By a rotation vector, m/rad, and a translation of the body, behind `world_from_body`.
    pub by_body: Vector6<f64>,
    /// By a rotation vector, m/rad, and a translation of the sensor, behind `body_from_sensor`: by `given_from_true` where
    /// the true one is known.
    pub by_extrinsic: Vector6<f64>,
    /// By the time at which the pose is taken, m/s: positive where the residual grows when poses are taken later.
    pub by_time_m_s: f64,
    /// By a factor on the measured range that is 1 now, metres.
    pub by_scale_m: f64,
}

/// The change of the distance of a point from a plane with a small motion, rotation vector first, of the frame that both are
/// given in: `((p × n), n)`.
#[inline]
pub fn by_motion(point_m: &Vector3<f64>, normal: &Vector3<f64>) -> Vector6<f64> {
    let turn = point_m.cross(normal);
    Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z)
}

/// The signed distance of the return from the plane, `n·(p − q)`: positive on the side of the normal.
#[inline]
pub fn point_to_plane(posed: &PosedReturn, plane: &Plane) -> Gradient {
    let PosedReturn { world_from_body, body_from_sensor, velocity_m_s, turn_rate_rad_s, point_in_sensor_m } =
        posed;
    let in_body_m = body_from_sensor.rotation * point_in_sensor_m + body_from_sensor.translation.vector;
    let arm_m = world_from_body.rotation * in_body_m;
    let place_m = arm_m + world_from_body.translation.vector;
    let normal = &plane.normal;
    let world_from_sensor = world_from_body.rotation * body_from_sensor.rotation;
    let in_sensor = world_from_sensor.inverse() * normal;
    Gradient {
        residual_m: normal.dot(&(place_m - plane.mean_m)),
        by_body: by_motion(&in_body_m, &(world_from_body.rotation.inverse() * normal)),
        by_extrinsic: by_motion(point_in_sensor_m, &in_sensor),
        by_time_m_s: normal.dot(&(velocity_m_s + turn_rate_rad_s.cross(&arm_m))),
        by_scale_m: in_sensor.dot(point_in_sensor_m),
    }
}

impl PosedReturn {
    /// The range at which the ray of the return meets the plane, and the residual of a kind; `None` for a ray along the plane
    /// and for a return without a range.
    #[inline]
    pub fn against(&self, kind: ResidualKind, plane: &Plane) -> Option<(f64, Gradient)> {
        let range_m = self.point_in_sensor_m.norm();
        let world_from_sensor = self.world_from_body * self.body_from_sensor;
        let bearing = world_from_sensor.rotation * (self.point_in_sensor_m / range_m);
        let cosine = plane.normal.dot(&bearing);
        let predicted_m = plane.normal.dot(&(plane.mean_m - world_from_sensor.translation.vector)) / cosine;
        if !predicted_m.is_finite() {
            return None;
        }
        let gradient = match kind {
            ResidualKind::Plane => {
                let normal = if cosine < 0.0 { -plane.normal } else { plane.normal };
                point_to_plane(self, &Plane { normal, ..*plane })
            }
            ResidualKind::Range => {
                let crossing_m = self.point_in_sensor_m * (predicted_m / range_m);
                let there = point_to_plane(&Self { point_in_sensor_m: crossing_m, ..*self }, plane);
                Gradient {
                    residual_m: range_m - predicted_m,
                    by_body: there.by_body / cosine,
                    by_extrinsic: there.by_extrinsic / cosine,
                    by_time_m_s: there.by_time_m_s / cosine,
                    by_scale_m: range_m,
                }
            }
        };
        Some((predicted_m, gradient))
    }
}

#[cfg(test)]
mod tests;
