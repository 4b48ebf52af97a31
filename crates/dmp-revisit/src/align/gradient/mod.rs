//! How far a return is from a surface, and how that changes with the extrinsic and the clock.
//!
//! A return at `x` of the sensor lies at `p = world_from_body · body_from_sensor · x`. Derivatives are by a small motion
//! (rotation vector in rad, then translation in m) behind `body_from_sensor`, and by the seconds for which the body moves on
//! before the return is placed.

use dmp_sensor::{Isometry3, Vector3};
use nalgebra::Vector6;

/// A return of a sensor on a body whose pose and velocity are known at its time.
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

/// A residual with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient {
    /// What it is now, metres.
    pub residual_m: f64,
    /// By a rotation vector, m/rad, and a translation of the sensor, behind `body_from_sensor`: by `given_from_true` where
    /// the true one is known.
    pub by_extrinsic: Vector6<f64>,
    /// By the time at which the pose is taken, m/s: positive where the residual grows when poses are taken later.
    pub by_time_m_s: f64,
}

/// The signed distance of the return from the plane, `n·(p − q)`: positive on the side of the normal.
pub fn point_to_plane(posed: &PosedReturn, plane: &Plane) -> Gradient {
    let PosedReturn { world_from_body, body_from_sensor, velocity_m_s, turn_rate_rad_s, point_in_sensor_m } =
        posed;
    let arm_m = world_from_body.rotation
        * (body_from_sensor.rotation * point_in_sensor_m + body_from_sensor.translation.vector);
    let place_m = arm_m + world_from_body.translation.vector;
    let normal = &plane.normal;
    let world_from_sensor = world_from_body.rotation * body_from_sensor.rotation;
    let shift = world_from_sensor.inverse() * normal;
    let turn = point_in_sensor_m.cross(&shift);
    Gradient {
        residual_m: normal.dot(&(place_m - plane.mean_m)),
        by_extrinsic: Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z),
        by_time_m_s: normal.dot(&(velocity_m_s + turn_rate_rad_s.cross(&arm_m))),
    }
}

#[cfg(test)]
mod tests;
