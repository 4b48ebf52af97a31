//! The vetting result of a run, and its messages.

use dmp_calibrate::{Axis, Calibration, Estimate, Silence};

use super::mend::Mend;
use crate::error::EvaluateError;
use crate::report::{ConventionsReport, EstimateReport};
use crate::setting_name::SettingName;

/// The vetting result of one run.
#[derive(Debug)]
pub struct Found {
    /// Its name.
    pub name: String,
    /// Share of the returns that match those of a nearby scan, with the run as given.
    pub together: Option<f64>,
    /// The same with another interpretation of the input that fits much better.
    pub together_as_read: Option<f64>,
    /// Estimated clock offset and extrinsic, after such an interpretation; `None` if the scans do not
    /// determine them.
    pub calibration: Option<Calibration>,
    /// The fixes for the certain errors, in this order.
    pub mends: Vec<Mend>,
    /// Whether they can be applied to the run; a pose format cannot be changed once an odometry interpolates
    /// between the poses.
    pub can_be_mended: bool,
    /// Whether, by this run alone, the points are already motion-corrected: then its clock and extrinsic are
    /// not judged.
    pub is_at_odds: bool,
    /// Why it does not belong to the log as given; `None` if it does.
    pub left_out: Option<LeftOut>,
    /// Whether it is scored: it belongs, or no run does and excluding all would help nobody.
    pub is_kept: bool,
}

/// Why a run is excluded from everything that runs share.
#[derive(Debug)]
#[non_exhaustive]
pub enum LeftOut {
    /// It has no poses for the log's scans.
    NotPaired(Box<EvaluateError>),
    /// Its poses are clearly misinterpreted.
    Misread,
    /// At its turns, the scans fit together as well without the turn.
    OtherTurns {
        /// Share of the returns at turns that match another scan.
        turned: f64,
        /// The same without the turn.
        straight: f64,
    },
    /// The scans fit together no better with its own poses than with other scans' poses.
    Unrelated {
        /// Share of the returns that match another scan, with shuffled poses.
        together_mixed_up: f64,
    },
}

impl Found {
    /// The error and its fix, in a sentence; `name` gives the name of a setting. `None` without an error.
    pub fn message_with(&self, mended: bool, name: &dyn Fn(SettingName) -> String) -> Option<String> {
        let head = if self.is_kept { "" } else { " is excluded" };
        let left_out = |why: String| Some(format!("run `{}`{head}: {why}", self.name));
        match &self.left_out {
            Some(LeftOut::NotPaired(error)) => {
                let text = error.message_with(name);
                let own = format!("run `{}`: ", self.name);
                return left_out(text.strip_prefix(&own).unwrap_or(&text).to_owned());
            }
            Some(LeftOut::Unrelated { together_mixed_up }) => {
                return left_out(format!(
                    "its poses do not match the scans of this log: {:.0} % of the returns meet those of nearby scans, {:.0} % \
                     with the poses of other scans",
                    100.0 * self.together.unwrap_or(0.0),
                    100.0 * together_mixed_up
                ));
            }
            Some(LeftOut::OtherTurns { turned, straight }) => {
                return left_out(format!(
                    "its poses do not match the scans of this log: in turns, {:.0} % of the returns meet those of nearby \
                     scans, {:.0} % without the turn",
                    100.0 * turned,
                    100.0 * straight
                ));
            }
            Some(LeftOut::Misread) | None => {}
        }
        let what = self.what()?;
        if self.mends.is_empty() {
            return Some(format!("run `{}`: {what}", self.name));
        }
        let options = self.options(name).join(" ");
        Some(if mended && self.can_be_mended {
            format!("run `{}`: {what}; fixed with {options}", self.name)
        } else if self.can_be_mended {
            format!(
                "run `{}`{head}: {what}; fix it with {options}, or with {}",
                self.name,
                name(SettingName::Mend)
            )
        } else {
            format!("run `{}`{head}: {what}; fix it with {options}", self.name)
        })
    }

