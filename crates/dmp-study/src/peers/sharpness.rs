//! MME and MPV: how thick a map is, point by point.

use std::f64::consts::{E, PI};

use dmp_map::smallest_eigenvector;

use super::grid::Grid;
use super::options::PeerOptions;

/// MME and MPV of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSharpness {
    /// Mean over the points used of ½ ln det(2πe Σ), nats; Σ is the covariance of the neighbours. Points
    /// whose neighbours lie in a plane to the last bit have no entropy and are left out. `None` where there
    /// is none to average.
    pub mme: Option<f64>,
    /// Mean over the points used of the smallest eigenvalue of Σ, m².
    pub mpv_m2: Option<f64>,
    /// Points looked at: every [`PeerOptions::query_step`]-th that is finite.
    pub points: usize,
    /// Of these, those with enough neighbours.
    pub used: usize,
}

/// MME and MPV of `cloud` (world frame, metres; order and repetitions as they are).
///
/// Time grows with the number of points times that of their neighbours.
pub fn map_sharpness(cloud: &[[f64; 3]], options: &PeerOptions) -> MapSharpness {
    let grid = Grid::new(cloud, options.radius_m);
    let step = options.query_step.max(1);
    let values: Vec<Option<(Option<f64>, f64)>> = grid.map_cells(|given, point, around| {
        given.is_multiple_of(step).then(|| {
            let moments = around.moments(point);
            (moments.count > options.min_neighbours.max(1)).then(|| {
                let covariance = moments.covariance();
                (entropy(covariance), smallest_eigenvector(covariance).1[0])
            })
        })
    });
    let used = || values.iter().flatten();
    MapSharpness {
        mme: mean(used().filter_map(|value| value.0)),
        mpv_m2: mean(used().map(|value| value.1)),
        points: values.len(),
        used: used().count(),
    }
}

/// ½ ln det(2πe Σ) of a symmetric Σ (xx, xy, xz, yy, yz, zz): the entropy of a Gaussian, nats. `None` where
/// the determinant is not positive.
fn entropy([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Option<f64> {
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let scale = 2.0 * PI * E;
    (determinant > 0.0).then(|| 0.5 * libm::log(scale * scale * scale * determinant))
}

/// The mean of values in their order; `None` of none.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u64);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::grid::tests::random;
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    /// A floor and two walls as a scanner sees them, far from the world's origin.
    pub(in super::super) fn corner(points: usize, thick_m: f64) -> Vec<[f64; 3]> {
        let mut next = random(3);
        (0..points)
            .map(|k| {
                let mut point = [8.0 * next(), 8.0 * next(), 8.0 * next()];
                point[k % 3] = thick_m * (next() + next() + next() - 1.5);
                [point[0] + 4.5e5, point[1] - 3e6, point[2] + 120.0]
            })
            .collect()
    }

    /// The covariance from its definition.
    pub(in super::super) fn covariance(
        cloud: &[[f64; 3]],
        centre: [f64; 3],
        radius_m: f64,
    ) -> (usize, Matrix3<f64>) {
        let near: Vec<Vector3<f64>> = cloud
            .iter()
            .map(|&p| Vector3::from(p) - Vector3::from(centre))
            .filter(|offset| offset.norm() < radius_m)
            .collect();
        let mean = near.iter().sum::<Vector3<f64>>() / near.len() as f64;
        let sum: Matrix3<f64> = near.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
        (near.len(), sum / (near.len() as f64 - 1.0))
    }

    #[test]
    fn both_are_those_of_the_definition() {
        let mut cloud = corner(3000, 0.05);
        cloud.extend([[0.0; 3], [0.5, 0.0, 0.0], [f64::NAN; 3]]);
        let (mut entropies, mut variances) = (Vec::new(), Vec::new());
        for &point in &cloud[..cloud.len() - 1] {
            let (count, covariance) = covariance(&cloud, point, 1.0);
            if count > 5 {
                entropies.push(0.5 * libm::log((2.0 * PI * E * covariance).determinant()));
                variances.push(covariance.symmetric_eigenvalues().min());
            }
        }
        let of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let got = map_sharpness(&cloud, &PeerOptions::default());
        assert!((got.mme.unwrap() - of(&entropies)).abs() < 1e-9, "{got:?} {}", of(&entropies));
        assert!((got.mpv_m2.unwrap() - of(&variances)).abs() < 1e-9, "{got:?} {}", of(&variances));
        assert_eq!((got.points, got.used), (3002, variances.len()));
        assert!(variances.len() > 2900);
    }

    #[test]
    fn a_sharper_map_scores_lower() {
        let scores = [0.01, 0.02, 0.1].map(|m| map_sharpness(&corner(4000, m), &PeerOptions::default()));
        assert!(scores.is_sorted_by(|a, b| a.mme < b.mme && a.mpv_m2 < b.mpv_m2), "{scores:?}");
        // Across a single wall the variance is that of its thickness: three even spreads of a centimetre.
        let mut next = random(9);
        let mut spread = || 0.01 * (next() + next() + next() - 1.5);
        let wall = (0..6400).map(|k| [f64::from(k % 80) / 10.0, f64::from(k / 80) / 10.0, spread()]);
        let wall = map_sharpness(&wall.collect::<Vec<_>>(), &PeerOptions::default()).mpv_m2.unwrap();
        assert!((wall / (3.0 * 1e-4 / 12.0) - 1.0).abs() < 0.05, "{wall}");
    }

    #[test]
    fn fewer_queries_ask_the_whole_cloud() {
        let cloud = corner(2000, 0.05);
        let got = map_sharpness(&cloud, &PeerOptions { query_step: 10, ..PeerOptions::default() });
        let variances = cloud.iter().step_by(10).map(|&point| covariance(&cloud, point, 1.0));
        let variances: Vec<f64> =
            variances.filter(|(count, _)| *count > 5).map(|(_, c)| c.symmetric_eigenvalues().min()).collect();
        let expected = variances.iter().sum::<f64>() / variances.len() as f64;
        assert_eq!((got.points, got.used), (200, variances.len()));
        assert!((got.mpv_m2.unwrap() - expected).abs() < 1e-9, "{got:?} {expected}");
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let cloud = corner(5000, 0.05);
        let of = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| map_sharpness(&cloud, &PeerOptions::default()))
        };
        assert_eq!(of(1), of(3));
    }

    #[test]
    fn nothing_to_look_at_has_no_score() {
        let empty = MapSharpness { mme: None, mpv_m2: None, points: 0, used: 0 };
        assert_eq!(map_sharpness(&[], &PeerOptions::default()), empty);
        let flat: Vec<[f64; 3]> =
            (0..50).map(|k| [f64::from(k % 7) / 8.0, f64::from(k / 7) / 8.0, 0.0]).collect();
        let flat = map_sharpness(&flat, &PeerOptions::default());
        assert_eq!((flat.mme, flat.mpv_m2), (None, Some(0.0)));
    }
}
