//! The residual of an edge, and its derivatives by the poses.

use dmp_sensor::{Isometry3, PoseEdge, Vector3};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector6};

/// The residual of an edge, and its derivatives by the two poses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slope {
    /// As [`residual`].
    pub(super) residual: Vector6<f64>,
    /// By the step of the pose that the edge leads from, see [`moved`].
    pub(super) by_from: Matrix6<f64>,
    /// By the step of the pose that it leads to.
    pub(super) by_to: Matrix6<f64>,
}

/// The residual of an edge, as g2o has it: the pose that was found in the frame of the one that was measured, its place in
/// metres, then x, y, z of its quaternion with w ≥ 0.
pub(super) fn residual(edge: &PoseEdge, from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let off = edge.from_from_to.inv_mul(&from.inv_mul(to));
    let turn = vector_part(&off.rotation).1;
    let place = off.translation.vector;
    Vector6::new(place.x, place.y, place.z, turn.x, turn.y, turn.z)
}

/// The residual with its derivatives by steps of both poses.
pub(super) fn slope(edge: &PoseEdge, from: &Isometry3<f64>, to: &Isometry3<f64>) -> Slope {
    let found = from.inv_mul(to);
    let off = edge.from_from_to.inv_mul(&found);
    let measured_from_from = edge.from_from_to.rotation.inverse().to_rotation_matrix().into_inner();
    let (w, turn) = vector_part(&off.rotation);
    let place = off.translation.vector;
    let (scalar, cross) = (Matrix3::from_diagonal_element(w), turn.cross_matrix());

    let mut by_from = Matrix6::zeros();
    by_from.fixed_view_mut::<3, 3>(0, 0).copy_from(&-measured_from_from);
    let lever = found.translation.vector.cross_matrix();
    by_from.fixed_view_mut::<3, 3>(0, 3).copy_from(&(measured_from_from * lever));
    by_from.fixed_view_mut::<3, 3>(3, 3).copy_from(&((cross - scalar) * measured_from_from * 0.5));
    let mut by_to = Matrix6::zeros();
    by_to.fixed_view_mut::<3, 3>(0, 0).copy_from(&off.rotation.to_rotation_matrix().into_inner());
    by_to.fixed_view_mut::<3, 3>(3, 3).copy_from(&((scalar + cross) * 0.5));
    let residual = Vector6::new(place.x, place.y, place.z, turn.x, turn.y, turn.z);
    Slope { residual, by_from, by_to }
}

/// How the slopes of an edge change with the steps of its two poses, weighted by the pull of the edge: what the squares
/// of the slopes leave out of the second derivatives of half of chi².
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// By the step of the pose that the edge leads from, twice.
    pub(super) from_from: Matrix6<f64>,
    /// By both: rows are those of `from`, columns those of `to`.
    pub(super) from_to: Matrix6<f64>,
    /// By the step of the pose that it leads to, twice.
    pub(super) to_to: Matrix6<f64>,
}

/// The [`Bend`] of an edge for its pull: the information times the residual.
///
/// To second order Cayley's map is the exponential one, so the place that the edge finds changes by
/// ½ a × (a × t) − a × R v + ½ R (b × v) + ½ a × u with the steps (u, a) of `from` and (v, b) of `to`, where (R, t) is
/// what is found; and its quaternion by the product of those of the steps, 1 − a²/8 and a/2.
pub(super) fn bend(edge: &PoseEdge, from: &Isometry3<f64>, to: &Isometry3<f64>, pull: &Vector6<f64>) -> Bend {
    let found = from.inv_mul(to);
    let (w, turn) = vector_part(&(edge.from_from_to.rotation.inverse() * found.rotation));
    let (pull, twist) = (Vector3::new(pull[0], pull[1], pull[2]), Vector3::new(pull[3], pull[4], pull[5]));
    let measured = edge.from_from_to.rotation.to_rotation_matrix().into_inner();
    let found_turn = found.rotation.to_rotation_matrix().into_inner();
    let (place, at_from) = (found.translation.vector, measured * pull);
    let at_to = found_turn.tr_mul(&at_from);
    let along = Matrix3::from_diagonal_element(twist.dot(&turn) * 0.25);

    let lever = at_from * place.transpose();
    let lever = (lever + lever.transpose()) * 0.5 - Matrix3::from_diagonal_element(at_from.dot(&place));
    let spread = turn * twist.transpose();
    let spread = (spread + spread.transpose() + twist.cross_matrix() * w) * 0.25 - along;
    let mut from_to = Matrix6::zeros();
    from_to.fixed_view_mut::<3, 3>(3, 0).copy_from(&(at_from.cross_matrix() * found_turn));
    from_to.fixed_view_mut::<3, 3>(3, 3).copy_from(&(measured * spread));
    Bend { from_from: own_bend(&at_from, lever - along), from_to, to_to: own_bend(&at_to, -along) }
}

/// The second derivatives by the step of one pose, of a force at it and those by its turn.
fn own_bend(force: &Vector3<f64>, by_turn: Matrix3<f64>) -> Matrix6<f64> {
    let half = force.cross_matrix() * 0.5;
    let mut bend = Matrix6::zeros();
    bend.fixed_view_mut::<3, 3>(0, 3).copy_from(&half);
    bend.fixed_view_mut::<3, 3>(3, 0).copy_from(&-half);
    bend.fixed_view_mut::<3, 3>(3, 3).copy_from(&by_turn);
    bend
}

