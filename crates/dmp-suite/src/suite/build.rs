//! Builds the report of a suite.

use dmp_reduce::Confidence;
use dmp_report::{Report, RunReport};

use super::contents::{SuiteLogReport, SuitePromiseReport, SuiteReport};
use super::failures::Failures;
use super::log::SuiteLog;
use super::pair::{SuitePairReport, on_logs, report_of, signs};
use super::sign_test::judge;

/// Summarises the reports of all logs for every pair of versions.
///
/// On each log a pair is better, worse, mixed, same or undecided, by the log's own verdict. Over all logs,
/// better and worse are the signs of an exact two-sided sign test; the rest has no sign. All pairs of
/// versions share the error rate that `confidence` leaves. Logs are assumed independent: several of one place
/// on one day are not. `failures` says what becomes of a version without a score where the other has one.
pub fn suite_report(
    versions: &[String],
    logs: &[SuiteLog],
    confidence: Confidence,
    failures: Failures,
) -> SuiteReport {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for (k, a) in versions.iter().enumerate() {
        names.extend(versions.iter().skip(k + 1).map(|b| (a.as_str(), b.as_str())));
    }
    let found: Vec<_> = names.iter().map(|(a, b)| on_logs(logs, a, b)).collect();
    let failed: Vec<_> = names.iter().map(|(a, b)| failures.of(logs, a, b)).collect();
    let counted = names.iter().zip(found.iter().zip(&failed));
    let counted: Vec<_> =
        counted.map(|((a, b), ((on_logs, _), failed))| signs(on_logs, failed, a, b)).collect();
    let judged = judge(&counted, confidence);
    let each = confidence.of_each_look(names.len() as u32);
    let pairs: Vec<SuitePairReport> = names
        .iter()
        .zip(found)
        .zip(failed)
        .zip(counted.into_iter().zip(judged))
        .map(|(((&names, found), failed), (signs, judged))| {
            report_of(names, found, failed, signs, judged, each)
        })
        .collect();
    SuiteReport {
        schema: SuiteReport::SCHEMA.to_owned(),
        dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
        versions: versions.to_vec(),
        worst_first: worst_first(logs, &pairs),
        promise: SuitePromiseReport { confidence: confidence.level(), interval_confidence: each.level() },
        warnings: warnings(versions, logs, failures),
        logs: logs.iter().map(of_log).collect(),
        pairs,
    }
}

fn of_log(log: &SuiteLog) -> SuiteLogReport {
    let report = log.report.as_ref().ok();
    SuiteLogReport {
        name: log.name.clone(),
        order: report.map_or(Vec::new(), |report| report.order.clone()),
        missing: log.all_missing(),
        scans: report.map(|report| report.inputs.scans),
        travel_m: report.map(travel_m),
        damaged: report.is_some_and(|report| !report.inputs.damage.is_empty()),
        problem: log.report.as_ref().err().cloned(),
        result: None,
    }
}

/// The longest path of a run, metres.
fn travel_m(report: &Report) -> f64 {
    report.inputs.runs.iter().map(|run| run.segments.travel_m).fold(0.0, f64::max)
}

/// The scored logs: first by the number of pairs decided for the version named first, then by how much the
/// other loses.
fn worst_first(logs: &[SuiteLog], pairs: &[SuitePairReport]) -> Vec<String> {
    let loss = |log: &SuiteLog| {
        let on_log = || pairs.iter().filter_map(|pair| Some((pair, pair.on(&log.name)?)));
        let lost = on_log().filter(|(pair, on)| on.verdict.better() == Some(&pair.a)).count()
            + pairs.iter().filter(|pair| pair.failing_on(&log.name) == Some(&pair.b)).count();
        // a − b is smallest where b loses most.
        let by_m = on_log().filter_map(|(_, on)| on.rms_difference_m).fold(0.0_f64, f64::min);
        (lost, by_m)
    };
    let mut scored: Vec<_> =
        logs.iter().filter(|log| log.report.is_ok()).map(|log| (loss(log), log)).collect();
    scored.sort_by(|((lost_a, by_a), _), ((lost_b, by_b), _)| lost_b.cmp(lost_a).then(by_a.total_cmp(by_b)));
    scored.into_iter().map(|(_, log)| log.name.clone()).collect()
}

fn warnings(versions: &[String], logs: &[SuiteLog], failures: Failures) -> Vec<String> {
    let mut warnings = Vec::new();
    for log in logs {
        if let Err(problem) = &log.report {
            warnings.push(format!("{} was not scored: {problem}", log.name));
        }
    }
    for version in versions {
        let why = |log: &SuiteLog| log.all_missing().into_iter().find(|run| run.version == *version);
        let scored = logs.iter().filter(|log| log.report.is_ok());
        let without: Vec<_> = scored.filter_map(|log| Some((log.name.as_str(), why(log)?.reason))).collect();
        if let [(log, reason), ..] = without.as_slice() {
            let what = match failures {
                Failures::Worse => "it counts as worse there than any that does not",
                Failures::Skip => "these are not counted",
            };
            warnings.push(format!(
                "{version} fails on {} of {} logs ({}): {what}; on {log}: {reason}",
                without.len(),
                logs.len(),
                without.iter().map(|(log, _)| *log).collect::<Vec<_>>().join(", ")
            ));
        }
    }
    let blind: Vec<&str> = logs
        .iter()
        .filter(|log| {
            log.report.as_ref().is_ok_and(|report| report.runs.iter().all(RunReport::has_few_revisits))
        })
        .map(|log| log.name.as_str())
        .collect();
    if !blind.is_empty() {
        warnings.push(format!("few places are revisited, so drift is not visible, on {}", blind.join(", ")));
    }
    warnings
}
