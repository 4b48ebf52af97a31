//! Registers two visits to each other, in every run.

use dmp_align::{Alignment, Pyramid, Refusal, align};
use dmp_sensor::{Isometry3, Translation3};
use thiserror::Error;

/// Step between starts around a run's claim, metres of a drive. A run may be off by more than a registration
/// converges from, and a repetitive street shows only if a start leads to the next similar house.
const STEP_M: f64 = 3.0;
/// Largest distance between two runs' measurements of the same surfaces, metres of a drive and radians.
const SAME_M: f64 = 0.5;
const SAME_RAD: f64 = 0.02;
/// Starts nearer than this count as one.
const SAME_START_M: f64 = 1.0;

/// Why a pair of visits has no measurement in a run.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub(super) enum NotMeasured {
    /// The run has no pose on one of the visits.
    #[error("no pose there")]
    NoPose,
    /// The surfaces do not determine it.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// Other runs register the visits elsewhere, with more overlap.
    #[error("other runs register these visits {apart_m:.2} m away, with more overlap")]
    Outvoted {
        /// The distance between both.
        apart_m: f64,
    },
}

/// The runs' measurements of a pair of visits.
pub(super) type OfRuns = Vec<Result<Alignment, NotMeasured>>;

/// Two visits in one run.
pub(super) struct Seen<'a> {
    pub(super) first: &'a Pyramid,
    pub(super) second: &'a Pyramid,
    /// `first_from_second` by the poses of the run, in the frames of the places.
    pub(super) claimed: Isometry3<f64>,
}

/// Registers the second visit of each run to the first. The frames of the places are those of the sensor, so
/// the true motion is nearly the same in all runs. Each run starts from the claims of all runs, from `steps`
/// around them to either side, and again from the other runs' results.
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
            // A single start would not show ambiguity.
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

/// The result with most overlap; the first of equal ones.
fn best_of(found: &OfRuns) -> Option<Alignment> {
    let common = |alignment: &Alignment| alignment.overlap[0].min(alignment.overlap[1]);
    found.iter().flatten().fold(None, |best: Option<Alignment>, one| match best {
        Some(best) if common(&best) >= common(one) => Some(best),
        _ => Some(*one),
    })
}

/// The distance between two motions in the directions that both constrain, metres, if it is too large for
/// them to be the same.
fn apart(a: &Alignment, b: &Alignment, metre_m: f64) -> Option<f64> {
    let between = a.target_from_source.translation.vector - b.target_from_source.translation.vector;
    let unheld = a.unheld.iter().chain(&b.unheld);
    let between = unheld.fold(between, |between, along| between - along * along.dot(&between));
    let cos_of_half = a.target_from_source.rotation.coords.dot(&b.target_from_source.rotation.coords);
    // For small angles: sin² of half the angle.
    let turned = 1.0 - cos_of_half * cos_of_half > SAME_RAD * SAME_RAD / 4.0;
    (between.norm() > SAME_M * metre_m || turned).then_some(between.norm())
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
