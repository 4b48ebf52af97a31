//! Compares two versions over all logs: which of them each log counts for, and what the sign test makes of that.

use dmp_reduce::Confidence;
use dmp_report::{Report, Verdict};
use serde::{Deserialize, Serialize};

use super::effect::EffectReport;
use super::failures::FailureReport;
use super::log::SuiteLog;
use super::outcome::Outcome;
use super::sign_test::{Judged, Signs};

/// The scale, counted from the largest, at which differences of root mean squares are reported: 0.5 m on a
/// drive.
const REPORTED_SCALE: usize = 2;

/// Two versions over all logs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuitePairReport {
    /// The version named first.
    pub a: String,
    /// The other.
    pub b: String,
    /// The outcome.
    pub outcome: Outcome,
    /// The better version; null if none is.
    pub better: Option<String>,
    /// The probability that fair coins fall at least as unequally as `a_better` and `b_better`: the exact
    /// two-sided sign test.
    pub p_value: f64,
    /// Number of logs needed for a verdict if all agree.
    pub logs_needed: u64,
    /// Number of logs on which both were compared, or one of them fails.
    pub compared: u64,
    /// Number of those on which a is better.
    pub a_better: u64,
    /// On which b is better.
    pub b_better: u64,
    /// On which one is better overall, the other at places: no sign.
    pub mixed: u64,
    /// On which both are equal: no sign.
    pub same: u64,
    /// On which the pair is undecided: no sign.
    pub undecided: u64,
    /// The truncation of `rms_difference`, metres; null if it differs between logs.
    pub scale_m: Option<f64>,
    /// Root mean square residual of a minus that of b, on common returns.
    pub rms_difference: EffectReport,
    /// Root mean square drift of a minus that of b, on common pairs of visits.
    pub drift_difference: EffectReport,
    /// The verdict in words.
    pub reason: String,
    /// Each log on which both were compared, worst first: those where a is better, by most, and last those
    /// where b is.
    pub logs: Vec<LogPairReport>,
    /// The logs on which one of them fails and counts as worse; empty if failures are skipped.
    pub failures: Vec<FailureReport>,
}

impl SuitePairReport {
    /// Whether it is the pair of these two, in either order.
    pub fn is_of(&self, one: &str, other: &str) -> bool {
        (self.a == one && self.b == other) || (self.a == other && self.b == one)
    }

    /// The result on a log; `None` if they were not compared on it.
    pub fn on(&self, log: &str) -> Option<&LogPairReport> {
        self.logs.iter().find(|pair| pair.log == log)
    }

    /// The version that fails on a log on which the other stands.
    pub fn failing_on(&self, log: &str) -> Option<&str> {
        self.failures.iter().find(|failure| failure.log == log).map(|failure| failure.version.as_str())
    }

    /// Number of logs on which this version is worse than the other.
    pub fn worse(&self, version: &str) -> u64 {
        if self.a == version { self.b_better } else { self.a_better }
    }
}

/// Two versions on one log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogPairReport {
    /// The log.
    pub log: String,
    /// The log's verdict: `verdict`, `better_on_the_whole`, `decided_at_m` and `decided_by_drift`, as in the log's own
    /// result.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// Root mean square residual of a minus that of b, metres: negative if a is better.
    pub rms_difference_m: Option<f64>,
    /// Root mean square drift of a minus that of b, metres.
    pub drift_difference_m: Option<f64>,
}

/// Two versions on each log that has both, and the truncation of the difference.
pub(super) fn on_logs(logs: &[SuiteLog], a: &str, b: &str) -> (Vec<LogPairReport>, Option<f64>) {
    let mut scales_m = Vec::new();
    let each = |log: &SuiteLog| {
        let (pair, scale_m) = on_log(log.report.as_ref().ok()?, &log.name, a, b)?;
        scales_m.extend(scale_m);
        Some(pair)
    };
    let mut pairs: Vec<LogPairReport> = logs.iter().filter_map(each).collect();
    pairs.sort_by(|one, other| {
        let loss = |pair: &LogPairReport| pair.rms_difference_m.unwrap_or_default();
        side(one, a, b).cmp(&side(other, a, b)).then(loss(one).total_cmp(&loss(other)))
    });
    scales_m.dedup();
    (pairs, scales_m.first().copied().filter(|_| scales_m.len() == 1))
}

