//! How far apart two runs are between visits of a place.

use std::collections::HashMap;

use dmp_sensor::Isometry3;

use super::spread::{Distances, Spread};
use super::way::{OnWay, Ruler, place_of};

/// A scan of one run: the pose of the sensor, and the travel up to it, metres.
pub(super) type Step = (Isometry3<f64>, f64);

/// Scans of different visits are compared where a run has them this near, metres.
const NEAR_M: f64 = 5.0;
/// Of scans nearer together along the path than this only the first is compared, metres.
const STEP_M: f64 = 0.5;
/// A scan is compared with so many earlier visits, the latest ones.
const MOST_VISITS: usize = 8;
/// Cameras with other viewing directions see other surfaces: largest rotation between two, as a cosine.
const SAME_VIEW_COS: f64 = 0.707;

/// Scans against the nearest of earlier visits, by the positions of either run.
pub(super) fn spread(scans: &[OnWay<'_>], ruler: &Ruler) -> Option<Spread> {
    let keys = keys(scans, |scan| scan.along_m, ruler);
    let near_m = NEAR_M * ruler.metre_m;
    let of_run = |run: usize| {
        let steps: Vec<Step> = keys.iter().map(|key| (key.scan.run_from_sensor[run], key.along_m)).collect();
        visits(&steps, near_m, ruler)
    };
    let mut pairs: Vec<(usize, usize)> = (0..2).flat_map(of_run).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut distances = Distances::new();
    let mut place = None;
    for (later, earlier) in pairs {
        let [first, second] = [keys[earlier], keys[later]];
        if place.replace(place_of(second, ruler)).is_some_and(|last| last != place_of(second, ruler)) {
            distances.end_place();
        }
        distances.add(ruler.distance_m(first, second), [second.scan.scan; 2]);
    }
    distances.spread()
}

/// The scans with some travel between them.
pub(super) fn keys<'a, T>(scans: &'a [T], along_m: impl Fn(&T) -> f64, ruler: &Ruler) -> Vec<&'a T> {
    let mut keys: Vec<&T> = Vec::new();
    for scan in scans {
        if keys.last().is_none_or(|last| along_m(scan) - along_m(last) >= STEP_M * ruler.metre_m) {
            keys.push(scan);
        }
    }
    keys
}

/// For each scan, and each earlier visit that is near to it, the scan of that visit that is nearest: (later, earlier).
pub(super) fn visits(keys: &[Step], near_m: f64, ruler: &Ruler) -> Vec<(usize, usize)> {
    let pose = |k: usize| &keys[k].0;
    let cell =
        |pose: &Isometry3<f64>| [0, 1, 2].map(|axis| (pose.translation.vector[axis] / near_m).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let mut pairs = Vec::new();
    for later in 0..keys.len() {
        let home = cell(pose(later));
        let mut near: Vec<(usize, f64)> = Vec::new();
        for [x, y, z] in neighbours(home) {
            let Some(there) = cells.get(&[x, y, z]) else { continue };
            // Those of a cell are in the order of the path.
            let end = there.partition_point(|&k| keys[later].1 - keys[k].1 >= ruler.visits_m);
            let apart = |k: usize| (pose(k).translation.vector - pose(later).translation.vector).norm();
            near.extend(there[..end].iter().map(|&k| (k, apart(k))).filter(|&(k, apart_m)| {
                apart_m <= near_m && (!ruler.is_camera || is_same_view(pose(k), pose(later)))
            }));
        }
        near.sort_unstable_by_key(|&(k, _)| k);
        let is_one_visit = |a: &(usize, f64), b: &(usize, f64)| keys[b.0].1 - keys[a.0].1 < ruler.visits_m;
        for visit in near.chunk_by(is_one_visit).rev().take(MOST_VISITS) {
            let nearest = visit.iter().min_by(|a, b| a.1.total_cmp(&b.1));
            pairs.extend(nearest.map(|&(earlier, _)| (later, earlier)));
        }
        cells.entry(home).or_default().push(later);
    }
    pairs
}

fn neighbours([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    let beside = |cell: i64, step: i64| cell.saturating_add(step - 1);
    (0..27).map(move |k| [beside(x, k % 3), beside(y, k / 3 % 3), beside(z, k / 9)])
}

fn is_same_view(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    // cos of the angle of a rotation from its quaternion: 2 w² − 1.
    let w = a.rotation.rotation_to(&b.rotation).w;
    2.0 * w * w - 1.0 >= SAME_VIEW_COS
}
