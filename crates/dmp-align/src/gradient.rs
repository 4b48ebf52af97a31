//! How far a return is from a surface, and how that changes with the pose, the extrinsic and the clock.
//!
//! A return at `x` of the sensor lies at `p = world_from_body · body_from_sensor · x`. Derivatives are by a small motion
//! (rotation vector in rad, then translation in m) put before `world_from_body`, by one put behind `body_from_sensor`, and by
//! the seconds for which the body moves on before the return is placed.

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
    /// By a rotation vector, m/rad, and a translation, put before `world_from_body`.
    pub by_pose: Vector6<f64>,
    /// By the same of the sensor, put behind `body_from_sensor`: by `given_from_true` where the true one is known.
    pub by_extrinsic: Vector6<f64>,
    /// By the time at which the pose is taken, m/s: positive where the residual grows when poses are taken later.
    pub by_time_m_s: f64,
}

impl Gradient {
    fn scaled(self, factor: f64) -> Self {
        Self {
            residual_m: self.residual_m * factor,
            by_pose: self.by_pose * factor,
            by_extrinsic: self.by_extrinsic * factor,
            by_time_m_s: self.by_time_m_s * factor,
        }
    }
}

/// The signed distance of the return from the plane, `n·(p − q)`: positive on the side of the normal.
pub fn point_to_plane(posed: &PosedReturn, plane: &Plane) -> Gradient {
    at(posed, &posed.point_in_sensor_m, plane)
}

/// DMP's own residual (Zhang & Chen 2021, eq. 13): `z − z′`, the range that was measured less the range
/// `z′ = n·(q − o) / n·d` at which the ray from the sensor's origin `o` along the bearing `d` meets the plane.
///
/// `None` where the plane is not ahead of the sensor, or the return has no bearing.
///
/// ```
/// use dmp_align::{Plane, PosedReturn, range_residual};
/// use dmp_sensor::{Isometry3, Matrix6, Vector3};
/// use nalgebra::Vector6;
///
/// // The floor and two walls, seen by a sensor whose mounting is believed to be 3° and 25 cm off.
/// let planes = [([0.0, 0.0, -2.0], Vector3::z()), ([12.0, 0.0, 0.0], Vector3::x()), ([0.0, 9.0, 0.0], Vector3::y())]
///     .map(|(mean_m, normal)| Plane { mean_m: mean_m.into(), normal });
/// let world_from_body = Isometry3::new(Vector3::new(1.0, -2.0, 0.0), Vector3::new(0.02, -0.01, 0.6));
/// let truth = Isometry3::new(Vector3::new(0.3, 0.1, 1.2), Vector3::new(0.01, 0.15, -0.4));
/// let mut believed = truth * Isometry3::new(Vector3::new(0.2, -0.1, 0.11), Vector3::new(0.03, -0.02, 0.04));
///
/// let still = PosedReturn {
///     world_from_body,
///     body_from_sensor: truth,
///     velocity_m_s: Vector3::zeros(),
///     turn_rate_rad_s: Vector3::zeros(),
///     point_in_sensor_m: Vector3::zeros(),
/// };
/// // Where the rays meet each plane: a point of range 1 m has the residual 1 − z′.
/// let bearings = (0..600).map(|k| f64::from(k) * 0.7).map(|k| Vector3::new(k.cos(), k.sin(), (k * 0.37).sin()).normalize());
/// let returns: Vec<_> = bearings
///     .flat_map(|bearing| planes.map(|plane| (bearing, plane)))
///     .filter_map(|(bearing, plane)| {
///         let met = range_residual(&PosedReturn { point_in_sensor_m: bearing, ..still }, &plane)?;
///         let range_m = 1.0 - met.residual_m;
///         (range_m < 30.0).then_some((bearing * range_m, plane))
///     })
///     .collect();
///
/// // Gauss and Newton's method.
/// for _ in 0..6 {
///     let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
///     for (point_in_sensor_m, plane) in &returns {
///         let posed = PosedReturn { body_from_sensor: believed, point_in_sensor_m: *point_in_sensor_m, ..still };
///         let Some(found) = range_residual(&posed, plane) else { continue };
///         information += found.by_extrinsic * found.by_extrinsic.transpose();
///         gradient += found.by_extrinsic * found.residual_m;
///     }
///     let step = -information.cholesky().ok_or("the planes do not hold the sensor")?.solve(&gradient);
///     believed *= Isometry3::new(step.fixed_rows::<3>(3).into_owned(), step.fixed_rows::<3>(0).into_owned());
/// }
/// let off = believed.inverse() * truth;
/// assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9, "{off}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn range_residual(posed: &PosedReturn, plane: &Plane) -> Option<Gradient> {
    let range_m = posed.point_in_sensor_m.norm();
    let bearing = posed.point_in_sensor_m / range_m;
    let world_from_sensor = posed.world_from_body * posed.body_from_sensor;
    let along = plane.normal.dot(&(world_from_sensor.rotation * bearing));
    let predicted_m = plane.normal.dot(&(plane.mean_m - world_from_sensor.translation.vector)) / along;
    if !(predicted_m > 0.0 && predicted_m.is_finite()) {
        return None;
    }
    // A motion takes the predicted point off the plane by some distance; along the ray that is this much farther. The
    // measured range stays.
    let met = at(posed, &(bearing * predicted_m), plane).scaled(1.0 / along);
    Some(Gradient { residual_m: range_m - predicted_m, ..met })
}

/// The distance of a point of the sensor's frame from the plane.
fn at(posed: &PosedReturn, point_in_sensor_m: &Vector3<f64>, plane: &Plane) -> Gradient {
    let PosedReturn { world_from_body, body_from_sensor, velocity_m_s, turn_rate_rad_s, .. } = posed;
    let arm_m = world_from_body.rotation
        * (body_from_sensor.rotation * point_in_sensor_m + body_from_sensor.translation.vector);
    let place_m = arm_m + world_from_body.translation.vector;
    let normal = &plane.normal;
    let world_from_sensor = world_from_body.rotation * body_from_sensor.rotation;
    let normal_in_sensor = world_from_sensor.inverse() * normal;
    Gradient {
        residual_m: normal.dot(&(place_m - plane.mean_m)),
        by_pose: joined(place_m.cross(normal), normal),
        by_extrinsic: joined(point_in_sensor_m.cross(&normal_in_sensor), &normal_in_sensor),
        by_time_m_s: normal.dot(&(velocity_m_s + turn_rate_rad_s.cross(&arm_m))),
    }
}

fn joined(turn: Vector3<f64>, shift: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

#[cfg(test)]
mod tests;
