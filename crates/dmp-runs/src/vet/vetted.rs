//! The result of vetting all runs, and its messages.

use dmp_report::LeftOutReport;
use dmp_revisit::calibrate::{Axis, Calibration, Estimate};

use super::found::{Found, off_in_words};
use super::mend::Mend;
use super::summary::VetSummary;
use crate::asked::{Run, SettingName};

/// The result of vetting.
#[derive(Debug)]
pub struct Vetted {
    /// The runs to score, fixed if requested.
    pub runs: Vec<Run>,
    /// The findings for each given run.
    pub found: Vec<Found>,
    /// Whether errors were fixed.
    pub mended: bool,
    /// The error that all runs share, though not all are copies of one: then the runs may not be its cause.
    pub alike: Vec<Estimate>,
    /// The numbers of the given runs in groups: those of a group are copies of one estimate.
    pub copies: Vec<Vec<usize>>,
    /// The findings on the times of points.
    pub point_times: PointTimes,
}

/// How the scans judge the times that the log gives its points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PointTimes {
    /// Nothing contradicts their current use.
    AsUsed,
    /// They are used, but the points are already motion-corrected: the estimated scale of the point times.
    Corrected(Estimate),
    /// The same, and the log was opened without them.
    LeftAside(Estimate),
    /// They are ignored but correct: detected by opening the log with them.
    Unused,
}

impl Vetted {
    /// All findings, a sentence each; those about all runs first.
    pub fn messages_with(&self, name: &dyn Fn(SettingName) -> String) -> Vec<String> {
        let alike = (!self.alike.is_empty()).then(|| {
            let axes: Vec<String> = self.alike.iter().copied().map(off_in_words).collect();
            let clock = self.alike.iter().any(|one| one.axis == Axis::Time).then(|| {
                format!("the log's clock, or the instant of its stamps ({}),", name(SettingName::StampAt))
            });
            let mounting = self.alike.iter().any(|one| one.axis != Axis::Time);
            let mounting = mounting.then(|| "the extrinsic".to_owned());
            let blame: Vec<String> = clock.into_iter().chain(mounting).collect();
            format!("all runs show the same error: {}; check {} first", axes.join(", "), blame.join(" and "))
        });
        let ignore = format!("{} ignore", name(SettingName::PointTime));
        let times = match self.point_times {
            PointTimes::AsUsed => None,
            PointTimes::Corrected(sweep) if self.mended => {
                Some(format!("{}, but the log cannot be read with {ignore}", off_in_words(sweep)))
            }
            PointTimes::Corrected(sweep) => Some(format!(
                "{}; fix it with {ignore}, or with {}",
                off_in_words(sweep),
                name(SettingName::Mend)
            )),
            PointTimes::LeftAside(sweep) => Some(format!("{}; fixed with {ignore}", off_in_words(sweep))),
            PointTimes::Unused => Some(format!(
                "the points of a scan were measured one after another, at the times in the log: remove {} to use them",
                name(SettingName::PointTime)
            )),
        };
        // If another run's clock is wrong, a clock that could not be checked may be wrong as well.
        let is_off = |found: &Found| {
            found.is_kept()
                && found.mends.iter().any(|mend| matches!(mend, Mend::TimeOffset(_) | Mend::PoseAt(_)))
        };
        let is_the_logs = self.alike.iter().any(|one| one.axis == Axis::Time);
        let clocks_are_off = !is_the_logs && self.found.iter().any(is_off);
        let of_runs = self.found.iter().flat_map(|found| {
            let unknown = if clocks_are_off { found.clock_is_unknown() } else { None };
            found.messages_with(self.mended, name).into_iter().chain(unknown)
        });
        let copies = self.copies.iter().filter(|group| group.len() > 1).map(|group| {
            let names: Vec<String> =
                group.iter().map(|&number| format!("`{}`", self.found[number].name)).collect();
            format!("runs {} are copies of one estimate: the same motion from pose to pose", names.join(", "))
        });
        times.into_iter().chain(alike).chain(copies).chain(of_runs).collect()
    }

    /// For each given run, whether it is scored.
    pub fn is_kept(&self) -> Vec<bool> {
        self.found.iter().map(Found::is_kept).collect()
    }

    /// The vetting part of the report; `name` gives the name of a setting.
    pub fn summary(&self, name: &dyn Fn(SettingName) -> String) -> VetSummary {
        let left_out = |found: &Found| {
            let reason = found.messages_with(self.mended, name).into_iter().next().unwrap_or_default();
            (!found.is_kept()).then(|| LeftOutReport { name: found.name.clone(), reason })
        };
        VetSummary {
            left_out: self.found.iter().filter_map(left_out).collect(),
            conventions: self
                .found
                .iter()
                .map(|found| (found.name.clone(), found.report(self.mended, name)))
                .collect(),
            messages: self.messages_with(name),
        }
    }

    /// Whether the points of the log were measured one after another, by every run that shows it.
    pub fn points_are_raw(&self) -> bool {
        all_sweeps(&self.found, |sweep| sweep.value - sweep.half > 0.5)
    }
}

/// The estimate that points are motion-corrected, if a run certainly shows it and no other run contradicts.
pub(super) fn corrected(found: &[Found]) -> Option<Estimate> {
    let corrected = found.iter().find_map(Found::points_are_corrected)?;
    all_sweeps(found, |sweep| sweep.value + sweep.half < 0.5).then_some(corrected)
}

fn all_sweeps(found: &[Found], holds: impl Fn(&Estimate) -> bool) -> bool {
    let seen = || {
        let calibrated = found.iter().filter_map(|found| found.calibration.as_ref());
        calibrated.map(|calibration| calibration.of(Axis::Sweep)).filter(|sweep| sweep.is_seen)
    };
    seen().next().is_some() && seen().all(|sweep| holds(&sweep))
}

/// The errors that all runs share, excluded runs aside; none for the copies of one estimate.
pub(super) fn alike(found: &[Found], copies: &[Vec<usize>]) -> Vec<Estimate> {
    let is_scored = |group: &&Vec<usize>| group.iter().any(|&number| found[number].is_kept());
    if copies.iter().filter(is_scored).count() < 2 {
        return Vec::new();
    }
    let scored = || found.iter().filter(|found| found.is_kept());
    let as_given = scored().filter(|found| found.together_as_read.is_none());
    let calibrations: Vec<&Calibration> = as_given.filter_map(|found| found.calibration.as_ref()).collect();
    if calibrations.len() < scored().count() {
        return Vec::new();
    }
    let [first, others @ ..] = calibrations.as_slice() else { return Vec::new() };
    let is_alike = |one: &Estimate| {
        let agrees = |other: &&Calibration| {
            let other = other.of(one.axis);
            other.pays && (other.value - one.value).abs() <= one.half + other.half
        };
        one.pays && one.axis != Axis::Sweep && !others.is_empty() && others.iter().all(agrees)
    };
    first.estimates.into_iter().filter(is_alike).collect()
}
