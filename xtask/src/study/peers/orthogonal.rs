//! MOM: how thick the map is around planes at right angles to each other.

use dmp_map::smallest_eigenvector;
use rayon::prelude::*;

use super::grid::{Grid, covariance, dot};
use super::ward::ward;

/// A point is on a plane when so many times the smallest eigenvalue is below the middle one.
const PLANAR: f64 = 100.0;
/// A plane takes more points than this.
const PLANE_POINTS: usize = 3;
/// A normal comes from so many nearest neighbours (`MAX_NN` of map-metrics).
const NORMAL_NEIGHBOURS: usize = 30;
/// A direction has more planar points than this (`MIN_CLUST_SIZE`).
const MIN_CLUSTER: usize = 5;
/// At most so many planar points are clustered, every n-th.
const MAX_CLUSTERED: usize = 10_000;
/// Normals are clustered up to this height of Ward's criterion.
const CLUSTER_HEIGHT: f64 = 0.1;
/// Two directions are orthogonal when the cosine between them is smaller.
const COSINE: f64 = 0.1;

/// Points of a scan on planes of three orthogonal directions, as indices by direction: the most points there are. `None`
/// where no three directions are orthogonal.
pub(super) fn orthogonal_planes(scan: &[[f64; 3]]) -> Option<[Vec<usize>; 3]> {
    let grid = Grid::new(scan);
    let of_point = |(k, point): (usize, &[f64; 3])| Some((k, normal(grid.offsets(point))?));
    let planar: Vec<(usize, [f64; 3])> = scan.par_iter().enumerate().filter_map(of_point).collect();
    let step = planar.len().div_ceil(MAX_CLUSTERED).max(1);
    let (given, normals): (Vec<usize>, Vec<[f64; 3]>) = planar.into_iter().step_by(step).unzip();
    let mut clusters = ward(&normals, CLUSTER_HEIGHT);
    clusters.retain(|members| members.len() > MIN_CLUSTER);
    let directions: Vec<[f64; 3]> = clusters.iter().map(|members| direction(members, &normals)).collect();
    let orthogonal = |a: usize, b: usize| dot(&directions[a], &directions[b]).abs() < COSINE;
    let mut best = (0, None);
    for a in 0..clusters.len() {
        for b in (a + 1..clusters.len()).filter(|&b| orthogonal(a, b)) {
            for c in (b + 1..clusters.len()).filter(|&c| orthogonal(a, c) && orthogonal(b, c)) {
                let size = [a, b, c].map(|k| clusters[k].len()).iter().sum();
                best = if size > best.0 { (size, Some([a, b, c])) } else { best };
            }
        }
    }
    Some(best.1?.map(|k| clusters[k].iter().map(|&member| given[member]).collect()))
}

/// The normal of a point on a plane, from the offsets of its neighbours; its largest component is positive.
fn normal(mut offsets: Vec<[f64; 3]>) -> Option<[f64; 3]> {
    let values = (offsets.len() > PLANE_POINTS).then(|| smallest_eigenvector(covariance(&offsets)).1)?;
    if PLANAR * values[0] >= values[1] {
        return None;
    }
    offsets.sort_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
    offsets.truncate(NORMAL_NEIGHBOURS);
    Some(smallest_eigenvector(covariance(&offsets)).0)
}

/// The mean of unit vectors, of unit length.
fn direction(members: &[usize], normals: &[[f64; 3]]) -> [f64; 3] {
    let sum: [f64; 3] = std::array::from_fn(|c| members.iter().map(|&k| normals[k][c]).sum());
    let length = dot(&sum, &sum).sqrt();
    sum.map(|c| c / length)
}

/// MOM of a map, m²: for each direction the median over its places of the smallest eigenvalue of the covariance of the map's
/// points around them, added up. `None` where a direction has no place with neighbours.
pub(super) fn mutually_orthogonal(cloud: &[[f64; 3]], planes: &[Vec<[f64; 3]>; 3]) -> Option<f64> {
    let grid = Grid::new(cloud);
    let variance = |place: &[f64; 3]| {
        let offsets = grid.offsets(place);
        (offsets.len() > PLANE_POINTS).then(|| smallest_eigenvector(covariance(&offsets)).1[0])
    };
    planes.iter().map(|places| median(places.par_iter().filter_map(variance).collect())).sum()
}

/// The mean of the two in the middle where the number is even.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(f64::midpoint(values[last / 2], values[values.len() / 2]))
}

#[cfg(test)]
mod tests {
    use super::super::sharpness::tests::{by_definition, corner};
    use super::*;

    fn places_of(scan: &[[f64; 3]]) -> [Vec<[f64; 3]>; 3] {
        orthogonal_planes(scan).unwrap().map(|points| points.iter().map(|&k| scan[k]).collect())
    }

    #[test]
    fn it_is_that_of_the_definition() {
        let mut cloud = corner(3000, 0.01);
        let mut places = places_of(&cloud);
        assert!(places.iter().map(Vec::len).sum::<usize>() > 1500);
        cloud.extend(corner(2000, 0.03));
        let expected: f64 = (places.iter())
            .map(|places| {
                let around = places.iter().map(|&place| by_definition(&cloud, place));
                let around = around.filter(|(count, _)| *count > 3);
                median(around.map(|(_, covariance)| covariance.symmetric_eigenvalues().min()).collect())
                    .unwrap()
            })
            .sum();
        let got = mutually_orthogonal(&cloud, &places).unwrap();
        assert!((got - expected).abs() < 1e-9 && expected > 1e-6, "{got} {expected}");
        places[1] = vec![[0.0; 3]];
        assert_eq!(mutually_orthogonal(&cloud, &places), None);
        assert_eq!(orthogonal_planes(&[[0.0; 3]; 9]), None);
    }

    #[test]
    fn a_doubled_corner_scores_higher() {
        let scan = corner(3000, 0.005);
        let places = places_of(&scan);
        let scores = [0.0, 0.03, 0.1, 0.3].map(|shift_m| {
            let second = corner(2500, 0.005).into_iter().map(|p| p.map(|c| c + shift_m));
            let cloud: Vec<[f64; 3]> = scan.iter().copied().chain(second).collect();
            mutually_orthogonal(&cloud, &places).unwrap()
        });
        assert!(scores.is_sorted_by(|a, b| a < b), "{scores:?}");
    }
}
