//! All that a report warns of, as sentences.

use dmp_report::Report;

/// Sentences that must stand beside the scores: the report's warnings, those of its runs with their names, and why a
/// run has no `R_cv` where others do.
pub fn warnings(report: &Report) -> Vec<String> {
    let mut all: Vec<String> = report.warnings.iter().map(ToString::to_string).collect();
    for run in &report.runs {
        // Of low coverage the run warns itself.
        let why = run.r_cv_withheld.as_ref().filter(|why| !why.is_low_coverage());
        if let Some(why) = why.filter(|_| report.is_cross_validated()) {
            all.push(format!("{}: R_cv is not given: {why}", run.name));
        }
        all.extend(run.warnings.iter().map(|warning| format!("{}: {warning}", run.name)));
    }
    all
}
