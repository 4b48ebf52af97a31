//! Messages on standard error before and after scoring.

use dmp::Report;
use dmp_draw::text::{self, counted};
use dmp_log::LogSummary;
use dmp_sensor::Trajectory;

use super::extrinsic::BodyFromSensor;
use super::loaded_run::LoadedRun;
use super::log_input::LogHead;
use crate::console::{Hosted, say};

/// What was found: a line for the log, a line for what was guessed of it, a line for each run.
pub(crate) fn found(host: &Hosted, log: LogHead<'_>, runs: &[LoadedRun]) {
    let summary = log.summary;
    say!(host, "{}: {}", summary.path.display(), log_in_words(summary, log.scans));
    let notes: Vec<&str> =
        summary.notes.iter().map(String::as_str).chain(summary.without_checksums()).collect();
    if !notes.is_empty() {
        say!(host, "note: {}", notes.join("; "));
    }
    for run in runs {
        say!(host, "{}: {}", run.name, run_in_words(run, summary));
    }
}

/// Where the sensor sits on each run's body, and who says so; in one line where it is the same for all.
pub(crate) fn extrinsics(host: &Hosted, runs: &[LoadedRun], extrinsics: &[BodyFromSensor]) {
    match extrinsics {
        [first, ..] if extrinsics.iter().all(|extrinsic| extrinsic == first) => {
            say!(host, "body_from_sensor: {}", first.source);
        }
        _ => {
            for (run, extrinsic) in runs.iter().zip(extrinsics) {
                say!(host, "{}: body_from_sensor: {}", run.name, extrinsic.source);
            }
        }
    }
}

fn run_in_words(run: &LoadedRun, log: &LogSummary) -> String {
    let pairing = match (log.span_ns, run.trajectory.stamps_ns()) {
        (Some(_), Some(_)) => "found by stamp",
        (Some(_), None) => {
            "the n-th pose for the n-th scan, at its stamp (else --pose-at start, middle or end)"
        }
        _ => "the n-th pose for the n-th scan",
    };
    let poses = poses_in_words(&run.trajectory);
    let mut parts = vec![format!("{}: {}, {poses}, {pairing}", run.given, run.format)];
    if run.out_of_order > 0 {
        parts.push(format!("{} out of order of time, sorted", counted(run.out_of_order as u64, "pose")));
    }
    if run.repeated > 0 {
        parts.push(format!("{} excluded", counted(run.repeated as u64, "repeated pose")));
    }
    parts.extend(run.notes.iter().cloned());
    parts.join("; ")
}

fn log_in_words(summary: &LogSummary, scans: usize) -> String {
    let topic = summary.topic.as_ref().map_or(String::new(), |topic| format!(", topic {topic}"));
    let span = match (summary.span_ns, summary.period_ns) {
        (Some((first, last)), Some(period_ns)) => {
            let span = text::duration(text::seconds(last.saturating_sub(first)));
            format!(" over {span} ({} Hz)", text::digits(1.0 / text::seconds(period_ns)))
        }
        (None, _) => " without stamps".to_owned(),
        _ => String::new(),
    };
    let scans = counted(scans as u64, "scan");
    // An index does not have their number.
    let returns = match summary.returns {
        0 => String::new(),
        returns => format!(", {}", counted(returns, "return")),
    };
    let mut parts = vec![format!("{}{topic}", summary.format.name()), format!("{scans}{span}{returns}")];
    parts.push(match &summary.point_times {
        Some(meaning) => format!("times of points: {meaning}"),
        None => "no times of points".to_owned(),
    });
    if !summary.damage.is_empty() {
        parts.push(format!(
            "DAMAGED in {}",
            counted(summary.damage.iter().map(|lost| lost.places).sum(), "place")
        ));
    }
    parts.join("; ")
}

/// How many poses over which time.
fn poses_in_words(trajectory: &Trajectory) -> String {
    let poses = counted(trajectory.len() as u64, "pose");
    match trajectory.stamps_ns() {
        Some([first, .., last]) => {
            format!("{poses} over {}", text::duration(text::seconds(last.saturating_sub(*first))))
        }
        Some(_) => poses,
        None => format!("{poses} without stamps"),
    }
}

/// What it took.
pub(crate) fn done(host: &Hosted, report: &Report) {
    let total_s = report.timing.total_s;
    let inputs = &report.inputs;
    let returns = inputs.returns_used + inputs.dropped.0.get("not_drawn").copied().unwrap_or(0);
    let rate = text::short(returns as f64 / total_s.max(1e-9));
    // A program that runs the command has memory of its own, which is counted too.
    let peak = report.memory.peak_anon_bytes.filter(|_| host.program().is_none());
    let memory = match dmp::peak_bytes().filter(|_| host.program().is_none()) {
        Some(peak) => format!("; {} of memory", text::bytes(peak)),
        None => String::new(),
    };
    let budget = report.memory.budget_bytes as u64;
    if let Some(peak) = peak.filter(|&peak| peak > budget + budget / 10) {
        say!(
            host,
            "note: {} of memory were used, more than --memory {}: each run needs a minimum",
            text::bytes(peak),
            text::bytes(budget)
        );
    }
    say!(
        host,
        "{} scored for {} in {} ({rate} returns/s){memory}",
        counted(returns, "return"),
        counted(report.runs.len() as u64, "run"),
        text::duration(total_s)
    );
}