    /// For a report: the estimated clock offset and extrinsic; `mended` says whether errors were fixed.
    pub fn report(&self, mended: bool, name: &dyn Fn(SettingName) -> String) -> ConventionsReport {
        let estimate = |one: Estimate| EstimateReport {
            axis: one.axis.name().to_owned(),
            value: one.value,
            half: one.half,
            seen: one.is_seen,
            off: one.is_off,
            pays: one.pays,
        };
        let calibration = self.calibration.as_ref();
        ConventionsReport {
            together: self.together,
            estimates: calibration
                .map_or(Vec::new(), |found| found.estimates.into_iter().map(estimate).collect()),
            thickness_m: calibration.map(|found| found.before_m),
            thickness_mended_m: calibration.map(|found| found.after_m),
            silence: calibration.and_then(|found| found.silence).map(in_words),
            mends: self.options(name),
            mended: mended && self.can_be_mended && !self.mends.is_empty(),
        }
    }

    fn options(&self, name: &dyn Fn(SettingName) -> String) -> Vec<String> {
        self.mends.iter().map(|mend| mend.message_with(&self.name, name)).collect()
    }

    /// Why its clock could not be checked, if so.
    pub(super) fn clock_is_unknown(&self) -> Option<String> {
        let as_given = self.is_kept && self.together_as_read.is_none();
        let calibration = self.calibration.as_ref().filter(|_| as_given)?;
        let why = match calibration.silence {
            Some(silence) => in_words(silence),
            None if calibration.of(Axis::Time).is_seen => return None,
            None => "its scans do not show it".to_owned(),
        };
        Some(format!("run `{}`: its clock could not be checked: {why}", self.name))
    }

    /// The estimate by which, for this run, the points are already motion-corrected.
    pub(super) fn points_are_corrected(&self) -> Option<Estimate> {
        let sweep = self.calibration.as_ref()?.of(Axis::Sweep);
        (sweep.pays && sweep.value + sweep.half < 0.5).then_some(sweep)
    }

    fn what(&self) -> Option<String> {
        let mut parts = Vec::new();
        if let (Some(given), Some(read)) = (self.together, self.together_as_read) {
            let how = self.mends.first().map_or("", as_meant);
            parts.push(format!(
                "its poses are misread: {:.0} % of the returns meet those of nearby scans, {:.0} % {how}",
                100.0 * given,
                100.0 * read
            ));
        }
        if let Some(calibration) = &self.calibration {
            // Point times concern the log, not the run.
            let off = calibration.paying().filter(|one| one.axis != Axis::Sweep || self.is_at_odds);
            let off: Vec<String> = off.map(off_in_words).collect();
            if !off.is_empty() {
                parts.push(format!(
                    "{} (from the scans: surfaces become {:.1} cm thick instead of {:.1} cm)",
                    off.join(", "),
                    100.0 * calibration.after_m,
                    100.0 * calibration.before_m
                ));
            }
            if self.is_at_odds {
                parts.push("other runs do not confirm this, so nothing is fixed".to_owned());
            }
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

fn as_meant(mend: &Mend) -> &'static str {
    match mend {
        Mend::PosesAs(_) => "with another pose format",
        Mend::Extrinsic(_) => "with another extrinsic",
        Mend::TimeOffset(_) => "with a time offset",
        Mend::PoseAt(_) => "at another instant of the scans",
    }
}

fn in_words(silence: Silence) -> String {
    match silence {
        Silence::Jitter { jitter_m } => format!(
            "its poses are {:.0} cm off the path between their neighbours (jitter, jumps or gaps), so clock and extrinsic \
             cannot be estimated",
            100.0 * jitter_m
        ),
        Silence::Sweep => {
            "its scans fit best with part of the point times, so the error is of another kind".to_owned()
        }
    }
}

/// An estimate in display units.
pub(super) fn off_in_words(one: Estimate) -> String {
    let Estimate { axis, value, half, .. } = one;
    let (ms, degrees, cm) = (1e3, 1.0_f64.to_degrees(), 100.0);
    match axis {
        // The sign is that of the option that fixes it: the value is added to the log's stamps.
        Axis::Time => format!("estimated clock offset {:+.1} ± {:.1} ms", ms * value, ms * half),
        Axis::Sweep => format!(
            "the points of a scan are motion-corrected already (estimated scale of point times {value:.2} ± {half:.2})"
        ),
        Axis::Roll | Axis::Pitch | Axis::Yaw => {
            format!("estimated {} error {:.2} ± {:.2}°", axis.name(), -degrees * value, degrees * half)
        }
        Axis::X | Axis::Y | Axis::Z => {
            format!("estimated {} error {:.1} ± {:.1} cm", axis.name(), -cm * value, cm * half)
        }
    }
}
