//! Which pieces of a surface are flat, and which way they face.

/// Steps of Newton's method: of what is flat, four reach rounding error.
const STEPS: usize = 10;

/// The unit normal of points of this covariance (xx, xy, xz, yy, yz, zz), with the variances across and along the narrower
/// direction; `None` where that across is more than a `share` of the other. The normal may be of either sign.
///
/// The least root of the characteristic polynomial, from below: only + − × ÷ and square roots.
pub(crate) fn flat(covariance: [f64; 6], share: f64) -> Option<([f64; 3], [f64; 2])> {
    let [xx, xy, xz, yy, yz, zz] = covariance;
    let trace = xx + yy + zz;
    let minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let mut least = 0.0;
    for _ in 0..STEPS {
        let value = ((trace - least) * least - minors) * least + determinant;
        let slope = (2.0 * trace - 3.0 * least) * least - minors;
        if value <= 0.0 || slope >= 0.0 {
            break;
        }
        let before = least;
        least -= value / slope;
        // It never is more than the root, nor the narrower variance more than half of the rest.
        if least > share * (trace - least) / 2.0 {
            return None;
        }
        if least - before <= 1e-14 * trace {
            break;
        }
    }
    let rest = trace - least;
    let product = minors - least * rest;
    let narrow = rest / 2.0 - (rest * rest / 4.0 - product).max(0.0).sqrt();
    if !(narrow > 0.0 && least <= share * narrow) {
        return None;
    }
    // Rows of what has no inverse span the plane.
    let rows = [[xx - least, xy, xz], [xy, yy - least, yz], [xz, yz, zz - least]];
    let normals = [(0, 1), (0, 2), (1, 2)].map(|(a, b)| cross(rows[a], rows[b]));
    let (normal, norm2) = normals
        .map(|normal| (normal, normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]))
        .into_iter()
        .fold(([0.0; 3], 0.0), |best, one| if one.1 > best.1 { one } else { best });
    let length = norm2.sqrt();
    (length > 0.0).then(|| (normal.map(|n| n / length), [least, narrow]))
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_map::smallest_eigenvector;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_least_eigenvector_of_what_is_flat(
            turn in prop::array::uniform9(-1.0..1.0_f64), wide in 1e-3..0.3_f64, narrow in 0.02..1.0_f64,
            flat_part in 0.0..0.2_f64, is_bare in any::<bool>(),
        ) {
            let axes = Matrix3::from_row_slice(&turn).qr().q();
            let across = if is_bare { 0.0 } else { flat_part };
            let values = [1.0, narrow, narrow * across].map(|part| part * wide * wide);
            let m = axes * Matrix3::from_diagonal(&values.into()) * axes.transpose();
            let m = [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]];
            let (expected, [least, second, greatest]) = smallest_eigenvector(m);
            prop_assume!((least - 0.1 * second).abs() > 1e-6 * second);
            let found = flat(m, 0.1);
            prop_assert_eq!(found.is_some(), least <= 0.1 * second);
            if let Some((normal, [across, narrow])) = found {
                let cos: f64 = normal.iter().zip(expected).map(|(a, b)| a * b).sum();
                prop_assert!(1.0 - cos.abs() < 1e-9, "{normal:?} {expected:?}");
                prop_assert!((across - least).abs() < 1e-10 * greatest && (narrow - second).abs() < 1e-6 * greatest);
            }
        }
    }

    #[test]
    fn what_has_no_width_is_not_flat() {
        for m in [[0.0; 6], [1.0, 0.0, 0.0, 1.0, 0.0, 1.0], [4.0, 0.0, 0.0, 0.0, 0.0, 0.0], [f64::NAN; 6]] {
            assert_eq!(flat(m, 0.1), None);
        }
    }
}
