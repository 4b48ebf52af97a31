//! MME and MPV: entropy and thickness of the neighbourhoods of a map's points.

use std::f64::consts::{E, PI};

use dmp_map::smallest_eigenvector;
use rayon::prelude::*;

use super::grid::{Grid, covariance};

/// Points with more neighbours than this are used, themselves included (`MIN_KNN` of map-metrics).
const MIN_NEIGHBOURS: usize = 5;

/// MME, nats, and MPV, m²: means over the points of ½ ln det(2πe Σ) and of the smallest eigenvalue of Σ, the covariance of
/// the neighbours. A flat neighbourhood has no entropy.
pub(super) fn sharpness(cloud: &[[f64; 3]]) -> (Option<f64>, Option<f64>) {
    let grid = Grid::new(cloud);
    let of_point = |point: &[f64; 3]| {
        let offsets = grid.offsets(point);
        (offsets.len() > MIN_NEIGHBOURS).then(|| {
            let covariance = covariance(&offsets);
            (entropy(covariance), smallest_eigenvector(covariance).1[0])
        })
    };
    let values: Vec<(Option<f64>, f64)> = cloud.par_iter().filter_map(of_point).collect();
    (mean(values.iter().filter_map(|value| value.0)), mean(values.iter().map(|value| value.1)))
}

fn entropy([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Option<f64> {
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    (determinant > 0.0).then(|| 0.5 * ((2.0 * PI * E).powi(3) * determinant).ln())
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::super::consistency::mix;
    use super::*;
    use dmp_sensor::{Matrix3, Vector3};

    /// Evenly spread numbers from 0 to 1.
    pub(in super::super) fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state += 1;
            (mix(state) >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// A floor and two walls as a scanner sees them, far from the world's origin.
    pub(in super::super) fn corner(points: usize, thick_m: f64) -> Vec<[f64; 3]> {
        let mut next = random(3);
        let mut point = |k: usize| {
            let mut point = [8.0 * next(), 8.0 * next(), 8.0 * next()];
            point[k % 3] = thick_m * (next() + next() + next() - 1.5);
            [point[0] + 4.5e5, point[1] - 3e6, point[2] + 120.0]
        };
        (0..points).map(&mut point).collect()
    }

    /// The number of neighbours and their covariance, from the definition.
    pub(in super::super) fn by_definition(cloud: &[[f64; 3]], centre: [f64; 3]) -> (usize, Matrix3<f64>) {
        let offsets = cloud.iter().map(|&p| Vector3::from(p) - Vector3::from(centre));
        let near: Vec<Vector3<f64>> = offsets.filter(|offset| offset.norm() < 1.0).collect();
        let mean = near.iter().sum::<Vector3<f64>>() / near.len() as f64;
        let sum: Matrix3<f64> = near.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
        (near.len(), sum / (near.len() as f64 - 1.0))
    }

    #[test]
    fn both_are_those_of_the_definition() {
        let mut cloud = corner(3000, 0.05);
        cloud.extend([[0.0; 3], [0.5, 0.0, 0.0]]);
        let (mut entropies, mut variances) = (Vec::new(), Vec::new());
        for &point in &cloud {
            let (count, covariance) = by_definition(&cloud, point);
            if count > 5 {
                entropies.push(0.5 * (2.0 * PI * E * covariance).determinant().ln());
                variances.push(covariance.symmetric_eigenvalues().min());
            }
        }
        assert!(variances.len() > 2900 && variances.len() < cloud.len());
        let expected = [entropies, variances].map(|of| mean(of.into_iter()).unwrap());
        let (mme, mpv_m2) = sharpness(&cloud);
        for (got, expected) in [mme, mpv_m2].into_iter().zip(expected) {
            assert!((got.unwrap() - expected).abs() < 1e-9, "{got:?} {expected}");
        }
    }

    #[test]
    fn a_sharper_map_scores_lower_and_an_empty_one_has_no_score() {
        let scores = [0.01, 0.02, 0.1].map(|thick_m| sharpness(&corner(4000, thick_m)));
        assert!(scores.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{scores:?}");
        assert_eq!(sharpness(&[]), (None, None));
        let flat: Vec<_> = (0..50).map(|k| [f64::from(k % 7) / 8.0, f64::from(k / 7) / 8.0, 0.0]).collect();
        assert_eq!(sharpness(&flat), (None, Some(0.0)));
    }
}
