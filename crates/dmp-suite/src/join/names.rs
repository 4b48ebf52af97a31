//! Names of runs in a joined report.

use dmp_report::{Report, RunReport};

use super::error::JoinError;
use super::named::NamedReport;

/// Rejects a report whose parts do not name the same runs.
pub(super) fn check(named: &NamedReport) -> Result<(), JoinError> {
    let NamedReport { file, report: Report { runs, inputs, pairs, order, .. }, .. } = named;
    let no_run = |field: String, name: &str| {
        Err(JoinError::NoSuchRun { report: file.clone(), field, name: name.to_owned() })
    };
    let is_run = |name: &str| runs.iter().filter(|run| run.name == *name).count() == 1;
    for (k, run) in runs.iter().enumerate() {
        if !is_run(&run.name) || inputs.runs.get(k).is_none_or(|input| input.name != run.name) {
            return no_run(format!("runs[{k}]"), &run.name);
        }
    }
    for (k, name) in order.iter().enumerate() {
        if !is_run(name) || order.len() != runs.len() {
            return no_run(format!("order[{k}]"), name);
        }
    }
    for (k, pair) in pairs.iter().enumerate() {
        let stranger = pair.verdict.ahead().filter(|name| *name != pair.a && *name != pair.b);
        let wrong = [pair.a.as_str(), &pair.b].into_iter().find(|name| !is_run(name)).or(stranger);
        if let Some(name) = wrong {
            return no_run(format!("pairs[{k}]"), name);
        }
    }
    Ok(())
}

/// The new names of every report's runs.
#[derive(Debug)]
pub(super) struct Names(Vec<Vec<(String, String)>>);

impl Names {
    /// A run keeps its name if no other run has it.
    pub(super) fn new(reports: &[NamedReport]) -> Result<Self, JoinError> {
        let all = || reports.iter().flat_map(|named| named.report.runs.iter().map(move |run| (named, run)));
        let name = |run: &RunReport| {
            let alone = all().all(|(_, other)| other.name != run.name || is_same(other, run));
            let first = all().find(|(_, other)| is_same(other, run));
            match first.filter(|_| !alone) {
                Some((named, _)) => format!("{}/{}", named.name, run.name),
                None => run.name.clone(),
            }
        };
        let given: Vec<(String, &RunReport)> = all().map(|(_, run)| (name(run), run)).collect();
        for (k, (name, run)) in given.iter().enumerate() {
            if given.iter().take(k).any(|(other, known)| other == name && !is_same(known, run)) {
                return Err(JoinError::SameName { name: name.clone() });
            }
        }
        let mut given = given.into_iter().map(|(name, run)| (run.name.clone(), name));
        let of_report = |named: &NamedReport| given.by_ref().take(named.report.runs.len()).collect();
        Ok(Self(reports.iter().map(of_report).collect()))
    }

    /// The new names, report by report.
    pub(super) fn of_reports(&self) -> Vec<Vec<String>> {
        self.0.iter().map(|runs| runs.iter().map(|(_, new)| new.clone()).collect()).collect()
    }

    /// The `k`-th report with its runs under their new names.
    pub(super) fn in_report(&self, k: usize, report: &Report) -> Report {
        let mut report = report.clone();
        let rename = |name: &mut String| {
            if let Some((_, new)) = self.0[k].iter().find(|(old, _)| old == name) {
                name.clone_from(new);
            }
        };
        report.runs.iter_mut().for_each(|run| rename(&mut run.name));
        report.inputs.runs.iter_mut().for_each(|run| rename(&mut run.name));
        report.order.iter_mut().chain(report.ties.iter_mut().flatten()).for_each(rename);
        if let Some(drift) = &mut report.drift {
            drift.runs.iter_mut().for_each(|run| rename(&mut run.name));
            for pair in &mut drift.comparisons {
                [&mut pair.a, &mut pair.b].into_iter().chain(&mut pair.better).for_each(rename);
            }
        }
        for pair in &mut report.pairs {
            [&mut pair.a, &mut pair.b].into_iter().chain(pair.verdict.run_mut()).for_each(rename);
        }
        report
    }
}

/// Whether two are one run: the same name and scores, whatever their other fields.
fn is_same(a: &RunReport, b: &RunReport) -> bool {
    RunReport { warnings: Vec::new(), ..a.clone() } == RunReport { warnings: Vec::new(), ..b.clone() }
}
