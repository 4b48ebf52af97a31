//! Reports beside each other: of runs of one log that were scored apart, under one setting.

mod names;
mod same;

use dmp_reduce::order_runs;

use crate::report::{MemoryReport, PairReport, PassTimes, Report, RunReport};
use names::Names;

/// A report, and what to call it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedReport {
    /// Stands in front of the names of runs that other reports have too.
    pub name: String,
    /// The file that it is from, or what else messages are to call it.
    pub file: String,
    /// The report.
    pub report: Report,
}

/// Several reports as one.
#[derive(Debug, Clone, PartialEq)]
pub struct JoinedReport {
    /// Every run, and every pair that some report holds. The runs are ordered along the decided pairs, and where
    /// these leave a choice by the first score of the table. What took time is added up, and so is what was written;
    /// of memory it is the most. The rest is that of the first report.
    pub report: Report,
    /// The names that the runs of each report have in it.
    pub runs_of: Vec<Vec<String>>,
    /// Pairs that no report holds: nothing is decided of them. They stand in the order of the runs.
    pub not_compared: Vec<[String; 2]>,
}

/// Why reports cannot stand beside each other.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum JoinError {
    /// There is nothing to join.
    #[error("no result to compare")]
    NoReports,
    /// Their scores cannot be compared.
    #[error(
        "{} and {} were not made with the same {what}: {field} is {} and {}",
        reports[0], reports[1], values[0], values[1]
    )]
    Different {
        /// The two.
        reports: Box<[String; 2]>,
        /// What they do not have in common.
        what: &'static str,
        /// The field of the JSON that differs.
        field: String,
        /// Its value in each.
        values: Box<[String; 2]>,
    },
    /// What was scored depends on which runs there were.
    #[error(
        "{report}: made with --quick, where places and their maps depend on all runs of a command: score runs in one to \
         compare them"
    )]
    OfPlaces {
        /// The report.
        report: String,
    },
    /// A report contradicts itself.
    #[error("{report}: {field} names `{name}`, which is not the name of one run")]
    NoSuchRun {
        /// The report.
        report: String,
        /// The field of the JSON.
        field: String,
        /// What stands there.
        name: String,
    },
    /// Two runs cannot be told apart.
    #[error("two runs would be called `{name}`: give the results names of their own, as NAME=FILE")]
    SameName {
        /// The name.
        name: String,
    },
}

impl JoinError {
    /// Whether the names that were given are at fault, rather than the reports.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoReports | Self::SameName { .. })
    }
}

/// Puts reports beside each other that were made of the same log, with the same version, frames, segments, returns
/// and settings. A run that several reports hold, under one name with the same scores, is one run; two that only have
/// a name in common get those of their reports in front, as `report/run`.
///
/// Pairs are taken from reports that hold both runs. No others can be compared: a pair is judged on the returns that
/// both runs predict, and a report does not say which these are.
///
/// # Errors
/// When they were not made alike, one contradicts itself, or there is none.
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
        put_in_order(&mut joined);
    }
    let not_compared = pairs_of(&joined.order).filter(|pair| find(&joined.pairs, pair).is_none()).collect();
    Ok(JoinedReport { report: joined, runs_of: names.of_reports(), not_compared })
}

/// Adds what is new in another report.
fn add(joined: &mut Report, other: Report) {
    for (run, input) in other.runs.into_iter().zip(other.inputs.runs) {
        if !joined.runs.iter().any(|known| known.name == run.name) {
            joined.runs.push(run);
            joined.inputs.runs.push(input);
        }
    }
    for pair in other.pairs {
        if find(&joined.pairs, &[pair.a.clone(), pair.b.clone()]).is_none() {
            joined.pairs.push(pair);
        }
    }
    let (config, of_other) = (&mut joined.config, other.config);
    // Of the runs, not of the settings: given where it is the same for all.
    config.body_from_sensor = config.body_from_sensor.filter(|here| of_other.body_from_sensor == Some(*here));
    config.voxel_filled_share =
        config.voxel_filled_share.filter(|here| of_other.voxel_filled_share == Some(*here));
    for (known, more) in
        [(&mut joined.inputs.notes, other.inputs.notes), (&mut joined.inputs.damage, other.inputs.damage)]
    {
        known.extend(more.into_iter().filter(|line| !known.contains(line)).collect::<Vec<_>>());
    }
    // As sure as the intervals of either are.
    let sure = &mut joined.promise.interval_confidence;
    *sure = sure.min(other.promise.interval_confidence);
    joined.timing = added(joined.timing, other.timing);
    joined.memory = most(joined.memory, other.memory);
}

/// One after the other.
fn added(a: PassTimes, b: PassTimes) -> PassTimes {
    PassTimes {
        plan_s: a.plan_s + b.plan_s,
        fuse_s: a.fuse_s + b.fuse_s,
        trails_s: a.trails_s + b.trails_s,
        cast_s: a.cast_s + b.cast_s,
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

/// What all reports warn of, then what only some do, with their names.
fn warnings(reports: &[NamedReport]) -> Vec<String> {
    let of_all = |warning: &String| reports.iter().all(|named| named.report.warnings.contains(warning));
    let shared = reports.iter().take(1).flat_map(|named| named.report.warnings.iter().filter(|w| of_all(w)));
    let mut warnings: Vec<String> = shared.cloned().collect();
    for named in reports {
        let own = named.report.warnings.iter().filter(|warning| !of_all(warning));
        warnings.extend(own.map(|warning| format!("{}: {warning}", named.name)));
    }
    warnings
}

/// Orders the runs along the decided pairs, else by their first score; neighbours are tied where their own pair is
/// there and decides nothing, or contradicts others.
fn put_in_order(joined: &mut Report) {
    let near = joined.runs.iter().any(|run| run.coverage.is_none());
    let score = |run: &RunReport| if near { run.r_near_m2[0] } else { run.r_cv_m2[0] };
    let scores_m2: Vec<Option<f64>> = joined.runs.iter().map(score).collect();
    let place = |name: &str| joined.runs.iter().position(|run| run.name == name);
    let decided = |pair: &PairReport| {
        let worse = if pair.verdict == pair.a { &pair.b } else { &pair.a };
        // Mixed, the same and undecided are the names of no run.
        Some((place(&pair.verdict)?, place(worse)?))
    };
    let decided: Vec<(usize, usize)> = joined.pairs.iter().filter_map(decided).collect();
    let ranked = order_runs(&scores_m2, &decided);
    let name = |run: usize| joined.runs[run].name.clone();
    let tied = ranked.windows(2).filter(|pair| pair[0].tied_with_next);
    let ties = tied.map(|pair| [name(pair[0].run), name(pair[1].run)]);
    let ties = ties.filter(|pair| find(&joined.pairs, pair).is_some()).collect();
    let order = ranked.iter().map(|ranked| name(ranked.run)).collect();
    joined.ties = ties;
    joined.order = order;
}

/// Every two of the names.
fn pairs_of(names: &[String]) -> impl Iterator<Item = [String; 2]> {
    let after = |(k, a): (usize, &String)| {
        names.iter().skip(k + 1).map(|b| [a.clone(), b.clone()]).collect::<Vec<_>>()
    };
    names.iter().enumerate().flat_map(after).collect::<Vec<_>>().into_iter()
}

/// The pair of two runs, whichever stands first.
fn find<'a>(pairs: &'a [PairReport], [a, b]: &[String; 2]) -> Option<&'a PairReport> {
    pairs.iter().find(|pair| (&pair.a, &pair.b) == (a, b) || (&pair.a, &pair.b) == (b, a))
}

#[cfg(test)]
mod tests;
