//! Two visits brought onto each other, as every run has them.

use dmp_align::{Alignment, Pyramid, Refusal, align};
use dmp_sensor::{Isometry3, Translation3};
use thiserror::Error;

/// Steps of the starts around what a run claims, metres of a drive: a run may be further off than a registration reaches, and a
/// street that repeats itself shows only where a start leads to the next house that is alike.
const STEP_M: f64 = 3.0;
/// What two runs measure of the same surfaces lies no further apart than this, metres of a drive and radians.
const SAME_M: f64 = 0.5;
const SAME_RAD: f64 = 0.02;
/// Starts that are as near as this are one.
const SAME_START_M: f64 = 1.0;

/// Why nothing is known of a pair of visits in a run.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub(super) enum NotMeasured {
    /// The run has no pose on one of the visits.
    #[error("no pose there")]
    NoPose,
    /// The surfaces do not tell.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// Other runs find the visits elsewhere, with more in common.
    #[error("other runs find these visits {apart_m:.2} m from where this one does, with more in common")]
    Outvoted {
        /// How far.
        apart_m: f64,
    },
}

/// What the runs make of a pair of visits.
pub(super) type OfRuns = Vec<Result<Alignment, NotMeasured>>;

/// What one run has of two visits.
pub(super) struct Seen<'a> {
    pub(super) first: &'a Pyramid,
    pub(super) second: &'a Pyramid,
    /// `first_from_second` by the poses of the run, in the frames of the places.
    pub(super) claimed: Isometry3<f64>,
}

/// Brings the second visit of each run onto the first. The frames of the places are those of the sensor, so what is looked for is
/// nearly the same in all runs: each starts from what all of them claim, from so many `steps` around that to either side, and again from what the others found.
pub(super) fn register(seen: &[Option<Seen<'_>>], steps: i32, metre_m: f64) -> OfRuns {
    let claims: Vec<Isometry3<f64>> = seen.iter().flatten().map(|run| run.claimed).collect();
    let mut found: OfRuns = seen
        .iter()
        .map(|run| {
            let run = run.as_ref().ok_or(NotMeasured::NoPose)?;
            let around = around(&run.claimed, steps, metre_m);
            let starts = distinct([run.claimed].iter().chain(&claims).chain(&around), metre_m);
            Ok(align(run.first, run.second, &starts)?)
        })
        .collect();
    let Some(best) = best_of(&found) else { return found };
    for (run, found) in seen.iter().zip(&mut found) {
        let Some(run) = run else { continue };
        match found {
            Ok(own) if apart(own, &best, metre_m).is_none() => continue,
            // From one start alone it would not show that there are more.
            Err(NotMeasured::Refused(Refusal::Ambiguous { .. })) => continue,
            _ => {}
        }
        let again = align(run.first, run.second, &[best.target_from_source]);
        match (again, &found) {
            (Ok(again), _) if apart(&again, &best, metre_m).is_none() => *found = Ok(again),
            (_, Ok(own)) => {
                let apart_m = apart(own, &best, metre_m).unwrap_or_default();
                *found = Err(NotMeasured::Outvoted { apart_m });
            }
            _ => {}
        }
    }
    found
}

/// Of what was found that with most in common; the first of those.
fn best_of(found: &OfRuns) -> Option<Alignment> {
    let common = |alignment: &Alignment| alignment.overlap[0].min(alignment.overlap[1]);
    found.iter().flatten().fold(None, |best: Option<Alignment>, one| match best {
        Some(best) if common(&best) >= common(one) => Some(best),
        _ => Some(*one),
    })
}

/// How far apart two motions are in the directions that both hold, metres, where that is too far to be the same.
fn apart(a: &Alignment, b: &Alignment, metre_m: f64) -> Option<f64> {
    let between = a.target_from_source.translation.vector - b.target_from_source.translation.vector;
    let unheld = a.unheld.iter().chain(&b.unheld);
    let between = unheld.fold(between, |between, along| between - along * along.dot(&between));
    let cos_of_half = a.target_from_source.rotation.coords.dot(&b.target_from_source.rotation.coords);
    // Of small angles: sin² of the half.
    let turned = 1.0 - cos_of_half * cos_of_half > SAME_RAD * SAME_RAD / 4.0;
    (between.norm() > SAME_M * metre_m || turned).then_some(between.norm())
}

/// Starts around a claim, level in the frame of the place.
fn around(claimed: &Isometry3<f64>, steps: i32, metre_m: f64) -> Vec<Isometry3<f64>> {
    let beside = (-steps..=steps).map(|step| f64::from(step) * STEP_M * metre_m);
    let places = beside.clone().flat_map(|x| beside.clone().map(move |y| [x, y]));
    places.map(|[x, y]| Translation3::new(x, y, 0.0) * claimed).collect()
}

/// Each start but those that are nearly one before.
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
