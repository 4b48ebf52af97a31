//! Which visits of a run see one place, by its own path and poses.

use std::collections::BTreeMap;

use dmp_sensor::{Isometry3, Vector3};

/// Least number of visits between those of a pair: neighbours share surfaces, which drift distorts
/// together.
const LAG: usize = 5;
/// Least ratio of the distance travelled between them to their distance: so they are not neighbours on one
/// path.
const WAY_PER_DISTANCE: f64 = 4.0;
/// Cameras with other viewing directions see other surfaces: largest rotation between two visits, as a
/// cosine.
const SAME_VIEW_COS: f64 = 0.707;

/// Two visits to a place, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisitPair {
    /// The earlier one.
    pub first: usize,
    /// The later one.
    pub second: usize,
    /// Distance between them, metres.
    pub apart_m: f64,
}

/// Consecutive visits of a run, each with its middle scan.
#[derive(Debug, Clone, Default)]
pub struct Visits {
    /// `world_from_sensor` of each.
    pub poses: Vec<Isometry3<f64>>,
    /// The path length up to each, metres.
    pub along_m: Vec<f64>,
}

impl Visits {
    /// The distance between two visits, metres, and the cosine of the angle between them.
    fn apart(&self, a: usize, b: usize) -> (f64, f64) {
        let (a, b) = (&self.poses[a], &self.poses[b]);
        let cos_of_half = a.rotation.coords.dot(&b.rotation.coords);
        let distance_m = (a.translation.vector - b.translation.vector).norm();
        (distance_m, 2.0 * cos_of_half * cos_of_half - 1.0)
    }

    /// The heading at a visit: from the visit before it to the one after.
    pub fn heading(&self, visit: usize) -> Vector3<f64> {
        let place = |visit: usize| self.poses.get(visit).map(|pose| pose.translation.vector);
        let here = place(visit).unwrap_or_default();
        let before = visit.checked_sub(1).and_then(place).unwrap_or(here);
        place(visit + 1).unwrap_or(here) - before
    }

    /// Every place visited twice, as one pair per two visits: of neighbouring near visits the nearest one, seen
    /// from either side. They lie at most `near_m` from each other.
    pub fn pairs(&self, near_m: f64, is_camera: bool) -> Vec<VisitPair> {
        let nearest = self.nearest(near_m, is_camera);
        let mut pairs = Vec::new();
        for (first, rows) in nearest.iter().enumerate() {
            for &(second, apart_m) in rows.iter().filter(|(second, _)| *second > first) {
                if nearest[second].iter().any(|&(back, _)| back == first) {
                    pairs.push(VisitPair { first, second, apart_m });
                }
            }
        }
        pairs
    }

    /// For each visit whether its place has another one, earlier or later, at most `near_m` away. There is one if and only if
    /// there are [`Self::pairs`].
    pub fn have_another(&self, near_m: f64, is_camera: bool) -> Vec<bool> {
        self.nearest(near_m, is_camera).iter().map(|rows| !rows.is_empty()).collect()
    }

    /// For each visit the near others, earlier and later, reduced to the nearest of each row of neighbours: with the distance.
    fn nearest(&self, near_m: f64, is_camera: bool) -> Vec<Vec<(usize, f64)>> {
        let near = |a: usize, b: usize| {
            let (apart_m, turned_cos) = self.apart(a, b);
            let way_m = (self.along_m[b] - self.along_m[a]).abs();
            let is_near = apart_m <= near_m && WAY_PER_DISTANCE * apart_m <= way_m;
            (is_near && !(is_camera && turned_cos < SAME_VIEW_COS)).then_some(apart_m)
        };
        let mut nearest: Vec<Vec<(usize, f64)>> = Vec::with_capacity(self.poses.len());
        let grid = Grid::new(&self.poses, near_m);
        for visit in 0..self.poses.len() {
            let mut rows: Vec<(usize, f64)> = Vec::new();
            let mut last = None;
            for other in grid.near(visit) {
                if other.abs_diff(visit) < LAG {
                    continue;
                }
                let Some(apart_m) = near(visit.min(other), visit.max(other)) else { continue };
                let goes_on = last.is_some_and(|last| last + 1 == other);
                last = Some(other);
                match rows.last_mut() {
                    Some(row) if goes_on => {
                        if apart_m < row.1 {
                            *row = (other, apart_m);
                        }
                    }
                    _ => rows.push((other, apart_m)),
                }
            }
            nearest.push(rows);
        }
        nearest
    }
}

/// The first of a visit's scans, by their positions in `ordinals`, at a part of its path, or of their number where the sensor
/// stands.
pub fn at_part(ordinals: &[usize], along_m: &[f64], part: f64) -> usize {
    let Some(last) = ordinals.len().checked_sub(1) else { return 0 };
    let (first_m, last_m) = (along_m[ordinals[0]], along_m[ordinals[last]]);
    let wanted_m = first_m + part * (last_m - first_m);
    if last_m > first_m {
        ordinals.partition_point(|&ordinal| along_m[ordinal] < wanted_m).min(last)
    } else {
        (part * last as f64) as usize
    }
}

/// Visits by their cells, so that few are compared on a long drive.
struct Grid(BTreeMap<[i64; 3], Vec<usize>>, Vec<[i64; 3]>);

impl Grid {
    fn new(poses: &[Isometry3<f64>], edge_m: f64) -> Self {
        let cell = |pose: &Isometry3<f64>| {
            let place = pose.translation.vector;
            [place.x, place.y, place.z].map(|c| (c / edge_m).floor() as i64)
        };
        let cells: Vec<[i64; 3]> = poses.iter().map(cell).collect();
        let mut by_cell: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
        for (visit, cell) in cells.iter().enumerate() {
            by_cell.entry(*cell).or_default().push(visit);
        }
        Self(by_cell, cells)
    }

    /// Those that are near, and some more, ascending.
    fn near(&self, visit: usize) -> Vec<usize> {
        let [x, y, z] = self.1[visit];
        let beside = |cell: i64| cell.saturating_sub(1)..=cell.saturating_add(1);
        let mut near = Vec::new();
        for beside_x in beside(x) {
            for beside_y in beside(y) {
                let column =
                    [beside_x, beside_y, *beside(z).start()]..=[beside_x, beside_y, *beside(z).end()];
                near.extend(self.0.range(column).flat_map(|(_, visits)| visits));
            }
        }
        near.sort_unstable();
        near
    }
}

#[cfg(test)]
mod tests;
