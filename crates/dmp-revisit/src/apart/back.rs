//! How much of a run comes back to places where it was before, by its own path.

use dmp_sensor::{Isometry3, along_m};

use super::between::{Step, keys, visits};
use super::way::{PLACE_M, Ruler};

/// The share of a run's scans with an earlier visit up to 20 m away, in a room 2 m, by its poses in the order of time. Of scans nearer
/// together than half a metre of travel one counts; 0 without any.
pub fn share_back(run_from_sensor: impl Iterator<Item = Isometry3<f64>>, ruler: &Ruler) -> f64 {
    let poses: Vec<Isometry3<f64>> = run_from_sensor.collect();
    let places: Vec<_> = poses.iter().map(|pose| Some(pose.translation.vector)).collect();
    let steps: Vec<Step> = poses.into_iter().zip(along_m(&places, ruler.metre_m)).collect();
    let keys: Vec<Step> = keys(&steps, |step| step.1, ruler).into_iter().copied().collect();
    let mut back: Vec<usize> =
        visits(&keys, PLACE_M * ruler.metre_m, ruler).into_iter().map(|(later, _)| later).collect();
    back.dedup();
    back.len() as f64 / keys.len().max(1) as f64
}
