//! When and where a run's poses hold, by the scans themselves.
//!
//! A SLAM system's poses come with conventions: the instant of the scan that a pose belongs to, a clock, the body that moves,
//! where the sensor sits on it, and whether the points of a scan were already brought to one instant. A wrong guess makes a
//! right map thick. [`calibrate`] looks for the errors with which the planes that several scans see become thinnest, says how
//! well each is known, and which of them the scans do not show: height over flat ground, time on a straight road at even
//! speed.
//!
//! Nothing here reads a file. The bits of every result are the same for any number of threads.

mod axis;
mod evidence;
mod fit;
mod knots;
mod mount;
mod planes;
mod sample;
#[cfg(test)]
mod tests;
mod together;

use dmp_reduce::Confidence;
use dmp_sensor::Isometry3;

pub use axis::Axis;
use axis::{AXES, Vector};
pub use evidence::Interval;
use evidence::is_shown;
use fit::{Fitted, fit, thickness_m2};
pub use mount::Mount;
pub use sample::{Block, scans_of_block};
pub use together::{Order, Together, times_as_often, together, together_in_turns, together_of_blocks};

/// What is left of the mean square thickness above which a fix is not worth it.
const WORTH: f64 = 0.97;
/// An error of this many half intervals is seen, however wide these are.
const CLEARLY: f64 = 2.0;
/// A run whose poses are off by more than this from the path between their neighbours, metres of a drive, is not used where
/// returns are posed between them: what lies between is better known than they. A rotation counts at the other distance.
const JITTER_M: f64 = 0.1;
const REACH_M: f64 = 10.0;

/// One estimated number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Which.
    pub axis: Axis,
    /// What it is, in the unit of the axis: seconds, radians, metres.
    pub value: f64,
    /// Half of its interval.
    pub half: f64,
    /// Whether the scans show it.
    pub is_seen: bool,
    /// Whether it surely differs from what was given (0, of [`Axis::Sweep`] 1) by enough to be reported: 2 ms, 0.3 of a
    /// sweep, 0.05°, 1 cm.
    pub is_off: bool,
    /// Whether fixing it pays besides: surfaces become thinner by it, by 3 % of the mean square or more, and not with the
    /// opposite as well. What does less to the map does nothing to a verdict; and a run that drifts a little to one side
    /// looks as if its sensor were turned a little. What pays is estimated without the others.
    pub pays: bool,
}

/// Why nothing is estimated of a run's clock and mounting though its scans have planes in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Silence {
    /// Its poses jitter.
    Jitter {
        /// By how much they are off from the path between their neighbours, root of the mean square, metres.
        jitter_m: f64,
    },
    /// It fits best with a share of the returns' times that is neither none nor all.
    Sweep,
}

/// What was found of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Every number, in the order of [`Axis::ALL`]: those that pay by themselves, the others all together.
    pub estimates: [Estimate; AXES],
    /// Thickness of the planes as the run was given, metres: the root of the mean square distance.
    pub before_m: f64,
    /// The same after the fixes that pay.
    pub after_m: f64,
    /// Why nothing is estimated, where that is so.
    pub silence: Option<Silence>,
    /// The fixes: those that pay, estimated alone; the others are 0 (of [`Axis::Sweep`], 1).
    pub mended: [f64; AXES],
}

impl Calibration {
    /// What was found of one number.
    pub fn of(&self, axis: Axis) -> Estimate {
        self.estimates[axis as usize]
    }

    /// Those that are off beyond their interval.
    pub fn off(&self) -> impl Iterator<Item = Estimate> {
        self.estimates.into_iter().filter(|estimate| estimate.is_off)
    }

    /// Those that are worth fixing.
    pub fn paying(&self) -> impl Iterator<Item = Estimate> {
        self.estimates.into_iter().filter(|estimate| estimate.pays)
    }

    /// The fix of the mounting: `given_from_true` of the sensor, to be put behind `body_from_sensor`.
    pub fn sensor_motion(&self) -> Isometry3<f64> {
        let [_, _, roll, pitch, yaw, x, y, z] = self.mended;
        Isometry3::new(nalgebra::Vector3::new(x, y, z), nalgebra::Vector3::new(roll, pitch, yaw))
    }
}

/// A scan is as it was measured or at one instant. What fits best with something else is off in other ways than are looked for.
fn misfits(found: &Fitted, sweep_is_seen: bool) -> bool {
    /// Points that were brought to one instant by a rough estimate of the motion are nearly there.
    const ROUGHLY: f64 = 0.25;
    let sweep = Axis::Sweep as usize;
    let (steps, half) = (found.steps[sweep], found.half_steps[sweep]);
    let step = Axis::Sweep.step(1.0);
    let value = steps * step + Axis::Sweep.as_given();
    let is_off = sweep_is_seen && steps.abs() > half.max(Axis::Sweep.worth_steps());
    is_off && value.abs() > (half * step).max(ROUGHLY)
}