/// A pose after a step in its own frame: three metres, then three radians as long as they are small, by Cayley's map of
/// SE(3). It needs no sine, and poses whose steps are those of one motion of the world move as a rigid body, however long
/// the steps: a bent chain of poses stays as long as it is.
pub(super) fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let (shift, half) =
        (Vector3::new(step[0], step[1], step[2]), Vector3::new(step[3], step[4], step[5]) * 0.5);
    // (1 − [half]ₓ)⁻¹ shift.
    let shift = (shift + half.cross(&shift) + half * half.dot(&shift)) / (1.0 + half.norm_squared());
    let turn = nalgebra::Quaternion::new(1.0, half.x, half.y, half.z);
    let rotation = UnitQuaternion::new_normalize(pose.rotation.quaternion() * turn);
    Isometry3::from_parts((pose.translation.vector + pose.rotation * shift).into(), rotation)
}

/// w and x, y, z of a rotation's quaternion, of the one of the two that has w ≥ 0.
fn vector_part(rotation: &UnitQuaternion<f64>) -> (f64, Vector3<f64>) {
    let (w, vector) = (rotation.w, rotation.vector().into_owned());
    if w < 0.0 { (-w, -vector) } else { (w, vector) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Translation3;

    fn pose(k: u32) -> Isometry3<f64> {
        let number = |j: u32| f64::from((k * 7 + j * 13) % 29) / 7.0 - 2.0;
        let turn = UnitQuaternion::from_euler_angles(number(1), number(2), number(3));
        Isometry3::from_parts(Translation3::new(number(4) * 9.0, number(5), number(6)), turn)
    }

    #[test]
    fn derivatives_are_differences() {
        for k in 0..20 {
            let (from, to) = (pose(3 * k), pose(3 * k + 1));
            // As far off as a wrong loop, and, where the last factor is a small step, as little as a good one.
            let off = if k % 2 == 0 {
                pose(3 * k + 2)
            } else {
                moved(&Isometry3::identity(), &Vector6::repeat(0.01))
            };
            let edge = PoseEdge {
                from: 0,
                to: 1,
                from_from_to: from.inv_mul(&to) * off,
                information: Matrix6::zeros(),
            };
            let slope = slope(&edge, &from, &to);
            assert_eq!(slope.residual, residual(&edge, &from, &to));
            for axis in 0..6 {
                let h = 1e-6;
                let step = |sign: f64| Vector6::from_fn(|row, _| if row == axis { sign * h } else { 0.0 });
                let by_from = residual(&edge, &moved(&from, &step(1.0)), &to)
                    - residual(&edge, &moved(&from, &step(-1.0)), &to);
                let by_to = residual(&edge, &from, &moved(&to, &step(1.0)))
                    - residual(&edge, &from, &moved(&to, &step(-1.0)));
                assert!((by_from / (2.0 * h) - slope.by_from.column(axis)).amax() < 1e-7, "{k} {axis}");
                assert!((by_to / (2.0 * h) - slope.by_to.column(axis)).amax() < 1e-7, "{k} {axis}");
            }
        }
    }

    #[test]
    fn bends_are_differences_of_second_order() {
        for k in 0..20 {
            let (from, to) = (pose(3 * k), pose(3 * k + 1));
            let from_from_to = from.inv_mul(&to) * pose(3 * k + 2);
            let edge = PoseEdge { from: 0, to: 1, from_from_to, information: Matrix6::zeros() };
            let pull = Vector6::from_fn(|row, _| f64::from((k + 3 * row as u32) % 7) - 3.0);
            let bend = bend(&edge, &from, &to, &pull);
            let whole = |a: usize, b: usize| match (a / 6, b / 6) {
                (0, 0) => bend.from_from[(a, b)],
                (0, _) => bend.from_to[(a, b - 6)],
                (_, 0) => bend.from_to[(b, a - 6)],
                _ => bend.to_to[(a - 6, b - 6)],
            };
            // The pull of the residual where both poses made a step of twelve numbers.
            let at = |steps: [(usize, f64); 2]| {
                let mut step = [0.0; 12];
                steps.iter().for_each(|(axis, length)| step[*axis] += length);
                let [from_step, to_step] = [&step[..6], &step[6..]].map(Vector6::from_column_slice);
                pull.dot(&residual(&edge, &moved(&from, &from_step), &moved(&to, &to_step)))
            };
            let h = 1e-4;
            for (a, b) in (0..12).flat_map(|a| (0..12).map(move |b| (a, b))) {
                let difference = at([(a, h), (b, h)]) - at([(a, h), (b, -h)]) - at([(a, -h), (b, h)])
                    + at([(a, -h), (b, -h)]);
                let (found, wanted) = (whole(a, b), difference / (4.0 * h * h));
                assert!(
                    (found - wanted).abs() < 1e-4 * (1.0 + wanted.abs()),
                    "{k} {a} {b}: {found} {wanted}"
                );
            }
        }
    }

    #[test]
    fn an_edge_that_fits_is_off_by_nothing_and_one_that_does_not_by_what_it_says() {
        let (from, to) = (pose(1), pose(2));
        let edge = |off: Isometry3<f64>| {
            let from_from_to = from.inv_mul(&to) * off.inverse();
            residual(&PoseEdge { from: 0, to: 1, from_from_to, information: Matrix6::zeros() }, &from, &to)
        };
        assert!(edge(Isometry3::identity()).amax() < 1e-14);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2);
        let off = edge(Isometry3::from_parts(Translation3::new(0.1, -0.2, 0.3), turn));
        let wanted = Vector6::new(0.1, -0.2, 0.3, 0.0, libm::sin(0.1), 0.0);
        assert!((off - wanted).amax() < 1e-14, "{off}");
    }
}
