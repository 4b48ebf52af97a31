//! The vetting result of a run, and its messages.

use dmp_report::{ConventionsReport, EstimateReport, PoseAt};
use dmp_revisit::calibrate::{Axis, Calibration, Estimate, Silence};

use super::mend::Mend;
use crate::asked::{EvaluateError, Run, SettingName};

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
    /// The instant of the scans at which its poses hold, by the scans: of a run without stamps, for which nothing was chosen.
    pub instant: Option<PoseAt>,
    /// Whether they can be applied to the run; a pose format cannot be changed once an odometry interpolates
    /// between the poses.
    pub can_be_mended: bool,
    /// Whether, by this run alone, the points are already motion-corrected: then its clock and extrinsic are
    /// not judged.
    pub is_at_odds: bool,
    /// Why it has no poses for the log's scans.
    pub not_paired: Option<Box<EvaluateError>>,
    /// Whether most scans have hardly any return in use: then nothing can be said of it.
    pub is_thin: bool,
    /// What suggests that its poses are those of another log, with the fixes applied.
    pub doubt: Option<Doubt>,
}

/// What suggests that the poses of a run are those of another log.
#[derive(Debug, Clone, Copy)]
pub struct Doubt {
    /// Which test.
    pub test: DoubtTest,
    /// Share of the returns that meet another scan as the run says, and otherwise.
    pub together: [f64; 2],
    /// Whether its own scans contradict the run beyond doubt: otherwise it is scored.
    pub is_certain: bool,
}

/// How the scans of a run are put together otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DoubtTest {
    /// At the poses of other scans.
    OtherPoses,
    /// Without the turns.
    NoTurns,
}

impl Doubt {
    pub(super) fn message(&self) -> String {
        let [own, other] = self.together.map(|share| format!("{:.0} %", 100.0 * share));
        let (where_, how) = match self.test {
            DoubtTest::OtherPoses => ("", "with the poses of other scans"),
            DoubtTest::NoTurns => ("in turns, ", "without the turn"),
        };
        let what = format!("{where_}{own} of the returns meet those of nearby scans, {other} {how}");
        if self.is_certain {
            format!("its poses do not match the scans of this log: {what}")
        } else {
            format!("its poses may be those of another log: {what}")
        }
    }
}

impl Found {
    /// Whether it is scored: it has poses for the scans, and these do not contradict it beyond doubt.
    pub fn is_kept(&self) -> bool {
        self.not_paired.is_none() && !self.doubt.is_some_and(|doubt| doubt.is_certain)
    }

    /// Whether its numbers need a second look: another reading fits better, or its poses may be those of another log.
    pub fn is_doubtful(&self, mended: bool) -> bool {
        self.doubt.is_some() || (self.together_as_read.is_some() && !(mended && self.can_be_mended))
    }

    /// The findings and their fixes, each in a sentence; `name` gives the name of a setting.
    pub fn messages_with(&self, mended: bool, name: &dyn Fn(SettingName) -> String) -> Vec<String> {
        let head = if self.is_kept() { "" } else { " is excluded" };
        let of_run = |what: String| format!("run `{}`{head}: {what}", self.name);
        if let Some(error) = &self.not_paired {
            let (text, own) = (error.message_with(name), format!("run `{}`: ", self.name));
            return vec![of_run(text.strip_prefix(&own).unwrap_or(&text).to_owned())];
        }
        let doubt = self.doubt.map(|doubt| of_run(doubt.message()));
        let instant = self.instant.map(|at| {
            let option = SettingName::PoseAt.for_run(&self.name, &PoseAt::Stamp.to_string(), name);
            format!(
                "run `{}`: its poses hold at the {at} of the scans, by the scans; {option} has them at the stamps",
                self.name
            )
        });
        let fix = self.what().map(|what| {
            let options = self.options(name).join(" ");
            if options.is_empty() {
                format!("run `{}`: {what}", self.name)
            } else if mended && self.can_be_mended {
                format!("run `{}`: {what}; fixed with {options}", self.name)
            } else if self.can_be_mended {
                let mend = name(SettingName::Mend);
                format!("run `{}`: {what}; fix it with {options}, or with {mend}", self.name)
            } else {
                format!("run `{}`: {what}; fix it with {options}", self.name)
            }
        });
        doubt.into_iter().chain(instant).chain(fix).collect()
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
            doubtful: self.is_doubtful(mended),
        }
    }

    /// The run with its fixes, and at its instant.
    pub(super) fn fixed(&self, run: &Run) -> Run {
        let mut run = Run { pose_at: self.instant.or(run.pose_at), ..run.clone() };
        self.mends.iter().for_each(|mend| mend.apply(&mut run));
        run
    }

    fn options(&self, name: &dyn Fn(SettingName) -> String) -> Vec<String> {
        self.mends.iter().map(|mend| mend.message_with(&self.name, name)).collect()
    }

    /// Why its clock could not be checked, if so.
    pub(super) fn clock_is_unknown(&self) -> Option<String> {
        let as_given = self.is_kept() && self.together_as_read.is_none();
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
            "its scans fit best with part of the point times, so something else is wrong: a lost run, or poses of another log".to_owned()
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
