//! Finds the places that a run visits twice, by its own path and poses.

use dmp_runs::{PlannedFrame, RunPath, RunPoses};
use dmp_sensor::{Isometry3, Vector3};

/// Least number of segments between the visits of a pair: neighbours share surfaces, which drift distorts
/// together.
const LAG: usize = 5;
/// Least ratio of the distance travelled between them to their distance: so they are not neighbours on one
/// path.
const WAY_PER_DISTANCE: f64 = 4.0;
/// Cameras with other viewing directions see other surfaces: largest rotation between two visits, as a
/// cosine.
const SAME_VIEW_COS: f64 = 0.707;
/// Approximate number of returns used of a visit: of more, each scan is subsampled.
pub(super) const RETURNS: u64 = 120_000;
/// Part of a segment that is its visit, around its middle: distortion within a visit is not measured as
/// drift.
const PART: f64 = 0.5;
/// Least number of consecutive scans of a visit, and most scans, spread over it.
const LEAST_SCANS: usize = 3;
const SCANS: usize = 12;
/// Number of visits of a path that is not cut into segments.
const STRETCHES: usize = 16;

/// A segment of the path as a visit to the place in its middle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Visit {
    /// Its middle scan, whose pose is that of the visit: its ordinal in the plan.
    pub(super) middle: usize,
    /// Some of its scans, the middle among them, ascending.
    pub(super) scans: Vec<usize>,
}

/// Two visits to a place, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisitPair {
    pub(super) first: usize,
    pub(super) second: usize,
    /// Distance between them, metres.
    pub(super) apart_m: f64,
}

/// The visits of a run: its segments.
pub(super) fn visits(frames: &[PlannedFrame], path: &RunPath, is_camera: bool) -> Vec<Visit> {
    let posed: Vec<usize> = (0..frames.len()).filter(|&ordinal| path.has(ordinal)).collect();
    let starts: Vec<usize> = if path.segments.length.is_some() {
        path.segments.starts.iter().map(|&start| posed.partition_point(|&ordinal| ordinal < start)).collect()
    } else {
        let count = STRETCHES.min(posed.len());
        (0..count).map(|k| k * posed.len() / count).collect()
    };
    let ends = starts.iter().skip(1).copied().chain([posed.len()]);
    let returns = |ordinal: usize| frames[ordinal].returns;
    let visit =
        |(&start, end): (&usize, usize)| Visit::of(&posed[start..end], &path.along_m, returns, is_camera);
    starts.iter().zip(ends).map(visit).collect()
}

impl Visit {
    /// Selects scans of a segment. If a few have enough returns, they are the ones next to the middle, which
    /// mostly lie together in the log. Otherwise, and for a camera with its small view, they are at equal
    /// steps of distance, or of their number if the sensor stands.
    fn of(ordinals: &[usize], along_m: &[f64], returns: impl Fn(usize) -> u64, is_camera: bool) -> Self {
        let last = ordinals.len() - 1;
        let (first_m, last_m) = (along_m[ordinals[0]], along_m[ordinals[last]]);
        let at = |part: f64| {
            let wanted_m = first_m + part * (last_m - first_m);
            if last_m > first_m {
                ordinals.partition_point(|&ordinal| along_m[ordinal] < wanted_m).min(last)
            } else {
                (part * last as f64) as usize
            }
        };
        let middle = at(0.5);
        let enough = RETURNS.div_ceil(returns(ordinals[middle]).max(1)) as usize;
        let scans = if !is_camera && enough < SCANS / 2 {
            let beside = (enough.max(LEAST_SCANS) / 2).min(ordinals.len() / 2);
            (middle.saturating_sub(beside)..(middle + beside + 1).min(ordinals.len())).collect()
        } else {
            let spread = (0..SCANS).map(|k| at(0.5 + PART * ((k as f64 + 0.5) / SCANS as f64 - 0.5)));
            let mut scans: Vec<usize> = spread.chain([middle]).collect();
            scans.sort_unstable();
            scans.dedup();
            scans
        };
        let scans = scans.into_iter().map(|k: usize| ordinals[k]).collect();
        Self { middle: ordinals[middle], scans }
    }
}

