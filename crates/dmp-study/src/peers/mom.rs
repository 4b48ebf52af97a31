//! MOM: how thick the map is around planes at right angles to each other.

use dmp_map::smallest_eigenvector;
use rayon::prelude::*;

use super::grid::Grid;
use super::options::PeerOptions;
use super::orthogonal::PLANE_POINTS;

/// MOM of a map, m²: for each direction the median over its points of the smallest eigenvalue of the
/// covariance of the map's points around them, added up (Kornilova & Ferrer 2021, section III).
///
/// `cloud` is the map and `planes` the places to look at, both in the world frame, metres; the places are
/// those of an [`OrthogonalSubset`](super::OrthogonalSubset), one list a direction. Points with three
/// neighbours or fewer are left out. `None` where a direction has no other.
pub fn mutually_orthogonal(
    cloud: &[[f64; 3]],
    planes: &[Vec<[f64; 3]>],
    options: &PeerOptions,
) -> Option<f64> {
    let grid = Grid::new(cloud, options.radius_m);
    let variance = |point: &[f64; 3]| {
        let moments = grid.around(*point).moments(*point);
        (moments.count > PLANE_POINTS).then(|| smallest_eigenvector(moments.covariance()).1[0])
    };
    let medians = planes.iter().map(|points| median(points.par_iter().filter_map(variance).collect()));
    (!planes.is_empty()).then(|| medians.sum()).flatten()
}

/// The mean of the two in the middle where there is no one.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(f64::midpoint(values[last / 2], values[values.len() / 2]))
}

#[cfg(test)]
mod tests {
    use super::super::orthogonal_subset;
    use super::super::sharpness::tests::{corner, covariance};
    use super::*;

    fn planes_of(scan: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
        let subset = orthogonal_subset(scan, &PeerOptions::default()).unwrap();
        subset.points.iter().map(|points| points.iter().map(|&k| scan[k]).collect()).collect()
    }

    #[test]
    fn it_is_that_of_the_definition() {
        let mut cloud = corner(3000, 0.01);
        let planes = planes_of(&cloud);
        cloud.extend(corner(2000, 0.03));
        let mut expected = 0.0;
        for points in &planes {
            let mut values: Vec<f64> = points
                .iter()
                .map(|&point| covariance(&cloud, point, 1.0))
                .filter(|(count, _)| *count > 3)
                .map(|(_, covariance)| covariance.symmetric_eigenvalues().min())
                .collect();
            values.sort_by(f64::total_cmp);
            let n = values.len();
            expected +=
                if n % 2 == 1 { values[n / 2] } else { f64::midpoint(values[n / 2 - 1], values[n / 2]) };
        }
        let got = mutually_orthogonal(&cloud, &planes, &PeerOptions::default()).unwrap();
        assert!((got - expected).abs() < 1e-9 && expected > 1e-6, "{got} {expected}");
    }

    #[test]
    fn a_doubled_corner_scores_higher() {
        let scan = corner(3000, 0.005);
        let planes = planes_of(&scan);
        let of = |shift_m: f64| {
            let second = corner(2500, 0.005).into_iter().map(|p| p.map(|c| c + shift_m));
            let cloud: Vec<[f64; 3]> = scan.iter().copied().chain(second).collect();
            mutually_orthogonal(&cloud, &planes, &PeerOptions::default()).unwrap()
        };
        let scores = [0.0, 0.03, 0.1, 0.3].map(of);
        assert!(scores.is_sorted_by(|a, b| a < b), "{scores:?}");
    }

    #[test]
    fn a_direction_without_neighbours_has_no_score() {
        let cloud = corner(3000, 0.01);
        let mut planes = planes_of(&cloud);
        planes[1] = vec![[0.0; 3]];
        assert_eq!(mutually_orthogonal(&cloud, &planes, &PeerOptions::default()), None);
        assert_eq!(mutually_orthogonal(&cloud, &[], &PeerOptions::default()), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
