use dmp_reduce::Confidence;
use dmp_report::{LeftOutReport, Report, Verdict};

use super::*;
use crate::sample_data::scores;

fn versions() -> Vec<String> {
    vec!["old".into(), "new".into()]
}

/// The samples' report with two of its runs named old and new, and this verdict.
fn report(better: Option<&str>, new_cm: f64) -> Report {
    let mut report = scores();
    for run in &mut report.runs {
        run.name = renamed(&run.name);
    }
    for name in &mut report.order {
        *name = renamed(name);
    }
    report.pairs.retain(|pair| pair.is_of("truth", "noise"));
    for pair in &mut report.pairs {
        (pair.a, pair.b) = (renamed(&pair.a), renamed(&pair.b));
        pair.verdict = match better {
            Some(run) => Verdict::Better { run: run.into(), decided_at_m: Some(2.0) },
            None => Verdict::Undecided,
        };
        let is_new_first = pair.a == "new";
        let means_m2 = [Some(0.01), Some((0.01 * new_cm) * (0.01 * new_cm))];
        let scale = &mut pair.scales[2];
        [scale.mean_a_m2, scale.mean_b_m2] = if is_new_first { [means_m2[1], means_m2[0]] } else { means_m2 };
    }
    for pair in report.drift.iter_mut().flat_map(|drift| &mut drift.comparisons) {
        (pair.a, pair.b) = (renamed(&pair.a), renamed(&pair.b));
    }
    report
}

fn renamed(name: &str) -> String {
    match name {
        "truth" => "old".into(),
        "noise" => "new".into(),
        other => other.into(),
    }
}

fn log(name: &str, report: Report) -> SuiteLog {
    SuiteLog { name: name.into(), report: Ok(report), missing: Vec::new() }
}

/// New is better on all but the last, where it loses.
fn nine() -> Vec<SuiteLog> {
    let mut logs: Vec<SuiteLog> =
        (0..9).map(|k| log(&format!("log {k}"), report(Some("new"), 9.0))).collect();
    logs.push(log("tunnel", report(None, 11.0)));
    logs
}

#[test]
fn versions_are_compared_over_all_logs() {
    let found = suite_report(&versions(), &nine(), Confidence::P99, Failures::Worse);
    let [pair] = found.pairs.as_slice() else { panic!("{:?}", found.pairs) };
    assert_eq!((pair.outcome, pair.better.as_deref()), (Outcome::Better, Some("new")));
    assert_eq!((pair.compared, pair.a_better, pair.b_better, pair.undecided), (10, 0, 9, 1));
    assert_eq!(pair.p_value, 2.0 / 512.0);
    assert_eq!(pair.reason, "better on 9 of 10 logs, worse on 0 (sign test, p = 0.0039)");
    // Old is 10 cm off, new 9 cm.
    assert!((pair.rms_difference.median_m.unwrap() - 0.01).abs() < 1e-12);
    let [low_m, high_m] = pair.rms_difference.interval_m.unwrap();
    assert!((low_m + 0.01).abs() < 1e-12 && (high_m - 0.01).abs() < 1e-12, "{low_m} {high_m}");
    assert_eq!((pair.scale_m, pair.rms_difference.logs), (Some(0.5), 10));
    let drift = scores().drift.unwrap().comparisons;
    let drift = drift.iter().find(|pair| pair.a == "truth" && pair.b == "noise");
    let expected = drift.map(|drift| drift.rms_a_m.unwrap() - drift.rms_b_m.unwrap());
    assert_eq!(pair.drift_difference.median_m, expected);
    assert_eq!((found.worst_first[0].as_str(), pair.logs[0].log.as_str()), ("tunnel", "tunnel"));
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn a_log_where_the_later_version_loses_stands_first() {
    let mut logs = nine();
    logs.push(log("hill", report(Some("old"), 10.5)));
    let found = suite_report(&versions(), &logs, Confidence::P99, Failures::Skip);
    assert_eq!(found.worst_first[..2], ["hill", "tunnel"]);
    assert_eq!(found.pairs[0].outcome, Outcome::Undecided);
    assert_eq!((found.pairs[0].worse("new"), found.pairs[0].worse("old")), (1, 9));
}

#[test]
fn what_is_not_compared_is_reported() {
    let mut logs = nine();
    logs.truncate(3);
    logs.push(SuiteLog { name: "lost".into(), report: Err("no such file".into()), missing: Vec::new() });
    let mut left_out = report(None, 9.0);
    left_out.pairs.clear();
    left_out.runs.retain(|run| run.name != "new");
    left_out.order.retain(|name| name != "new");
    left_out.left_out =
        vec![LeftOutReport { name: "new".into(), reason: "run `new` is excluded: it has no pose".into() }];
    logs.push(log("odd", left_out));
    let found = suite_report(&versions(), &logs, Confidence::P99, Failures::Skip);
    assert_eq!((found.pairs[0].outcome, found.pairs[0].compared), (Outcome::TooFewLogs, 3));
    assert_eq!(
        found.pairs[0].reason,
        "too few logs: 8 needed, even if all of them agree, and 3 compare both"
    );
    let expected = [
        "lost was not scored: no such file",
        "new fails on 1 of 5 logs (odd): these are not counted; on odd: run `new` is excluded: it has no pose",
    ];
    assert_eq!(found.warnings, expected);
    assert_eq!(found.log("odd").unwrap().missing[0].reason, "run `new` is excluded: it has no pose");
    assert_eq!(found.worst_first.len(), 4);
    // Who fails, loses.
    let found = suite_report(&versions(), &logs, Confidence::P99, Failures::Worse);
    let [pair] = found.pairs.as_slice() else { panic!("{:?}", found.pairs) };
    assert_eq!((pair.compared, pair.worse("new"), pair.failing_on("odd")), (4, 1, Some("new")));
    assert_eq!(found.worst_first[0], "odd");
    assert!(found.warnings[1].starts_with("new fails on 1 of 5 logs (odd): it counts as worse"));
}

#[test]
fn it_comes_back_from_json() {
    let found = suite_report(&versions(), &nine(), Confidence::P99, Failures::Worse);
    let text = serde_json::to_string(&found).unwrap();
    assert_eq!(serde_json::from_str::<SuiteReport>(&text).unwrap(), found);
}
