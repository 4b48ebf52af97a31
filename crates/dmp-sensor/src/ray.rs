//! The range–bearing model: a return as a ray.

use nalgebra::{Isometry3, Point3, Vector3};

/// A return as the range–bearing model sees it: from where, in which direction, how far.
///
/// The sensor model S of Zhang & Chen 2021, eq. 6–7, predicts `range_m` by casting this ray into a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Place of the sensor at the return's own time, world frame, metres.
    pub origin_in_world: [f64; 3],
    /// Unit bearing in the world frame.
    pub direction_in_world: [f64; 3],
    /// The measured range z, metres.
    pub range_m: f64,
}

impl Ray {
    /// The ray of a return at `point_in_sensor_m`, measured from the pose `world_from_sensor`.
    ///
    /// The point must be finite and away from the origin, as [`crate::ReturnFilter`] makes sure;
    /// a zero range has no bearing and gives a direction of NaN.
    #[inline]
    pub fn of_return(world_from_sensor: &Isometry3<f64>, point_in_sensor_m: [f32; 3]) -> Self {
        let point = Point3::from(point_in_sensor_m.map(f64::from));
        let range_m = point.coords.norm();
        let direction = world_from_sensor.rotation * (point.coords / range_m);
        Self {
            origin_in_world: world_from_sensor.translation.vector.into(),
            direction_in_world: direction.into(),
            range_m,
        }
    }

    /// The same ray seen from another frame.
    #[must_use]
    pub fn moved(&self, new_from_world: &Isometry3<f64>) -> Self {
        Self {
            origin_in_world: (new_from_world * Point3::from(self.origin_in_world)).into(),
            direction_in_world: (new_from_world.rotation * Vector3::from(self.direction_in_world)).into(),
            range_m: self.range_m,
        }
    }

    /// Where the measured return lies, world frame, metres.
    #[inline]
    pub fn endpoint_in_world(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.origin_in_world[k] + self.direction_in_world[k] * self.range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_endpoint_is_the_transformed_point() {
        let pose = Isometry3::new(Vector3::new(5e5, 4e6, 30.0), Vector3::new(0.1, -0.4, 2.0));
        let ray = Ray::of_return(&pose, [3.0, -4.0, 12.0]);
        let expected = pose * Point3::new(3.0, -4.0, 12.0);
        assert!((ray.range_m - 13.0).abs() < 1e-12);
        for (got, want) in ray.endpoint_in_world().iter().zip(expected.iter()) {
            assert!((got - want).abs() < 1e-8, "{got} {want}");
        }
        let moved = ray.moved(&pose.inverse());
        for (got, want) in moved.endpoint_in_world().iter().zip([3.0, -4.0, 12.0]) {
            assert!((got - want).abs() < 1e-8, "{got} {want}");
        }
    }
}
