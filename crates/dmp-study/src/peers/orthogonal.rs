//! Planes of a scan that stand at right angles to each other.

use dmp_map::smallest_eigenvector;

use super::grid::Grid;
use super::options::PeerOptions;
use super::ward::ward;

/// A point is on a plane when so many times the smallest eigenvalue is below the middle one.
const PLANAR: f64 = 100.0;
/// A plane takes more points than this.
pub(super) const PLANE_POINTS: usize = 3;
/// Normals are clustered up to this height of Ward's criterion.
const CLUSTER_HEIGHT: f64 = 0.1;
/// Two directions are orthogonal when the cosine between them is smaller.
const COSINE: f64 = 0.1;

/// Points of a scan on three groups of planes that are mutually orthogonal.
#[derive(Debug, Clone, PartialEq)]
pub struct OrthogonalSubset {
    /// For each of the three directions, its points: ascending indices into the scan.
    pub points: [Vec<usize>; 3],
    /// The directions: unit normals, in the frame of the scan's points.
    pub normals: [[f64; 3]; 3],
}

impl OrthogonalSubset {
    /// Number of points of all three directions.
    pub fn count(&self) -> usize {
        self.points.iter().map(Vec::len).sum()
    }
}

/// Why a scan has no such points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "{planar} of {points} points lie on planes, in {directions} directions; no three of them are orthogonal"
)]
pub struct NoOrthogonalSubset {
    /// Points of the scan.
    pub points: usize,
    /// Points on planes.
    pub planar: usize,
    /// Directions with enough points.
    pub directions: usize,
}

/// The largest group of planar points of a scan in three mutually orthogonal directions (Kornilova &
/// Ferrer 2021, section III).
///
/// `scan` is in metres, in any frame that does not depend on what is to be compared, or whose dependence
/// does not matter. Of the planar points at most [`PeerOptions::max_clustered`] are looked at, every n-th.
///
/// # Errors
/// When no three directions with enough points are mutually orthogonal.
pub fn orthogonal_subset(
    scan: &[[f64; 3]],
    options: &PeerOptions,
) -> Result<OrthogonalSubset, NoOrthogonalSubset> {
    let mut planar = planar_points(scan, options);
    let all_planar = planar.len();
    let step = all_planar.div_ceil(options.max_clustered.max(1)).max(1);
    planar.sort_unstable_by_key(|&(given, _)| given);
    let planar: Vec<(usize, [f64; 3])> = planar.into_iter().step_by(step).collect();

    let normals: Vec<[f64; 3]> = planar.iter().map(|&(_, normal)| normal).collect();
    let mut clusters = ward(&normals, CLUSTER_HEIGHT);
    clusters.retain(|members| members.len() > options.min_cluster);
    // Largest first, so that the search below can end early; the sort is stable.
    clusters.sort_by_key(|members| std::cmp::Reverse(members.len()));
    let directions: Vec<[f64; 3]> = clusters.iter().map(|members| direction(members, &normals)).collect();
    let sizes: Vec<usize> = clusters.iter().map(Vec::len).collect();

    let none = NoOrthogonalSubset { points: scan.len(), planar: all_planar, directions: clusters.len() };
    let triangle = largest_triangle(&sizes, &directions).ok_or(none)?;
    Ok(OrthogonalSubset {
        points: triangle.map(|k| clusters[k].iter().map(|&member| planar[member].0).collect()),
        normals: triangle.map(|k| directions[k]),
    })
}

/// The points on planes, with their normals.
fn planar_points(scan: &[[f64; 3]], options: &PeerOptions) -> Vec<(usize, [f64; 3])> {
    let grid = Grid::new(scan, options.radius_m);
    grid.map_cells(|given, point, around| {
        let moments = around.moments(point);
        if moments.count <= PLANE_POINTS {
            return None;
        }
        let (_, values) = smallest_eigenvector(moments.covariance());
        if PLANAR * values[0] >= values[1] {
            return None;
        }
        let nearest = around.nearest_moments(point, options.normal_neighbours.max(3), &mut Vec::new());
        Some((given, smallest_eigenvector(nearest.covariance()).0))
    })
}