/// How thick the planes are, metres, with these numbers in the order of [`Axis::ALL`], each in its unit; `None` where the scans
/// have none in common.
pub fn thickness_m(blocks: &[Block], mount: &Mount<'_>, metre_m: f64, numbers: &[f64; AXES]) -> Option<f64> {
    let in_steps = |axis: Axis| (numbers[axis as usize] - axis.as_given()) / axis.step(metre_m);
    let steps = Vector::from_fn(|k, _| in_steps(Axis::ALL[k]));
    thickness_m2(blocks, mount, metre_m, &steps).map(f64::sqrt)
}

/// Looks for errors of time and mounting by the scans of some blocks; `metre_m` is how long what is a metre on a drive is here.
/// Times of returns are looked at where `sweeps`. `None` where the scans have no planes in common.
///
/// Takes time with the returns of all blocks, about a microsecond each.
pub fn calibrate(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    sweeps: bool,
    confidence: Confidence,
) -> Option<Calibration> {
    let mut free = [true; AXES];
    free[Axis::Sweep as usize] = sweeps;
    let all = fit(blocks, mount, metre_m, free, Vector::zeros(), confidence)?;
    let value = |k: usize, steps: f64| {
        let axis = Axis::ALL[k];
        steps * axis.step(metre_m) + axis.as_given()
    };
    let is_seen = |k: usize| {
        let (off, half) = (all.steps[k].abs(), all.half_steps[k]);
        free[k] && (half <= Axis::ALL[k].seen_within_steps() || off > CLEARLY * half)
    };
    // Within a scan a pose between two others is used, and that of a jittering run is better than both: everything else gives
    // way to that.
    let jitter_m = mount.trajectory.jitter_m(REACH_M * metre_m);
    let silence = if sweeps && jitter_m > JITTER_M * metre_m {
        Some(Silence::Jitter { jitter_m })
    } else {
        misfits(&all, is_seen(Axis::Sweep as usize)).then_some(Silence::Sweep)
    };
    let is_seen = |k: usize| is_seen(k) && silence.is_none();
    let off: [bool; AXES] = std::array::from_fn(|k| {
        is_seen(k) && all.steps[k].abs() > all.half_steps[k].max(Axis::ALL[k].worth_steps())
    });
    // One after the other those are let go that do least, until all that are left pay.
    let as_given = Fitted { steps: Vector::zeros(), after_m2: all.before_m2, ..all.clone() };
    let with_only = |some: [bool; AXES]| {
        if !some.contains(&true) {
            return Some(as_given.clone());
        }
        let start = Vector::from_fn(|k, _| if some[k] { all.steps[k] } else { 0.0 });
        fit(blocks, mount, metre_m, some, start, confidence)
    };
    let mut pays = off;
    let mut alone = with_only(pays)?;
    let least = |pays: &[bool; AXES], fitted: &Fitted| {
        (0..AXES).filter(|&k| pays[k]).min_by(|&a, &b| fitted.gains[a].total_cmp(&fitted.gains[b]))
    };
    while let Some(k) = least(&pays, &alone) {
        let mut fewer = pays;
        fewer[k] = false;
        let without = with_only(fewer)?;
        if alone.after_m2 <= WORTH * without.after_m2 {
            break;
        }
        (pays, alone) = (fewer, without);
    }
    let is_real = |k: usize| {
        let with = |steps: f64| {
            let mut changed = alone.steps;
            changed[k] = steps;
            changed
        };
        let (given, opposite) = (with(0.0), with(-alone.steps[k]));
        let three = [&given, &alone.steps, &opposite];
        k == Axis::Sweep as usize || is_shown(blocks, mount, metre_m, three, confidence)
    };
    let real: [bool; AXES] = std::array::from_fn(|k| pays[k] && is_real(k));
    if real != pays {
        (pays, alone) = (real, with_only(real)?);
    }
    let estimates = std::array::from_fn(|k| {
        // What is fixed is what is reported.
        let Fitted { steps, half_steps, .. } = if pays[k] { &alone } else { &all };
        Estimate {
            axis: Axis::ALL[k],
            value: value(k, steps[k]),
            half: half_steps[k] * Axis::ALL[k].step(metre_m),
            is_seen: is_seen(k),
            is_off: off[k],
            pays: pays[k],
        }
    });
    Some(Calibration {
        estimates,
        before_m: alone.before_m2.sqrt(),
        after_m: alone.after_m2.sqrt(),
        silence,
        mended: std::array::from_fn(|k| value(k, alone.steps[k])),
    })
}

/// Of some instants, as seconds to add to the stamps of the log, the one at which the poses hold, where the scans show beyond
/// doubt that it is not that of the stamps.
pub fn instant(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    later_s: &[f64],
    confidence: Confidence,
) -> Option<usize> {
    let steps = |later_s: f64| {
        let mut steps = Vector::zeros();
        steps[Axis::Time as usize] = later_s / Axis::Time.step(metre_m);
        steps
    };
    let thickness = |&later_s: &f64| thickness_m2(blocks, mount, metre_m, &steps(later_s));
    let given_m2 = thickness(&0.0)?;
    let thinnest = |(k, later_s)| Some((k, thickness(later_s)?));
    let (k, fixed_m2) = later_s.iter().enumerate().filter_map(thinnest).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let three = [&steps(0.0), &steps(later_s[k]), &steps(-later_s[k])];
    (fixed_m2 < given_m2 && is_shown(blocks, mount, metre_m, three, confidence)).then_some(k)
}
