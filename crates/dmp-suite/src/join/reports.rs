//! Joins several reports into one.

use dmp_report::{MemoryReport, PassTimes, Report};
use dmp_revisit::drift::DriftReport;

use super::error::JoinError;
use super::named::NamedReport;
use super::names::{self, Names};
use super::same;

/// Several reports as one.
#[derive(Debug, Clone, PartialEq)]
pub struct JoinedReport {
    /// Every run, and every pair that some report has. The runs are ordered by the decided pairs; remaining
    /// choices are ordered by the first score of the table. Times and written bytes are summed, memory is the
    /// maximum. The rest is that of the first report.
    pub report: Report,
    /// The names in it of each report's runs.
    pub runs_of: Vec<Vec<String>>,
    /// Pairs that no report has, in the order of the runs: they stay undecided.
    pub not_compared: Vec<[String; 2]>,
}

/// Joins reports of the same log, version, frames and settings. A run that several reports
/// have with the same name and scores is one run. Runs with only the name in common get the report's name as
/// prefix: `report/run`.
///
/// A pair needs a report that has both runs. Other pairs cannot be compared: a pair is judged on the returns
/// that both runs predict, and a report does not have these. [`join_results`](super::join_results) compares
/// them if they were saved.
///
/// # Errors
/// When they differ in one of these, one contradicts itself, or there is none.
pub fn join_reports(reports: &[NamedReport]) -> Result<JoinedReport, JoinError> {
    let (first, others) = reports.split_first().ok_or(JoinError::NoReports)?;
    reports.iter().try_for_each(names::check)?;
    others.iter().try_for_each(|other| same::check(first, other))?;
    let names = Names::new(reports)?;
    let mut joined = names.in_report(0, &first.report);
    for (k, other) in (1..).zip(others) {
        add(&mut joined, names.in_report(k, &other.report));
    }
    joined.warnings = warnings(reports);
    if !others.is_empty() {
        joined.rank();
    }
    let not_compared = pairs_of(&joined.order).filter(|[a, b]| joined.pair(a, b).is_none()).collect();
    Ok(JoinedReport { report: joined, runs_of: names.of_reports(), not_compared })
}

/// Adds what is new in another report.
fn add(joined: &mut Report, other: Report) {
    for (run, input) in other.runs.into_iter().zip(other.inputs.runs) {
        if joined.run(&run.name).is_none() {
            joined.runs.push(run);
            joined.inputs.runs.push(input);
        }
    }
    joined.left_out.extend(other.left_out);
    let here = joined.pairs.len();
    for pair in other.pairs {
        if joined.pair(&pair.a, &pair.b).is_none() {
            joined.pairs.push(pair);
        }
    }
    let (sure, of_other) = (&mut joined.promise.interval_confidence, other.promise.interval_confidence);
    if joined.pairs.len() > here {
        // The lower confidence of the two, where both are known.
        *sure = if here > 0 { sure.min(of_other) } else { of_other };
        joined.promise.of_each_result |= here > 0;
    }
    let (config, of_other) = (&mut joined.config, other.config);
    // It belongs to the runs, not the settings: kept if equal for all.
    config.body_from_sensor = config.body_from_sensor.filter(|here| of_other.body_from_sensor == Some(*here));
    config.voxel_filled_share =
        config.voxel_filled_share.filter(|here| of_other.voxel_filled_share == Some(*here));
    for (known, more) in
        [(&mut joined.inputs.notes, other.inputs.notes), (&mut joined.inputs.damage, other.inputs.damage)]
    {
        known.extend(more.into_iter().filter(|line| !known.contains(line)).collect::<Vec<_>>());
    }
    joined.drift = match (joined.drift.take(), other.drift) {
        (Some(here), Some(other)) => Some(drift_of(here, other)),
        (here, other) => here.or(other),
    };
    joined.timing = added(joined.timing, other.timing);
    joined.memory = most(joined.memory, other.memory);
}

/// The drift of the runs of both reports.
fn drift_of(mut here: DriftReport, other: DriftReport) -> DriftReport {
    for run in other.runs {
        if here.runs.iter().all(|known| known.name != run.name) {
            here.runs.push(run);
        }
    }
    for pair in other.comparisons {
        if here.comparisons.iter().all(|known| (&known.a, &known.b) != (&pair.a, &pair.b)) {
            here.comparisons.push(pair);
        }
    }
    here
}

/// The sum of both.
fn added(a: PassTimes, b: PassTimes) -> PassTimes {
    PassTimes {
        plan_s: a.plan_s + b.plan_s,
        fuse_s: a.fuse_s + b.fuse_s,
        trails_s: a.trails_s + b.trails_s,
        cast_s: a.cast_s + b.cast_s,
        drift_s: a.drift_s + b.drift_s,
        total_s: a.total_s + b.total_s,
        threads: a.threads.max(b.threads),
    }
}

fn most(a: MemoryReport, b: MemoryReport) -> MemoryReport {
    MemoryReport {
        budget_bytes: a.budget_bytes.max(b.budget_bytes),
        peak_anon_bytes: a.peak_anon_bytes.max(b.peak_anon_bytes),
        scratch_bytes: a.scratch_bytes.saturating_add(b.scratch_bytes),
        disk_bytes: a.disk_bytes.saturating_add(b.disk_bytes),
        disk_bytes_estimated: a.disk_bytes_estimated.saturating_add(b.disk_bytes_estimated),
        tile_loads: a.tile_loads.saturating_add(b.tile_loads),
        tiles_in_reach: a.tiles_in_reach.saturating_add(b.tiles_in_reach),
        tile_visits: a.tile_visits.saturating_add(b.tile_visits),
    }
}

/// Warnings of all reports, then those of some with their names.
fn warnings(reports: &[NamedReport]) -> Vec<String> {
    let of_all = |warning: &String| reports.iter().all(|named| named.report.warnings.contains(warning));
    let shared = reports.iter().take(1).flat_map(|named| named.report.warnings.iter().filter(|w| of_all(w)));
    let mut warnings: Vec<String> = shared.cloned().collect();
    for NamedReport { name, report: Report { warnings: own, .. }, .. } in reports {
        let own = own.iter().filter(|warning| !of_all(warning));
        warnings.extend(own.map(|warning| format!("{name}: {warning}")));
    }
    warnings
}

/// Every two of the names.
pub(super) fn pairs_of(names: &[String]) -> impl Iterator<Item = [String; 2]> {
    let after = |(k, a): (usize, &String)| {
        names.iter().skip(k + 1).map(|b| [a.clone(), b.clone()]).collect::<Vec<_>>()
    };
    names.iter().enumerate().flat_map(after).collect::<Vec<_>>().into_iter()
}