fn on_log(report: &Report, log: &str, a: &str, b: &str) -> Option<(LogPairReport, Option<f64>)> {
    let pair = report.pair(a, b)?;
    let sign = if pair.a == a { 1.0 } else { -1.0 };
    let scale = pair.scales.get(REPORTED_SCALE);
    let rms_m = scale.and_then(|scale| Some(scale.mean_a_m2?.sqrt() - scale.mean_b_m2?.sqrt()));
    let drift = report.drift.iter().flat_map(|drift| &drift.comparisons);
    let drift_m = drift.filter(|drift| drift.pairs > 0).find_map(|drift| {
        let difference_m = drift.rms_a_m? - drift.rms_b_m?;
        match (drift.a == a && drift.b == b, drift.a == b && drift.b == a) {
            (true, _) => Some(difference_m),
            (_, true) => Some(-difference_m),
            _ => None,
        }
    });
    let found = LogPairReport {
        log: log.to_owned(),
        verdict: pair.verdict.clone(),
        rms_difference_m: rms_m.map(|m| sign * m),
        drift_difference_m: drift_m,
    };
    Some((found, scale.map(|scale| scale.scale_m)))
}

/// Rank of a log for the version named later: 0 is worst.
fn side(pair: &LogPairReport, a: &str, b: &str) -> u8 {
    match (&pair.verdict, pair.verdict.ahead()) {
        (Verdict::Better { .. }, Some(run)) if run == a => 0,
        (Verdict::Mixed { .. }, Some(run)) if run == a => 1,
        (Verdict::Mixed { .. }, _) => 3,
        (Verdict::Better { .. }, Some(run)) if run == b => 4,
        _ => 2,
    }
}

pub(super) fn signs(logs: &[LogPairReport], failures: &[FailureReport], a: &str, b: &str) -> Signs {
    let better = |run: &str, other: &str| {
        let decided = logs.iter().filter(|log| log.verdict.better() == Some(run)).count();
        (decided + failures.iter().filter(|failure| failure.version == other).count()) as u64
    };
    Signs { a_better: better(a, b), b_better: better(b, a), compared: (logs.len() + failures.len()) as u64 }
}

/// The reported pair.
pub(super) fn report_of(
    (a, b): (&str, &str),
    (logs, scale_m): (Vec<LogPairReport>, Option<f64>),
    failures: Vec<FailureReport>,
    signs: Signs,
    judged: Judged,
    each: Confidence,
) -> SuitePairReport {
    let count = |is: &dyn Fn(&Verdict) -> bool| logs.iter().filter(|log| is(&log.verdict)).count() as u64;
    let ahead = if signs.a_better > signs.b_better { a } else { b };
    SuitePairReport {
        a: a.to_owned(),
        b: b.to_owned(),
        outcome: judged.outcome,
        better: (judged.outcome == Outcome::Better).then(|| ahead.to_owned()),
        p_value: judged.p_value,
        logs_needed: judged.logs_needed,
        compared: signs.compared,
        a_better: signs.a_better,
        b_better: signs.b_better,
        mixed: count(&|verdict| matches!(verdict, Verdict::Mixed { .. })),
        same: count(&|verdict| matches!(verdict, Verdict::Same)),
        undecided: count(&|verdict| matches!(verdict, Verdict::Undecided)),
        scale_m,
        rms_difference: EffectReport::of(logs.iter().map(|log| log.rms_difference_m), each),
        drift_difference: EffectReport::of(logs.iter().map(|log| log.drift_difference_m), each),
        reason: reason((a, b), signs, judged),
        logs,
        failures,
    }
}

fn reason((a, b): (&str, &str), signs: Signs, judged: Judged) -> String {
    let Signs { a_better, b_better, compared } = signs;
    let (wins, loses) = (a_better.max(b_better), a_better.min(b_better));
    let of = if compared == 1 { "1 log".to_owned() } else { format!("{compared} logs") };
    let p = p_in_words(judged.p_value);
    let needed = judged.logs_needed;
    match judged.outcome {
        Outcome::Better => format!("better on {wins} of {of}, worse on {loses} (sign test, {p})"),
        Outcome::TooFewLogs => {
            format!("too few logs: {needed} needed, even if all of them agree, and {compared} compare both")
        }
        Outcome::Undecided => {
            let few = match a_better + b_better {
                signs if signs < needed => format!("; {signs} logs decide, {needed} needed"),
                _ => String::new(),
            };
            format!("{a} is better on {a_better} of {of}, {b} on {b_better} (sign test, {p}){few}")
        }
    }
}

/// `p = 0.012`, or `p <` a bound.
fn p_in_words(p_value: f64) -> String {
    match p_value {
        p if p < 1e-4 => "p < 0.0001".to_owned(),
        p if p < 0.01 => format!("p = {p:.4}"),
        p => format!("p = {p:.2}"),
    }
}
