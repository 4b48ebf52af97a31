//! What vetting found, and how it is told.

use dmp_calibrate::{Axis, Calibration, Estimate};

use super::mend::Mend;
use crate::config::Run;
use crate::error::EvaluateError;
use crate::report::{ConventionsReport, EstimateReport, LeftOutReport, Report, Warning};
use crate::setting_name::SettingName;

/// What was found of one run.
#[derive(Debug)]
pub struct Found {
    /// Its name.
    pub name: String,
    /// Share of the returns looked at that meet those of another scan near by, as the run was given.
    pub together: Option<f64>,
    /// The same with another reading of what was given, by which the scans fit together much better.
    pub together_as_read: Option<f64>,
    /// Errors of time and mounting, after such a reading; `None` where the scans do not tell.
    pub calibration: Option<Calibration>,
    /// What puts right what is beyond doubt.
    pub mends: Vec<Mend>,
    /// Why it is no part of what is compared; `None` where it is.
    pub left_out: Option<LeftOut>,
}

/// Why a run is left out of everything that runs share.
#[derive(Debug)]
#[non_exhaustive]
pub enum LeftOut {
    /// It has no poses for the log's scans.
    NotPaired(Box<EvaluateError>),
    /// Its poses are read in a wrong way, by far.
    Misread,
    /// The scans fit together no better with its poses than with each other's.
    Unrelated {
        /// Share of the returns that meet another scan, put at the pose of another scan.
        together_mixed_up: f64,
    },
}

impl Found {
    /// In a sentence, with the words that `name` has for settings, what is wrong and what puts it right; `None` where nothing
    /// is.
    pub fn message_with(&self, mended: bool, name: &dyn Fn(SettingName) -> String) -> Option<String> {
        let left_out = |why: String| Some(format!("run `{}` is left out: {why}", self.name));
        match &self.left_out {
            Some(LeftOut::NotPaired(error)) => {
                let text = error.message_with(name);
                let own = format!("run `{}`: ", self.name);
                return left_out(text.strip_prefix(&own).unwrap_or(&text).to_owned());
            }
            Some(LeftOut::Unrelated { together_mixed_up }) => {
                return left_out(format!(
                    "its poses have nothing to do with the scans of this log: {:.0} % of the returns meet those of other scans \
                     near by, and {:.0} % with the poses of other scans",
                    100.0 * self.together.unwrap_or(0.0),
                    100.0 * together_mixed_up
                ));
            }
            Some(LeftOut::Misread) | None => {}
        }
        let what = self.what()?;
        let mends: Vec<String> =
            self.mends.iter().map(|mend| mend.message_with(Some(&self.name), name)).collect();
        let options = mends.join(" ");
        Some(if mended {
            format!("run `{}`: {what}; mended, as by {options}", self.name)
        } else {
            let head = if self.left_out.is_some() { " is left out" } else { "" };
            format!(
                "run `{}`{head}: {what}; {options} mends it, and so does {}",
                self.name,
                name(SettingName::Mend)
            )
        })
    }

    /// For a report: what the scans say of its clock and mounting; `mended`, whether what is off was put right.
    pub fn report(&self, mended: bool, name: &dyn Fn(SettingName) -> String) -> ConventionsReport {
        let estimate = |one: Estimate| EstimateReport {
            axis: one.axis.name().to_owned(),
            value: one.value,
            half: one.half,
            seen: one.is_seen,
            off: one.is_off,
        };
        let calibration = self.calibration.as_ref();
        ConventionsReport {
            together: self.together,
            estimates: calibration
                .map_or(Vec::new(), |found| found.estimates.into_iter().map(estimate).collect()),
            thickness_m: calibration.map(|found| found.before_m),
            thickness_mended_m: calibration.map(|found| found.after_m),
            mends: self.mends.iter().map(|mend| mend.message_with(Some(&self.name), name)).collect(),
            mended: mended && !self.mends.is_empty(),
        }
    }

    fn what(&self) -> Option<String> {
        let mut parts = Vec::new();
        if let (Some(given), Some(read)) = (self.together, self.together_as_read) {
            let how = self.mends.first().map_or("", in_words);
            parts.push(format!(
                "its poses are misread: {:.0} % of the returns meet those of other scans near by, and {:.0} % {how}",
                100.0 * given,
                100.0 * read
            ));
        }
        if let Some(calibration) = self.calibration.as_ref().filter(|found| found.pays()) {
            let off: Vec<String> = calibration.off().map(off_in_words).collect();
            parts.push(format!(
                "{}, by the scans themselves (surfaces are {:.1} cm thick, else {:.1} cm)",
                off.join(", "),
                100.0 * calibration.after_m,
                100.0 * calibration.before_m
            ));
        }
        (!parts.is_empty()).then(|| parts.join("; then "))
    }
}

