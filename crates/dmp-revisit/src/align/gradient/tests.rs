//! Derivatives against differences of exact motions.

use dmp_sensor::{Isometry3, UnitQuaternion, Vector3};
use nalgebra::Vector6;
use proptest::prelude::*;

use super::{Plane, PosedReturn, point_to_plane};

type Triple = [f64; 3];

fn triple(reach: f64) -> impl Strategy<Value = Triple> {
    prop::array::uniform3(-reach..reach)
}

/// The slope at 0, by five points: exact to the fourth power of the step.
fn slope(of: impl Fn(f64) -> f64) -> f64 {
    let step = 1e-3;
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| of(k * step));
    (8.0 * (c - b) - (d - a)) / (12.0 * step)
}

/// The motion by a rotation vector and a translation of which only number `k` is not 0.
fn along(k: usize, size: f64) -> Isometry3<f64> {
    let step = Vector6::from_fn(|row, _| if row == k { size } else { 0.0 });
    Isometry3::new(step.fixed_rows::<3>(3).into_owned(), step.fixed_rows::<3>(0).into_owned())
}

/// The body `later_s` after the return, moving on as it does.
fn moved_on(posed: &PosedReturn, later_s: f64) -> PosedReturn {
    let mut later = *posed;
    later.world_from_body.translation.vector += posed.velocity_m_s * later_s;
    later.world_from_body.rotation =
        UnitQuaternion::from_scaled_axis(posed.turn_rate_rad_s * later_s) * posed.world_from_body.rotation;
    later
}

proptest! {
    #[test]
    fn derivatives_of_the_distance_are_those_of_exact_motions(
        body in [triple(50.0), triple(2.0)], sensor in [triple(2.0), triple(2.0)],
        velocity in [triple(15.0), triple(1.5)], point in triple(30.0), mean_m in triple(60.0), normal in triple(1.0),
    ) {
        let normal = Vector3::from(normal);
        prop_assume!(normal.norm() > 0.1);
        let plane = Plane { mean_m: mean_m.into(), normal: normal.normalize() };
        let pose = |[place, turn]: [Triple; 2]| Isometry3::new(Vector3::from(place), Vector3::from(turn));
        let posed = PosedReturn {
            world_from_body: pose(body),
            body_from_sensor: pose(sensor),
            velocity_m_s: Vector3::from(velocity[0]),
            turn_rate_rad_s: Vector3::from(velocity[1]),
            point_in_sensor_m: Vector3::from(point),
        };
        let residual_m = |posed: &PosedReturn| point_to_plane(posed, &plane).residual_m;
        let found = point_to_plane(&posed, &plane);
        let of_sensor = |k, size| PosedReturn { body_from_sensor: posed.body_from_sensor * along(k, size), ..posed };
        let by_extrinsic = Vector6::from_fn(|k, _| slope(|size| residual_m(&of_sensor(k, size))));
        let by_time = slope(|later_s| residual_m(&moved_on(&posed, later_s)));
        prop_assert!((found.by_extrinsic - by_extrinsic).amax() < 1e-6 * by_extrinsic.amax().max(1.0), "{found:?}");
        prop_assert!((found.by_time_m_s - by_time).abs() < 1e-6 * by_time.abs().max(1.0), "{found:?}");
        let place = posed.world_from_body * (posed.body_from_sensor * nalgebra::Point3::from(posed.point_in_sensor_m));
        prop_assert!((found.residual_m - plane.normal.dot(&(place.coords - plane.mean_m))).abs() < 1e-9);
    }
}