/// The mean of unit vectors, of unit length.
fn direction(members: &[usize], normals: &[[f64; 3]]) -> [f64; 3] {
    let sum =
        members.iter().fold([0.0; 3], |sum: [f64; 3], &k| std::array::from_fn(|c| sum[c] + normals[k][c]));
    // Vectors within a cluster are close to each other, so the sum is far from zero.
    let length = dot(&sum, &sum).sqrt();
    sum.map(|c| c / length)
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Three mutually orthogonal directions of the largest total size; of equals, the first found. `sizes`
/// descend.
///
/// It is the largest clique too: the Gram matrix of four unit vectors whose cosines are below 0.1 has full
/// rank, which four vectors of space cannot have.
fn largest_triangle(sizes: &[usize], directions: &[[f64; 3]]) -> Option<[usize; 3]> {
    let orthogonal = |a: usize, b: usize| dot(&directions[a], &directions[b]).abs() < COSINE;
    let mut best: Option<(usize, [usize; 3])> = None;
    let beaten = |size: usize, best: &Option<(usize, [usize; 3])>| best.is_some_and(|(most, _)| size <= most);
    for a in 0..sizes.len() {
        if beaten(3 * sizes[a], &best) {
            break;
        }
        for b in a + 1..sizes.len() {
            if beaten(sizes[a] + 2 * sizes[b], &best) {
                break;
            }
            if !orthogonal(a, b) {
                continue;
            }
            // Of those that follow, the first is the largest.
            if let Some(c) = (b + 1..sizes.len()).find(|&c| orthogonal(a, c) && orthogonal(b, c)) {
                let size = sizes[a] + sizes[b] + sizes[c];
                if !beaten(size, &best) {
                    best = Some((size, [a, b, c]));
                }
            }
        }
    }
    best.map(|(_, triangle)| triangle)
}

#[cfg(test)]
mod tests {
    use super::super::grid::tests::random;
    use super::super::sharpness::tests::{corner, covariance};
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_corner_has_three_directions() {
        let scan = corner(3000, 0.005);
        let subset = orthogonal_subset(&scan, &PeerOptions::default()).unwrap();
        for (points, normal) in subset.points.iter().zip(subset.normals) {
            let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap();
            assert!(normal[axis] > 0.99, "{normal:?}");
            // The corner's k-th point lies on the plane k % 3.
            assert!(points.iter().all(|k| k % 3 == axis), "{axis}");
            assert!(points.len() > 100 && points.is_sorted());
        }
        assert_eq!(subset.count(), subset.points.iter().map(Vec::len).sum::<usize>());
        let few = PeerOptions { max_clustered: 300, ..PeerOptions::default() };
        assert!((30..=300).contains(&orthogonal_subset(&scan, &few).unwrap().count()));
    }

    #[test]
    fn planar_points_are_those_of_the_definition() {
        let scan = corner(900, 0.05);
        let mut got = planar_points(&scan, &PeerOptions { normal_neighbours: 900, ..PeerOptions::default() });
        got.sort_by_key(|point| point.0);
        let mut expected = Vec::new();
        for (k, &point) in scan.iter().enumerate() {
            let (count, covariance) = covariance(&scan, point, 1.0);
            let eigen = covariance.symmetric_eigen();
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
            if count > 3 && 100.0 * eigen.eigenvalues[order[0]] < eigen.eigenvalues[order[1]] {
                expected.push((k, eigen.eigenvectors.column(order[0]).into_owned()));
            }
        }
        assert!(expected.len() > 100 && expected.len() < 800);
        assert_eq!(got.len(), expected.len());
        for ((k, normal), (expected_k, expected_normal)) in got.iter().zip(&expected) {
            assert_eq!(k, expected_k);
            assert!(1.0 - Vector3::from(*normal).dot(expected_normal).abs() < 1e-9);
        }
    }

    #[test]
    fn the_triangle_is_the_largest_of_all() {
        for seed in 0..50 {
            let mut next = random(seed);
            let mut sizes: Vec<usize> = (0..40).map(|_| 6 + (20.0 * next()) as usize).collect();
            sizes.sort_unstable_by(|a, b| b.cmp(a));
            let directions: Vec<[f64; 3]> = (0..40)
                .map(|_| Vector3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize().into())
                .collect();
            let orthogonal = |a: usize, b: usize| {
                Vector3::from(directions[a]).dot(&Vector3::from(directions[b])).abs() < 0.1
            };
            let mut most = None;
            for a in 0..40 {
                for b in 0..a {
                    for c in 0..b {
                        if orthogonal(a, b) && orthogonal(a, c) && orthogonal(b, c) {
                            most = most.max(Some(sizes[a] + sizes[b] + sizes[c]));
                        }
                    }
                }
            }
            let got = largest_triangle(&sizes, &directions).map(|t| t.map(|k| sizes[k]).iter().sum());
            assert_eq!(got, most);
        }
    }

    #[test]
    fn a_floor_alone_has_none() {
        let floor: Vec<[f64; 3]> =
            (0..900).map(|k| [f64::from(k % 30) / 4.0, f64::from(k / 30) / 4.0, 0.0]).collect();
        let error = orthogonal_subset(&floor, &PeerOptions::default()).unwrap_err();
        assert_eq!(error, NoOrthogonalSubset { points: 900, planar: 900, directions: 1 });
        let error = orthogonal_subset(&[], &PeerOptions::default()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "0 of 0 points lie on planes, in 0 directions; no three of them are orthogonal"
        );
    }
}