fn in_words(mend: &Mend) -> &'static str {
    match mend {
        Mend::PosesAs(_) => "with poses read as they are meant",
        Mend::Extrinsic(_) => "with the sensor mounted another way",
        Mend::TimeOffset(_) => "at other times",
        Mend::PoseAt(_) | Mend::IgnorePointTimes => "posed another way",
    }
}

/// A number that is off, in units that people use.
pub(super) fn off_in_words(one: Estimate) -> String {
    let Estimate { axis, value, half, .. } = one;
    let (ms, degrees, cm) = (1e3, 1.0_f64.to_degrees(), 100.0);
    match axis {
        Axis::Time if value < 0.0 => {
            format!("its poses hold {:.1} ± {:.1} ms later than they are taken for", -ms * value, ms * half)
        }
        Axis::Time => {
            format!("its poses hold {:.1} ± {:.1} ms earlier than they are taken for", ms * value, ms * half)
        }
        Axis::Sweep => format!(
            "the points of a scan are at one instant already, their times are {value:.2} ± {half:.2} of true"
        ),
        Axis::Roll | Axis::Pitch | Axis::Yaw => {
            format!("the sensor's {} is off by {:.2} ± {:.2}°", axis.name(), -degrees * value, degrees * half)
        }
        Axis::X | Axis::Y | Axis::Z => {
            format!("the sensor's {} is off by {:.1} ± {:.1} cm", axis.name(), -cm * value, cm * half)
        }
    }
}

/// What vetting came to.
#[derive(Debug)]
pub struct Vetted {
    /// The runs to be scored, put right where that was asked for.
    pub runs: Vec<Run>,
    /// What was found of each run that was given.
    pub found: Vec<Found>,
    /// Whether what is wrong was put right.
    pub mended: bool,
    /// What all runs are off by alike: then it is not they.
    pub alike: Vec<Estimate>,
    /// Whether the log's times of points are true though they are not used: who opens the log with them may look and say so.
    pub times_are_true: bool,
}

impl Vetted {
    /// Everything that was found, a sentence each, what concerns all runs first.
    pub fn messages_with(&self, name: &dyn Fn(SettingName) -> String) -> Vec<String> {
        let alike = (!self.alike.is_empty()).then(|| {
            let axes: Vec<String> = self.alike.iter().copied().map(off_in_words).collect();
            let blame = if self.alike.iter().any(|one| one.axis == Axis::Time) {
                format!(
                    "the log's clock, or the instant that its stamps stand for ({}), is the first to blame",
                    name(SettingName::StampAt)
                )
            } else {
                "what is said of the sensor's mounting is the first to blame".to_owned()
            };
            format!("all runs are off alike: {}; {blame}", axes.join(", "))
        });
        let times = self.times_are_true.then(|| {
            format!(
                "the points of a scan were measured one after another, at the times that the log gives them: leave {} out to use these",
                name(SettingName::PointTime)
            )
        });
        let of_runs = self.found.iter().filter_map(|found| found.message_with(self.mended, name));
        times.into_iter().chain(alike).chain(of_runs).collect()
    }

    /// Of each run that was given, whether it is scored.
    pub fn is_kept(&self) -> Vec<bool> {
        self.found.iter().map(|found| found.left_out.is_none()).collect()
    }

    /// Puts into the report of its runs what was found of them.
    pub fn tell(&self, report: &mut Report, name: &dyn Fn(SettingName) -> String) {
        for found in &self.found {
            if found.left_out.is_some() {
                let reason = found.message_with(self.mended, name).unwrap_or_default();
                report.left_out.push(LeftOutReport { name: found.name.clone(), reason });
            }
            let of_run = report.inputs.runs.iter_mut().find(|run| run.name == found.name);
            if let Some(run) = of_run {
                run.conventions = Some(found.report(self.mended, name));
            }
        }
        let messages = self.messages_with(name).into_iter().map(Warning::Other);
        report.warnings.splice(0..0, messages);
    }

    /// Whether the points of the log are at one instant already by every run that tells.
    pub fn points_are_corrected(&self) -> bool {
        self.all_sweeps(|sweep| sweep.value + sweep.half < 0.5)
    }

    /// Whether the points of the log were measured one after another, by every run that tells.
    pub fn points_are_raw(&self) -> bool {
        self.all_sweeps(|sweep| sweep.value - sweep.half > 0.5)
    }

    fn all_sweeps(&self, holds: impl Fn(&Estimate) -> bool) -> bool {
        let seen = || {
            let calibrated = self.found.iter().filter_map(|found| found.calibration.as_ref());
            calibrated.map(|calibration| calibration.of(Axis::Sweep)).filter(|sweep| sweep.is_seen)
        };
        seen().next().is_some() && seen().all(|sweep| holds(&sweep))
    }
}
