//! Transforms as seven numbers, as in files.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// A transform as x, y, z (metres), qx, qy, qz, qw.
pub fn seven(transform: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (transform.translation.vector, transform.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

/// The transform of [`seven`] numbers.
pub fn transform_of([x, y, z, i, j, k, w]: &[f64; 7]) -> Isometry3<f64> {
    let turn = UnitQuaternion::new_normalize(Quaternion::new(*w, *i, *j, *k));
    Isometry3::from_parts(Translation3::new(*x, *y, *z), turn)
}
