//! Where the returns of a scan lie, as far as it decides how a small motion moves them.

use dmp_sensor::Isometry3;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// The first two moments of returns in the frame of the sensor.
///
/// ```
/// use dmp_revisit::apart::Moments;
/// use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};
///
/// let returns = Moments::of([[3.0, 4.0, 0.0], [-3.0, -4.0, 0.0]].into_iter());
/// let moved = Isometry3::from(Translation3::new(0.0, 0.0, 0.02));
/// assert!((returns.moved_by_m(&moved) - 0.02).abs() < 1e-12);
/// // A turn about z moves both by their distance of 5 m.
/// let turned = Isometry3::rotation(Vector3::z() * 0.001);
/// assert!((returns.moved_by_m(&turned) - 0.005).abs() < 1e-8);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moments {
    /// Means of x, y and z, metres, to a millimetre: as few digits come back from JSON to the same bits.
    pub mean_m: [f64; 3],
    /// Means of xx, yy, zz, xy, xz and yz, square metres, to as many digits.
    pub mean_m2: [f64; 6],
}

/// Sums of returns.
#[derive(Debug, Clone, Copy, Default)]
pub struct MomentSums {
    returns: u64,
    sums_m: [f64; 3],
    sums_m2: [f64; 6],
}

impl Moments {
    /// Of points in the frame of the sensor, metres.
    pub fn of(points_in_sensor_m: impl Iterator<Item = [f32; 3]>) -> Self {
        MomentSums::of(points_in_sensor_m).moments()
    }

    /// The root mean square of how far a motion moves the returns, metres: with the motion p ↦ R p + t and D = R − 1,
    /// E|D p + t|² = tr(D E\[p pᵀ\] Dᵀ) + 2 t · D E\[p\] + |t|². Without returns it is |t|.
    pub fn moved_by_m(&self, motion: &Isometry3<f64>) -> f64 {
        let mean = Vector3::from(self.mean_m);
        let [xx, yy, zz, xy, xz, yz] = self.mean_m2;
        let second = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let turn = motion.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        let shift = motion.translation.vector;
        let square_m2 = (turn * second * turn.transpose()).trace()
            + 2.0 * shift.dot(&(turn * mean))
            + shift.norm_squared();
        square_m2.max(0.0).sqrt()
    }
}

impl MomentSums {
    /// Of points in the frame of the sensor, metres.
    pub fn of(points_in_sensor_m: impl Iterator<Item = [f32; 3]>) -> Self {
        let mut sums = Self::default();
        for point in points_in_sensor_m {
            let [x, y, z] = point.map(f64::from);
            let of_one = [x * x, y * y, z * z, x * y, x * z, y * z];
            sums.merge(&Self { returns: 1, sums_m: [x, y, z], sums_m2: of_one });
        }
        sums
    }

    /// Adds other returns.
    pub fn merge(&mut self, other: &Self) {
        self.returns += other.returns;
        self.sums_m.iter_mut().zip(other.sums_m).for_each(|(sum, more)| *sum += more);
        self.sums_m2.iter_mut().zip(other.sums_m2).for_each(|(sum, more)| *sum += more);
    }

    /// The means.
    pub fn moments(&self) -> Moments {
        let count = self.returns.max(1) as f64;
        Moments {
            mean_m: self.sums_m.map(|sum| rounded(sum / count)),
            mean_m2: self.sums_m2.map(|sum| rounded(sum / count)),
        }
    }
}

fn rounded(mean: f64) -> f64 {
    (1e3 * mean).round() / 1e3
}
