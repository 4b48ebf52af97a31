//! Derivatives against differences of exact motions.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

use super::{Gradient, Plane, PosedReturn, ResidualKind, moved_by, point_to_plane};

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
    moved_by(&step.fixed_rows::<3>(0).into_owned(), &step.fixed_rows::<3>(3).into_owned())
}

/// The body `later_s` after the return, moving on as it does.
fn moved_on(posed: &PosedReturn, later_s: f64) -> PosedReturn {
    let mut later = *posed;
    later.world_from_body.translation.vector += posed.velocity_m_s * later_s;
    later.world_from_body.rotation =
        UnitQuaternion::from_scaled_axis(posed.turn_rate_rad_s * later_s) * posed.world_from_body.rotation;
    later
}

/// The derivatives by differences, of a residual that is computed anew at every motion.
fn by_differences(posed: &PosedReturn, residual_m: impl Fn(&PosedReturn) -> f64) -> Gradient {
    let of_body = |k, size| PosedReturn { world_from_body: posed.world_from_body * along(k, size), ..*posed };
    let of_sensor =
        |k, size| PosedReturn { body_from_sensor: posed.body_from_sensor * along(k, size), ..*posed };
    let scaled = |more| PosedReturn { point_in_sensor_m: posed.point_in_sensor_m * (1.0 + more), ..*posed };
    Gradient {
        residual_m: residual_m(posed),
        by_body: Vector6::from_fn(|k, _| slope(|size| residual_m(&of_body(k, size)))),
        by_extrinsic: Vector6::from_fn(|k, _| slope(|size| residual_m(&of_sensor(k, size)))),
        by_time_m_s: slope(|later_s| residual_m(&moved_on(posed, later_s))),
        by_scale_m: slope(|more| residual_m(&scaled(more))),
    }
}

fn are_alike(found: &Gradient, expected: &Gradient) -> bool {
    let near = |a: f64, b: f64, size: f64| (a - b).abs() < 1e-6 * size.max(1.0);
    let alike = |a: &Vector6<f64>, b: &Vector6<f64>| (a - b).amax() < 1e-6 * b.amax().max(1.0);
    near(found.residual_m, expected.residual_m, expected.residual_m.abs())
        && alike(&found.by_body, &expected.by_body)
        && alike(&found.by_extrinsic, &expected.by_extrinsic)
        && near(found.by_time_m_s, expected.by_time_m_s, expected.by_time_m_s.abs())
        && near(found.by_scale_m, expected.by_scale_m, expected.by_scale_m.abs())
}

fn posed_returns() -> impl Strategy<Value = (PosedReturn, Plane)> {
    let poses = [[triple(50.0), triple(2.0)], [triple(2.0), triple(2.0)]];
    (poses, [triple(15.0), triple(1.5)], triple(30.0), triple(60.0), triple(1.0)).prop_filter_map(
        "a normal has a length, and a return a range",
        |([body, sensor], velocity, point, mean_m, normal)| {
            let pose = |[place, turn]: [Triple; 2]| Isometry3::new(Vector3::from(place), Vector3::from(turn));
            let posed = PosedReturn {
                world_from_body: pose(body),
                body_from_sensor: pose(sensor),
                velocity_m_s: Vector3::from(velocity[0]),
                turn_rate_rad_s: Vector3::from(velocity[1]),
                point_in_sensor_m: Vector3::from(point),
            };
            let normal = Vector3::from(normal);
            let plane = Plane { mean_m: mean_m.into(), normal: normal.try_normalize(0.1)? };
            (posed.point_in_sensor_m.norm() > 1.0).then_some((posed, plane))
        },
    )
}

proptest! {
    #[test]
    fn derivatives_of_the_distance_are_those_of_exact_motions((posed, plane) in posed_returns()) {
        let place = |posed: &PosedReturn| {
            posed.world_from_body * (posed.body_from_sensor * Point3::from(posed.point_in_sensor_m))
        };
        let residual_m = |posed: &PosedReturn| plane.normal.dot(&(place(posed).coords - plane.mean_m));
        let (found, expected) = (point_to_plane(&posed, &plane), by_differences(&posed, residual_m));
        prop_assert!(are_alike(&found, &expected), "{found:?} {expected:?}");
    }

    #[test]
    fn derivatives_of_the_range_are_those_of_exact_motions((posed, plane) in posed_returns()) {
        // The crossing of a line and a plane, in the world.
        let predicted_m = |posed: &PosedReturn| {
            let world_from_sensor = posed.world_from_body * posed.body_from_sensor;
            let origin = world_from_sensor * Point3::origin();
            let way = world_from_sensor * posed.point_in_sensor_m.normalize();
            plane.normal.dot(&(plane.mean_m - origin.coords)) / plane.normal.dot(&way)
        };
        let way = posed.world_from_body * (posed.body_from_sensor * posed.point_in_sensor_m.normalize());
        prop_assume!(plane.normal.dot(&way).abs() > 0.2);
        let residual_m = |posed: &PosedReturn| posed.point_in_sensor_m.norm() - predicted_m(posed);
        let (range_m, found) = posed.against(ResidualKind::Range, &plane).unwrap();
        let expected = by_differences(&posed, residual_m);
        prop_assert!(are_alike(&found, &expected), "{found:?} {expected:?}");
        prop_assert!((range_m - predicted_m(&posed)).abs() < 1e-9 * range_m.abs().max(1.0));
        // Either side of a plane is the same plane, and both residuals have one sign.
        let (_, distance) = posed.against(ResidualKind::Plane, &plane).unwrap();
        let other = posed.against(ResidualKind::Plane, &Plane { normal: -plane.normal, ..plane }).unwrap().1;
        prop_assert_eq!(distance, other);
        let expected = found.residual_m * plane.normal.dot(&way).abs();
        prop_assert!((distance.residual_m - expected).abs() < 1e-9 * found.residual_m.abs().max(1.0));
    }
}

#[test]
fn a_ray_along_a_plane_and_a_return_without_a_range_have_no_residual() {
    let mut posed = PosedReturn {
        world_from_body: Isometry3::identity(),
        body_from_sensor: Isometry3::identity(),
        velocity_m_s: Vector3::zeros(),
        turn_rate_rad_s: Vector3::zeros(),
        point_in_sensor_m: Vector3::x(),
    };
    let plane = Plane { mean_m: Vector3::z(), normal: Vector3::z() };
    assert_eq!(posed.against(ResidualKind::Range, &plane), None);
    posed.point_in_sensor_m = Vector3::zeros();
    assert_eq!(posed.against(ResidualKind::Plane, &plane), None);
}
