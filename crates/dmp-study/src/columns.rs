//! The columns of a study, in their order.

use dmp::{Report, RunReport};

use crate::table::Column;

/// Which side of a study a column is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// A score without ground truth.
    Score,
    /// An error against ground truth.
    Truth,
}

/// Key, title, unit, whether lower is better, and how it is found in the report of `dmp score`.
type Score = (&'static str, &'static str, &'static str, bool, fn(&RunReport) -> Option<f64>);

const SCORES: [Score; 18] = [
    ("dmp_sum_m2", "DMP", "m²", true, |run| Some(run.dmp_sum_m2)),
    ("dmp_mean_m2", "DMP mean", "m²", true, |run| run.dmp_mean_m2),
    ("r_cv_10_m2", "R_cv 10", "m²", true, |run| run.r_cv_m2.at(10.0)),
    ("r_cv_2_m2", "R_cv 2", "m²", true, |run| run.r_cv_m2.at(2.0)),
    ("r_cv_1_m2", "R_cv 1", "m²", true, |run| run.r_cv_m2.at(1.0)),
    ("r_cv_0.5_m2", "R_cv 0.5", "m²", true, |run| run.r_cv_m2.at(0.5)),
    ("r_cv_0.2_m2", "R_cv 0.2", "m²", true, |run| run.r_cv_m2.at(0.2)),
    ("r_cv_0.05_m2", "R_cv 0.05", "m²", true, |run| run.r_cv_m2.at(0.05)),
    ("r_cv_0.02_m2", "R_cv 0.02", "m²", true, |run| run.r_cv_m2.at(0.02)),
    ("r_near_5_m2", "R_near 5", "m²", true, |run| run.r_near_m2.at(5.0)),
    ("r_near_2_m2", "R_near 2", "m²", true, |run| run.r_near_m2.at(2.0)),
    ("r_near_0.5_m2", "R_near 0.5", "m²", true, |run| run.r_near_m2.at(0.5)),
    ("r_near_0.2_m2", "R_near 0.2", "m²", true, |run| run.r_near_m2.at(0.2)),
    ("r_near_0.05_m2", "R_near 0.05", "m²", true, |run| run.r_near_m2.at(0.05)),
    ("miss_rate", "miss", "", true, |run| run.miss_rate),
    ("blocked_rate", "blocked", "", true, |run| run.blocked_rate),
    ("coverage", "coverage", "", false, |run| run.coverage),
    ("coverage_revisit", "revisit coverage", "", false, |run| run.coverage_revisit),
];

/// The scores of `dmp score`.
pub(crate) fn of_report(report: &Report) -> Vec<Column> {
    let column = |&(key, title, unit, lower_is_better, value): &Score| Column {
        key,
        title,
        unit,
        lower_is_better,
        values: report.runs.iter().map(value).collect(),
    };
    // Drives and rooms have truncations of their own.
    let scales = report.config.scales;
    let keys = |score: &str, scales_m: &[f64]| -> Vec<String> {
        scales_m.iter().map(|scale_m| format!("r_{score}_{scale_m}_m2")).collect()
    };
    let there = [keys("cv", &scales.lengths().cv_m), keys("near", &scales.lengths().near_m)].concat();
    let is_there = |(key, ..): &&Score| !key.starts_with("r_") || there.iter().any(|there| there == key);
    let drift = report.drift.as_ref().map(|drift| {
        lower("drift_rms_m", "drift RMS", "m", drift.runs.iter().map(|run| run.rms_m.value).collect())
    });
    SCORES.iter().filter(is_there).map(column).chain(drift).collect()
}

/// A column of which less is better.
pub(crate) fn lower(
    key: &'static str,
    title: &'static str,
    unit: &'static str,
    values: Vec<Option<f64>>,
) -> Column {
    Column { key, title, unit, lower_is_better: true, values }
}

/// Keys of the columns that know the truth.
pub(crate) const TRUTHS: [&str; 4] = ["ate_rmse_m", "rpe_rmse_m", "smd_mean_m", "smd_median_m"];

impl Column {
    /// Whether it is an error against ground truth rather than a score without any.
    pub fn knows_truth(&self) -> bool {
        self.side() == Side::Truth
    }

    pub(crate) fn side(&self) -> Side {
        if TRUTHS.contains(&self.key) { Side::Truth } else { Side::Score }
    }
}