/// The sensor's pose on each visit.
pub(super) struct Places(Vec<Isometry3<f64>>);

impl Places {
    pub(super) fn new(visits: &[Visit], frames: &[PlannedFrame], poses: &RunPoses) -> Self {
        // A visit is of scans with poses.
        let place = |visit: &Visit| poses.of_frame(&frames[visit.middle]).unwrap_or_default();
        Self(visits.iter().map(place).collect())
    }

    /// `world_from_sensor` on a visit.
    pub(super) fn of(&self, visit: usize) -> &Isometry3<f64> {
        &self.0[visit]
    }

    /// The distance between two visits, metres, and the cosine of the angle between them.
    fn apart(&self, a: usize, b: usize) -> (f64, f64) {
        let (a, b) = (self.of(a), self.of(b));
        let cos_of_half = a.rotation.coords.dot(&b.rotation.coords);
        let distance_m = (a.translation.vector - b.translation.vector).norm();
        (distance_m, 2.0 * cos_of_half * cos_of_half - 1.0)
    }

    /// The heading at a visit: from the visit before it to the one after.
    pub(super) fn heading(&self, visit: usize) -> Vector3<f64> {
        let place = |visit: usize| self.0.get(visit).map(|pose| pose.translation.vector);
        let here = place(visit).unwrap_or_default();
        let before = visit.checked_sub(1).and_then(place).unwrap_or(here);
        place(visit + 1).unwrap_or(here) - before
    }
}

/// Every place visited twice, as one pair per two visits: of neighbouring near segments the nearest one, seen
/// from either side. They lie at most `near_m` from each other.
pub(super) fn pairs(
    visits: &[Visit],
    places: &Places,
    along_m: &[f64],
    near_m: f64,
    is_camera: bool,
) -> Vec<VisitPair> {
    let near = |a: usize, b: usize| {
        let (apart_m, turned_cos) = places.apart(a, b);
        let way_m = (along_m[visits[b].middle] - along_m[visits[a].middle]).abs();
        let is_near = apart_m <= near_m && WAY_PER_DISTANCE * apart_m <= way_m;
        (is_near && !(is_camera && turned_cos < SAME_VIEW_COS)).then_some(apart_m)
    };
    // For each visit the near others, earlier and later, reduced to the nearest of each row of neighbours.
    let mut nearest: Vec<Vec<(usize, f64)>> = Vec::with_capacity(visits.len());
    let grid = Grid::new(places, near_m);
    for visit in 0..visits.len() {
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

/// Visits by their cells, so that few are compared on a long drive.
struct Grid(std::collections::BTreeMap<[i64; 3], Vec<usize>>, Vec<[i64; 3]>);

impl Grid {
    fn new(places: &Places, edge_m: f64) -> Self {
        let cell = |pose: &Isometry3<f64>| {
            let place = pose.translation.vector;
            [place.x, place.y, place.z].map(|c| (c / edge_m).floor() as i64)
        };
        let cells: Vec<[i64; 3]> = places.0.iter().map(cell).collect();
        let mut by_cell: std::collections::BTreeMap<[i64; 3], Vec<usize>> = std::collections::BTreeMap::new();
        for (visit, cell) in cells.iter().enumerate() {
            by_cell.entry(*cell).or_default().push(visit);
        }
        Self(by_cell, cells)
    }

    /// Those that are near, and some more, ascending.
    fn near(&self, visit: usize) -> Vec<usize> {
        let [x, y, z] = self.1[visit];
        let mut near = Vec::new();
        for beside_x in x - 1..=x + 1 {
            for beside_y in y - 1..=y + 1 {
                let column = [beside_x, beside_y, z - 1]..=[beside_x, beside_y, z + 1];
                near.extend(self.0.range(column).flat_map(|(_, visits)| visits));
            }
        }
        near.sort_unstable();
        near
    }
}

#[cfg(test)]
mod tests;
