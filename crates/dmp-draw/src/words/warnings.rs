//! All that a report warns of, as sentences.

use dmp_report::Report;

/// Sentences that must stand beside the scores: the report's warnings, those of its runs, and why a run has no `R_cv` where
/// others do. What is said of several runs is said once, with their names.
pub fn warnings(report: &Report) -> Vec<String> {
    let mut of_runs: Vec<(String, Vec<&str>)> = Vec::new();
    for run in &report.runs {
        // Of low coverage the run warns itself.
        let why = run.r_cv_withheld.as_ref().filter(|why| !why.is_low_coverage());
        let why = why.filter(|_| report.is_cross_validated()).map(|why| format!("R_cv is not given: {why}"));
        for warning in why.into_iter().chain(run.warnings.iter().map(ToString::to_string)) {
            match of_runs.iter_mut().find(|(said, _)| *said == warning) {
                Some((_, runs)) => runs.push(&run.name),
                None => of_runs.push((warning, vec![&run.name])),
            }
        }
    }
    let all = report.warnings.iter().map(ToString::to_string);
    let named = of_runs.iter().map(|(warning, runs)| {
        let is_every = runs.len() > 2 && runs.len() == report.runs.len();
        let whose = if is_every { "every run".to_owned() } else { runs.join(", ") };
        format!("{whose}: {warning}")
    });
    all.chain(named).collect()
}
