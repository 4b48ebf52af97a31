//! Derivatives against differences of exact motions, and residuals against what they say they are.

use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};
use nalgebra::Vector6;
use proptest::prelude::*;

use super::{Gradient, Plane, PosedReturn, point_to_plane, range_residual};

type Triple = [f64; 3];

fn triple(reach: f64) -> impl Strategy<Value = Triple> {
    prop::array::uniform3(-reach..reach)
}

/// The exact motion of a rotation vector and a translation.
fn exact(step: &Vector6<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
    Isometry3::from_parts(Translation3::new(step[3], step[4], step[5]), rotation)
}

/// The slope at 0, by five points: exact to the fourth power of the step.
fn slope(of: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let step = 1e-3;
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| of(k * step));
    Some((8.0 * (c? - b?) - (d? - a?)) / (12.0 * step))
}

fn unit(k: usize, size: f64) -> Vector6<f64> {
    Vector6::from_fn(|row, _| if row == k { size } else { 0.0 })
}

/// The body `later_s` after the return, moving on as it does.
fn moved_on(posed: &PosedReturn, later_s: f64) -> PosedReturn {
    let mut later = *posed;
    later.world_from_body.translation.vector += posed.velocity_m_s * later_s;
    later.world_from_body.rotation =
        UnitQuaternion::from_scaled_axis(posed.turn_rate_rad_s * later_s) * posed.world_from_body.rotation;
    later
}

/// All thirteen derivatives by differences.
fn differences(posed: &PosedReturn, residual_m: impl Fn(&PosedReturn) -> Option<f64>) -> Option<Gradient> {
    let (mut by_pose, mut by_extrinsic) = (Vector6::zeros(), Vector6::zeros());
    for k in 0..6 {
        by_pose[k] = slope(|size| {
            let world_from_body = exact(&unit(k, size)) * posed.world_from_body;
            residual_m(&PosedReturn { world_from_body, ..*posed })
        })?;
        by_extrinsic[k] = slope(|size| {
            let body_from_sensor = posed.body_from_sensor * exact(&unit(k, size));
            residual_m(&PosedReturn { body_from_sensor, ..*posed })
        })?;
    }
    let by_time_m_s = slope(|later_s| residual_m(&moved_on(posed, later_s)))?;
    Some(Gradient { residual_m: residual_m(posed)?, by_pose, by_extrinsic, by_time_m_s })
}

/// The largest difference of two derivatives, as a share of the largest derivative of its kind or of 1.
fn off(a: &Gradient, b: &Gradient) -> f64 {
    let of = |a: &Vector6<f64>, b: &Vector6<f64>| (a - b).amax() / a.amax().max(1.0);
    let time = (a.by_time_m_s - b.by_time_m_s).abs() / a.by_time_m_s.abs().max(1.0);
    of(&a.by_pose, &b.by_pose).max(of(&a.by_extrinsic, &b.by_extrinsic)).max(time)
}

fn posed(body: [Triple; 2], sensor: [Triple; 2], velocity: [Triple; 2], point: Triple) -> PosedReturn {
    let pose = |[place, turn]: [Triple; 2]| Isometry3::new(Vector3::from(place), Vector3::from(turn));
    PosedReturn {
        world_from_body: pose(body),
        body_from_sensor: pose(sensor),
        velocity_m_s: Vector3::from(velocity[0]),
        turn_rate_rad_s: Vector3::from(velocity[1]),
        point_in_sensor_m: Vector3::from(point),
    }
}

fn posed_returns() -> impl Strategy<Value = PosedReturn> {
    let body = [triple(50.0), triple(2.0)];
    let sensor = [triple(2.0), triple(2.0)];
    let velocity = [triple(15.0), triple(1.5)];
    (body, sensor, velocity, triple(30.0)).prop_map(|(b, s, v, point)| posed(b, s, v, point))
}

fn planes() -> impl Strategy<Value = Plane> {
    (triple(60.0), triple(1.0)).prop_filter_map("a normal", |(mean, normal)| {
        let normal = Vector3::from(normal).try_normalize(0.1)?;
        Some(Plane { mean_m: mean.into(), normal })
    })
}

