//! One run laid onto another as one piece.

use dmp_reduce::Scales;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// A pose counts as a body that reaches so far to all sides, metres of a drive: about as far as what a scan shows. So a way that is
/// straight does not leave open how its surroundings are turned about it.
const ARM_M: f64 = 10.0;

/// The rigid motion that brings the poses of a run onto those of another with the least squares: of their places and of what
/// is around them.
pub fn laid_onto(from: &[Isometry3<f64>], onto: &[Isometry3<f64>], scales: Scales) -> Isometry3<f64> {
    let arm_m = ARM_M * scales.lengths().metre_m;
    let turn = |pose: &Isometry3<f64>| pose.rotation.to_rotation_matrix().into_inner();
    let pairs = || from.iter().zip(onto);
    // Of two points at the ends of each of three arms.
    let turns: Matrix3<f64> = pairs().map(|(a, b)| turn(b) * turn(a).transpose()).sum();
    let place = |pose: &Isometry3<f64>| Point3::from(pose.translation.vector);
    rigid(&pairs().map(|(a, b)| [place(a), place(b)]), turns * (2.0 * arm_m * arm_m))
}

/// The rigid motion that brings the first of each pair onto the second with the least squares (Kabsch 1976). `more` is added to the
/// covariance of the pairs. Where there is none, nothing is moved.
pub(crate) fn rigid(
    pairs: &(impl Iterator<Item = [Point3<f64>; 2]> + Clone),
    more: Matrix3<f64>,
) -> Isometry3<f64> {
    let count = pairs.clone().count().max(1) as f64;
    let centre = |side: usize| pairs.clone().map(|pair| pair[side].coords).sum::<Vector3<f64>>() / count;
    let [from, to] = [0, 1].map(centre);
    let covariance: Matrix3<f64> =
        pairs.clone().map(|[a, b]| (b.coords - to) * (a.coords - from).transpose()).sum::<Matrix3<f64>>()
            + more;
    if !covariance.iter().all(|number| number.is_finite()) {
        return Isometry3::identity();
    }
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Isometry3::identity() };
    // No mirror.
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Isometry3::from_parts((to - turn * from).into(), turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_reduce::Scales;
    use nalgebra::Translation3;

    /// On a straight road only the poses tell how a run is turned about it.
    #[test]
    fn a_straight_way_leaves_nothing_open() {
        let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let way: Vec<_> = (0..50).map(|k| at(f64::from(k))).collect();
        let turned = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
        let world = Isometry3::from_parts(Translation3::new(4e5, -5e6, 30.0), turned);
        let other: Vec<_> = way.iter().map(|pose| world * pose).collect();
        let motion = laid_onto(&other, &way, Scales::Drive);
        let beside = Point3::new(7.0, 20.0, -3.0);
        let off_m = (motion * (world * beside) - beside).norm();
        assert!(off_m < 1e-6, "{off_m}");
        assert_eq!(laid_onto(&[], &[], Scales::Drive), Isometry3::identity());
        let none = [Isometry3::translation(f64::NAN, 0.0, 0.0)];
        assert_eq!(laid_onto(&none, &none, Scales::Drive), Isometry3::identity());
    }
}
