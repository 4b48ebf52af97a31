//! What the verdicts of a report promise together, in words.

use dmp_report::Report;

use crate::text::{confidence, left};

/// What the verdicts of a report promise together, in a sentence; nothing where there are none.
pub fn promise(report: &Report) -> Option<String> {
    let scales = report.pairs.iter().map(|pair| pair.scales.len()).max()?;
    let (error, sure) = (left(report.promise.confidence), confidence(report.promise.interval_confidence));
    let by_drift = report.pairs.iter().any(|pair| pair.verdict.is_by_drift());
    let drift = if by_drift { ", and as much again by drift" } else { "" };
    let looks = if report.sampling.quick.is_some() { " and looks" } else { "" };
    Some(if report.promise.of_each_result {
        format!(
            "Family-wise error rate {error} of each result, over its pairs and {scales} scales{looks}{drift}; each interval is at {sure} \
             or more."
        )
    } else {
        format!(
            "Family-wise error rate {error}, over all pairs and {scales} scales{looks}{drift}; each interval is at {sure}."
        )
    })
}
