//! Profiles the thickness of surfaces over one parameter: the evidence for its estimate and interval.

use dmp_log::ScanLog;
use dmp_revisit::calibrate::{Axis, Calibration, thickness_m};

use super::found::Found;
use super::look::Look;
use super::sample::{self, Extent};
use crate::asked::pool;
use crate::asked::{Config, EvaluateError, Progress, Run, Stage};
use crate::runs::Heads;

/// Number of values of each parameter; the middle one is the given value.
const VALUES: usize = 17;
/// Their extent: this many half intervals, and at least this many times the estimated error.
const HALVES: f64 = 3.0;
const TIMES_OFF: f64 = 2.0;

/// Thickness of surfaces over values of one parameter, the others being at their estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The parameter.
    pub axis: Axis,
    /// The values, in its unit, symmetric about the given one.
    pub values: Vec<f64>,
    /// For each given run, the thickness at each value, metres; `None` if a run is misinterpreted or its
    /// scans share no surface.
    pub thickness_m: Vec<Option<Vec<f64>>>,
}

/// Profiles the given runs on the scans that [`vet`](super::vet) uses; `found` is its result. Takes ten times
/// as long.
///
/// # Errors
/// As [`vet`](super::vet).
pub fn profiles(
    log: &dyn ScanLog,
    runs: &[Run],
    found: &[Found],
    config: &Config,
    progress: &dyn Progress,
) -> Result<Vec<Profile>, EvaluateError> {
    let heads = Heads::Log(log);
    let (settings, means) = config.on(heads.summary())?;
    let pool = pool(means.threads)?;
    let blocks = pool.install(|| sample::read(heads, Extent::Full, &settings, progress))?;
    let look = Look { heads, settings: &settings, blocks: &blocks, of_instant: &blocks };
    let axes = Axis::ALL.into_iter().filter(|&axis| axis != Axis::Sweep || heads.summary().has_point_times());
    let axes: Vec<Axis> = axes.collect();
    progress.begin(Stage::Vet, (axes.len() * runs.len()) as u64);
    let profile = |axis: Axis| {
        let reach = reach(axis, found, settings.metre_m());
        let value = |k: usize| axis.as_given() + reach * (2.0 * k as f64 / (VALUES - 1) as f64 - 1.0);
        let values: Vec<f64> = (0..VALUES).map(value).collect();
        let of_run = |(run, found): (&Run, &Found)| {
            if progress.cancelled() {
                return Err(EvaluateError::Cancelled);
            }
            progress.advance(1);
            let Some(calibration) = calibration_of(found) else { return Ok(None) };
            look.mounted(run, |mount| {
                let with = |&value: &f64| {
                    let mut numbers = calibration.mended;
                    numbers[axis as usize] = value;
                    thickness_m(&blocks, mount, settings.metre_m(), &numbers)
                };
                values.iter().map(with).collect()
            })
        };
        let thickness_m = runs.iter().zip(found).map(of_run).collect::<Result<_, _>>()?;
        Ok(Profile { axis, values, thickness_m })
    };
    pool.install(|| axes.iter().copied().map(profile).collect())
}

/// The calibration of a run whose input is interpreted as given.
fn calibration_of(found: &Found) -> Option<&Calibration> {
    found.calibration.as_ref().filter(|_| found.together_as_read.is_none())
}

/// The largest deviation of the values, the same for all runs.
fn reach(axis: Axis, found: &[Found], metre_m: f64) -> f64 {
    let (least, most) = match axis {
        Axis::Time => (0.02, 0.3),
        Axis::Sweep => (1.25, 1.25),
        Axis::Roll | Axis::Pitch | Axis::Yaw => (0.5_f64.to_radians(), 5.0_f64.to_radians()),
        Axis::X | Axis::Y | Axis::Z => (0.1 * metre_m, metre_m),
    };
    let of_run = |calibration: &Calibration| {
        let one = calibration.of(axis);
        (HALVES * one.half).max(TIMES_OFF * (one.value - axis.as_given()).abs())
    };
    let seen = found.iter().filter_map(calibration_of).filter(|calibration| calibration.of(axis).is_seen);
    seen.map(of_run).fold(least, f64::max).min(most)
}
