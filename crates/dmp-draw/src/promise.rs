//! What the verdicts of a report promise together, in words.

use dmp::Report;

use crate::text::{confidence, left};

/// What the verdicts of a report promise together, in a sentence; nothing where there are none.
pub fn promise(report: &Report) -> Option<String> {
    let scales = report.pairs.iter().map(|pair| pair.scales.len()).max()?;
    let shared_by = match report.sampling.looks {
        Some(_) => format!("all pairs, {scales} scales and the looks"),
        None => format!("all pairs and {scales} scales"),
    };
    let (error, sure) = (left(report.promise.confidence), confidence(report.promise.interval_confidence));
    Some(if report.promise.of_each_result {
        format!(
            "At most {error} of results tell any two equal runs apart, each by itself: {shared_by} of a result share that, \
             so each interval is at {sure} or more."
        )
    } else {
        format!(
            "At most {error} of commands tell any two equal runs apart: {shared_by} share that, so each interval is at {sure}."
        )
    })
}