proptest! {
    #[test]
    fn derivatives_of_the_distance_are_those_of_exact_motions(posed in posed_returns(), plane in planes()) {
        let found = point_to_plane(&posed, &plane);
        let expected = differences(&posed, |posed| Some(point_to_plane(posed, &plane).residual_m)).unwrap();
        prop_assert!(off(&found, &expected) < 1e-6, "{found:?}\n{expected:?}");
        let place = posed.world_from_body * (posed.body_from_sensor * nalgebra::Point3::from(posed.point_in_sensor_m));
        prop_assert!((found.residual_m - plane.normal.dot(&(place.coords - plane.mean_m))).abs() < 1e-9);
    }

    #[test]
    fn derivatives_of_the_range_are_those_of_exact_motions(posed in posed_returns(), plane in planes()) {
        let world_from_sensor = posed.world_from_body * posed.body_from_sensor;
        let bearing = world_from_sensor.rotation * posed.point_in_sensor_m.normalize();
        // At a slant, the differences are not exact.
        prop_assume!(posed.point_in_sensor_m.norm() > 0.5 && plane.normal.dot(&bearing).abs() > 0.2);
        let origin = world_from_sensor.translation.vector;
        let ahead = plane.normal.dot(&(plane.mean_m - origin)) * plane.normal.dot(&bearing);
        let Some(found) = range_residual(&posed, &plane) else {
            prop_assert!(ahead <= 0.0);
            return Ok(());
        };
        prop_assert!(ahead > 0.0);
        let met = origin + bearing * (posed.point_in_sensor_m.norm() - found.residual_m);
        prop_assert!(plane.normal.dot(&(met - plane.mean_m)).abs() < 1e-9, "the predicted point lies on the plane");
        // Within a step of the sensor, the plane may fall behind it.
        if let Some(expected) = differences(&posed, |posed| Some(range_residual(posed, &plane)?.residual_m)) {
            prop_assert!(off(&found, &expected) < 1e-6, "{found:?}\n{expected:?}");
        }
    }

    #[test]
    fn a_return_on_its_plane_has_no_residual_of_either_kind(posed in posed_returns(), normal in triple(1.0)) {
        let world_from_sensor = posed.world_from_body * posed.body_from_sensor;
        let mean_m = (world_from_sensor * nalgebra::Point3::from(posed.point_in_sensor_m)).coords;
        let normal = Vector3::from(normal);
        let bearing = world_from_sensor.rotation * posed.point_in_sensor_m.normalize();
        prop_assume!(normal.norm() > 0.1 && normal.normalize().dot(&bearing).abs() > 0.01);
        let plane = Plane { mean_m, normal: normal.normalize() };
        let (distance, range) = (point_to_plane(&posed, &plane), range_residual(&posed, &plane).unwrap());
        prop_assert!(distance.residual_m.abs() < 1e-9 && range.residual_m.abs() < 1e-9);
        // Either normal means the same plane: distances change sign, ranges do not.
        let other = Plane { normal: -plane.normal, ..plane };
        prop_assert!((point_to_plane(&posed, &other).by_pose + distance.by_pose).amax() < 1e-12);
        prop_assert!(off(&range_residual(&posed, &other).unwrap(), &range) < 1e-12);
    }
}

#[test]
fn what_no_ray_meets_has_no_range() {
    let still = posed([[0.0; 3]; 2], [[0.0; 3]; 2], [[0.0; 3]; 2], [5.0, 0.0, 0.0]);
    let wall = |x: f64, normal| Plane { mean_m: Vector3::new(x, 0.0, 0.0), normal };
    let residual_m = |x, normal| range_residual(&still, &wall(x, normal)).map(|found| found.residual_m);
    assert_eq!(residual_m(4.0, Vector3::x()), Some(1.0));
    assert_eq!(residual_m(-4.0, Vector3::x()), None);
    assert_eq!(residual_m(4.0, Vector3::y()), None);
    let floor = Plane { mean_m: -Vector3::z(), normal: Vector3::z() };
    assert_eq!(range_residual(&still, &floor), None);
    for point in [0.0, f64::NAN, f64::INFINITY] {
        let none = PosedReturn { point_in_sensor_m: Vector3::new(point, 0.0, 0.0), ..still };
        assert_eq!(range_residual(&none, &wall(4.0, Vector3::x())), None);
    }
}
