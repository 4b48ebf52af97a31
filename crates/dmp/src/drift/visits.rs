//! Finds the places that a drive visits twice.

use dmp_sensor::{Isometry3, Vector3};

use crate::frames::PlannedFrame;
use crate::plan::Plan;
use crate::run_poses::RunPoses;

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
pub(crate) struct VisitPair {
    pub(super) first: usize,
    pub(super) second: usize,
    /// Distance between them, metres: the median over the runs.
    pub(super) apart_m: f64,
}

/// The visits of a drive: its segments.
pub(super) fn visits(plan: &Plan, along_m: &[f64], is_camera: bool) -> Vec<Visit> {
    let frames = plan.frames().len();
    let starts = if plan.segments.length.is_some() {
        plan.segments.starts.clone()
    } else {
        let count = STRETCHES.min(frames);
        (0..count).map(|k| k * frames / count).collect()
    };
    let ends = starts.iter().skip(1).copied().chain([frames]);
    let returns = |ordinal: usize| plan.frames()[ordinal].returns;
    starts.iter().zip(ends).map(|(&start, end)| Visit::of(start..end, along_m, returns, is_camera)).collect()
}

impl Visit {
    /// Selects scans of a segment. If a few have enough returns, they are the ones next to the middle, which
    /// mostly lie together in the log. Otherwise, and for a camera with its small view, they are at equal
    /// steps of distance, or of their number if the sensor stands.
    fn of(
        ordinals: std::ops::Range<usize>,
        along_m: &[f64],
        returns: impl Fn(usize) -> u64,
        is_camera: bool,
    ) -> Self {
        let (first_m, last_m) = (along_m[ordinals.start], along_m[ordinals.end - 1]);
        let at = |part: f64| {
            let goes_on = last_m > first_m;
            let along_m_wanted = first_m + part * (last_m - first_m);
            let by_way = ordinals.clone().find(|&ordinal| along_m[ordinal] >= along_m_wanted);
            let by_number = ordinals.start + (part * (ordinals.len() - 1) as f64) as usize;
            if goes_on { by_way.unwrap_or(ordinals.end - 1) } else { by_number }
        };
        let middle = at(0.5);
        let enough = RETURNS.div_ceil(returns(middle).max(1)) as usize;
        if !is_camera && enough < SCANS / 2 {
            let beside = (enough.max(LEAST_SCANS) / 2).min(ordinals.len() / 2);
            let scans =
                middle.saturating_sub(beside).max(ordinals.start)..(middle + beside + 1).min(ordinals.end);
            return Self { middle, scans: scans.collect() };
        }
        let mut scans: Vec<usize> = (0..SCANS)
            .map(|k| at(0.5 + PART * ((k as f64 + 0.5) / SCANS as f64 - 0.5)))
            .chain([middle])
            .collect();
        scans.sort_unstable();
        scans.dedup();
        Self { middle, scans }
    }
}

/// The sensor's pose on each visit, for each run.
pub(super) struct Places(Vec<Vec<Option<Isometry3<f64>>>>);

impl Places {
    pub(super) fn new<'a>(
        visits: &[Visit],
        frames: &[PlannedFrame],
        runs: impl Iterator<Item = &'a RunPoses>,
    ) -> Self {
        let of_run =
            |run: &RunPoses| visits.iter().map(|visit| run.of_frame(&frames[visit.middle])).collect();
        Self(runs.map(of_run).collect())
    }

    /// `world_from_sensor` of a run on a visit.
    pub(super) fn of(&self, run: usize, visit: usize) -> Option<&Isometry3<f64>> {
        self.0[run][visit].as_ref()
    }

    /// The distance between two visits, metres, and the cosine of the angle between them: the medians over
    /// the runs.
    fn apart(&self, a: usize, b: usize) -> Option<(f64, f64)> {
        let both = self.0.iter().filter_map(|run| Some((run[a].as_ref()?, run[b].as_ref()?)));
        let (mut distances, mut turns): (Vec<f64>, Vec<f64>) = both
            .map(|(a, b)| {
                let cos_of_half = a.rotation.coords.dot(&b.rotation.coords);
                let distance_m = (a.translation.vector - b.translation.vector).norm();
                (distance_m, 2.0 * cos_of_half * cos_of_half - 1.0)
            })
            .unzip();
        distances.sort_by(f64::total_cmp);
        turns.sort_by(f64::total_cmp);
        Some((*distances.get(distances.len() / 2)?, *turns.get(turns.len() / 2)?))
    }

    /// The heading of a run at a visit: from the visit before it to the one after.
    pub(super) fn heading(&self, run: usize, visit: usize) -> Vector3<f64> {
        let places = &self.0[run];
        let place = |visit: usize| places.get(visit)?.as_ref().map(|pose| pose.translation.vector);
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
        let (apart_m, turned_cos) = places.apart(a, b)?;
        let way_m = (along_m[visits[b].middle] - along_m[visits[a].middle]).abs();
        let is_near = apart_m <= near_m && WAY_PER_DISTANCE * apart_m <= way_m;
        (is_near && !(is_camera && turned_cos < SAME_VIEW_COS)).then_some(apart_m)
    };
    // For each visit the near others, earlier and later, reduced to the nearest of each row of neighbours.
    let mut nearest: Vec<Vec<(usize, f64)>> = Vec::with_capacity(visits.len());
    let grid = Grid::new(places, visits.len(), near_m);
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

/// Visits by their cells in any of the runs, so that few are compared on a long drive.
struct Grid {
    edge_m: f64,
    by_cell: std::collections::BTreeMap<[i64; 4], Vec<usize>>,
    cells: Vec<Vec<[i64; 4]>>,
}

impl Grid {
    fn new(places: &Places, visits: usize, edge_m: f64) -> Self {
        let mut grid =
            Self { edge_m, by_cell: std::collections::BTreeMap::new(), cells: vec![Vec::new(); visits] };
        for (run, of_run) in places.0.iter().enumerate() {
            for (visit, place) in of_run.iter().enumerate() {
                let Some(place) = place else { continue };
                let [x, y, z] = [0, 1, 2].map(|k| (place.translation.vector[k] / grid.edge_m).floor() as i64);
                grid.by_cell.entry([run as i64, x, y, z]).or_default().push(visit);
                grid.cells[visit].push([run as i64, x, y, z]);
            }
        }
        grid
    }

    /// Those that are near in some run, and some more, ascending.
    fn near(&self, visit: usize) -> Vec<usize> {
        let mut near = Vec::new();
        for &[run, x, y, z] in &self.cells[visit] {
            for beside_x in x - 1..=x + 1 {
                for beside_y in y - 1..=y + 1 {
                    let column = [run, beside_x, beside_y, z - 1]..=[run, beside_x, beside_y, z + 1];
                    near.extend(self.by_cell.range(column).flat_map(|(_, visits)| visits));
                }
            }
        }
        near.sort_unstable();
        near.dedup();
        near
    }
}

#[cfg(test)]
mod tests;
