//! Computes the normal of a cloud: the eigenvector of its covariance's smallest eigenvalue.

/// The eigenvector of the smallest eigenvalue of a symmetric 3×3 matrix (xx, xy, xz, yy, yz, zz), of
/// unit length, its largest component positive; and the three eigenvalues, ascending.
///
/// Cyclic Jacobi rotations: only + − × ÷ and square roots, so the same bits everywhere.
pub fn smallest_eigenvector(m: [f64; 6]) -> ([f64; 3], [f64; 3]) {
    let mut a = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Convergence is quadratic; four sweeps reach rounding error for 3×3, eight are a bound.
    for _ in 0..8 {
        let off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        let diagonal = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if off <= diagonal * 1e-32 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let k = order[0];
    let mut normal = [v[0][k], v[1][k], v[2][k]];
    let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
    let largest = normal.into_iter().fold(0.0, |m: f64, c| if c.abs() > m.abs() { c } else { m });
    let scale = if largest < 0.0 { -1.0 / length } else { 1.0 / length };
    normal = normal.map(|c| c * scale);
    (normal, order.map(|i| a[i][i]))
}

fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (row_p, row_q) = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * row_p[k] - s * row_q[k]);
    a[q] = std::array::from_fn(|k| s * row_p[k] + c * row_q[k]);
    for row in v.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_eigenvector(b in prop::array::uniform9(-1e4..1e4_f64), flat in 0.0..1.0_f64) {
            let mut b = Matrix3::from_row_slice(&b);
            b.row_mut(2).scale_mut(flat);
            let m = b.transpose() * b;
            let (normal, values) = smallest_eigenvector([m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]]);
            let n = Vector3::from(normal);
            let residual = (m * n - n * values[0]).norm();
            prop_assert!((n.norm() - 1.0).abs() < 1e-12);
            prop_assert!(residual <= 1e-9 * m.norm(), "{residual}");
            prop_assert!(values[0] <= values[1] && values[1] <= values[2]);
            prop_assert!((values.iter().sum::<f64>() - m.trace()).abs() <= 1e-9 * m.norm());
        }
    }

    #[test]
    fn degenerate_matrices_give_some_unit_vector() {
        for m in [[0.0; 6], [1.0, 0.0, 0.0, 1.0, 0.0, 1.0], [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]] {
            let (n, _) = smallest_eigenvector(m);
            assert!((n.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
