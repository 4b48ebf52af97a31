//! Registers two visits of a run to each other.

use dmp_sensor::{Isometry3, Translation3};

use crate::align::{Alignment, Pyramid, Refusal, align};

/// Step between starts around a run's claim, metres of a drive. A run may be off by more than a registration
/// converges from, and a repetitive street shows only if a start leads to the next similar house.
const STEP_M: f64 = 3.0;
/// A match that does not fit may lie somewhat further from the claim than the visit truly is.
const SURE: f64 = 0.75;
/// Starts nearer than this count as one.
const SAME_START_M: f64 = 1.0;

/// Two visits in a run.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The surfaces of the first visit, in the frame of its place.
    pub first: &'a Pyramid,
    /// Those of the second.
    pub second: &'a Pyramid,
    /// `first_from_second` by the poses of the run, in the frames of the places.
    pub claimed: Isometry3<f64>,
}

/// How far around a claim is searched, metres of a drive.
pub fn searched_m(steps: i32) -> f64 {
    f64::from(steps) * STEP_M
}

/// Registers the second visit to the first. It starts from the claim of the run, and from `steps` around it to either side.
///
/// # Errors
/// Why there is no answer.
pub fn register(seen: &Seen<'_>, steps: i32, metre_m: f64) -> Result<Alignment, Refusal> {
    let around = around(&seen.claimed, steps, metre_m);
    let starts = distinct([seen.claimed].iter().chain(&around), metre_m);
    align(seen.first, seen.second, &starts)
}

/// How far off a run is at least where there is no answer, metres: a part of how far from its claim the surfaces match best, and no
/// more than was searched; `None` where nothing speaks against the claim.
pub fn at_least_m(why_not: &Refusal, searched_m: f64) -> Option<f64> {
    why_not.elsewhere_m().map(|elsewhere_m| (SURE * elsewhere_m).min(searched_m))
}

/// Starts around a claim, level in the frame of the place.
fn around(claimed: &Isometry3<f64>, steps: i32, metre_m: f64) -> Vec<Isometry3<f64>> {
    let beside = (-steps..=steps).map(|step| f64::from(step) * STEP_M * metre_m);
    let places = beside.clone().flat_map(|x| beside.clone().map(move |y| [x, y]));
    places.map(|[x, y]| Translation3::new(x, y, 0.0) * claimed).collect()
}

/// The starts without near-duplicates.
fn distinct<'a>(starts: impl Iterator<Item = &'a Isometry3<f64>>, metre_m: f64) -> Vec<Isometry3<f64>> {
    let mut distinct: Vec<Isometry3<f64>> = Vec::new();
    for start in starts {
        let is_near = |other: &Isometry3<f64>| {
            (start.translation.vector - other.translation.vector).norm() < SAME_START_M * metre_m
        };
        if !distinct.iter().any(is_near) {
            distinct.push(*start);
        }
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_a_part_of_the_distance_to_the_best_match_and_within_the_search() {
        for (elsewhere_m, expected_m) in [(None, None), (Some(4.0), Some(3.0)), (Some(20.0), Some(6.0))] {
            let why_not = Refusal::NotAlike { off_m: 0.1, thick_m: 0.01, elsewhere_m };
            assert_eq!(at_least_m(&why_not, searched_m(2)), expected_m);
        }
        assert_eq!(at_least_m(&Refusal::LittleOverlap { share: 0.1 }, searched_m(2)), None);
    }
}
