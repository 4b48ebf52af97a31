//! A study for a person.

use std::io::{self, Write};

use dmp_draw::text::{NONE, Side, Table, counted, digits, percent};
use dmp_study::{Column, Study, correlation};

/// Columns of the first table, each with two lines of a head.
const SCORES: [(&str, [&str; 2]); 14] = [
    ("dmp_sum_m2", ["DMP", "sum"]),
    ("dmp_mean_m2", ["DMP", "mean"]),
    ("r_cv_10_m2", ["R_cv", "10 m"]),
    ("r_cv_2_m2", ["R_cv", "2 m"]),
    ("r_cv_1_m2", ["R_cv", "1 m"]),
    ("r_cv_0.5_m2", ["R_cv", "0.5 m"]),
    ("r_cv_0.2_m2", ["R_cv", "0.2 m"]),
    ("r_cv_0.05_m2", ["R_cv", "0.05 m"]),
    ("r_cv_0.02_m2", ["R_cv", "0.02 m"]),
    ("r_near_5_m2", ["R_near", "5 m"]),
    ("r_near_2_m2", ["R_near", "2 m"]),
    ("r_near_0.5_m2", ["R_near", "0.5 m"]),
    ("r_near_0.2_m2", ["R_near", "0.2 m"]),
    ("r_near_0.05_m2", ["R_near", "0.05 m"]),
];

/// Columns of the second table.
const OTHERS: [(&str, [&str; 2]); 7] = [
    ("ate_rmse_m", ["ATE", "m"]),
    ("rpe_rmse_m", ["RPE", "m"]),
    ("smd_mean_m", ["SMD", "m"]),
    ("smd_median_m", ["median", "m"]),
    ("mme", ["MME", "nats"]),
    ("mpv_m2", ["MPV", "m²"]),
    ("mom_m2", ["MOM", "m²"]),
];

/// Columns of the third table.
const SHARES: [(&str, [&str; 2]); 4] = [
    ("miss_rate", ["miss", "%"]),
    ("blocked_rate", ["blocked", "%"]),
    ("coverage", ["coverage", "%"]),
    ("coverage_revisit", ["revisit", "%"]),
];

/// Writes the tables: scores, errors and other metrics, shares, agreement. Runs are in order of their ATE.
pub(super) fn study(out: &mut impl Write, study: &Study) -> io::Result<()> {
    writeln!(out, "Scores without ground truth, m²: lower is better")?;
    values(out, study, &SCORES)?;
    writeln!(out, "\nErrors against ground truth, metrics of others: lower is better")?;
    values(out, study, &OTHERS)?;
    writeln!(out, "\nShares of returns")?;
    values(out, study, &SHARES)?;
    writeln!(out, "\nAgreement with ground truth over {}: Kendall τ-b and Spearman ρ", runs_of(study))?;
    agreement(out, study)?;
    let why = study.correlations.iter().find(|c| study.table.runs.len() < 3 && c.reason.is_some());
    if let Some(reason) = why.and_then(|correlation| correlation.reason.as_ref()) {
        writeln!(out, "  no agreement can be told: {reason}")?;
    }
    Ok(())
}

fn runs_of(study: &Study) -> String {
    counted(study.table.runs.len() as u64, "run")
}

/// The runs in order of their ATE.
fn order(study: &Study) -> Vec<usize> {
    let ate = |run: usize| {
        let column = study.table.column("ate_rmse_m");
        column.and_then(|column| column.values[run]).unwrap_or(f64::INFINITY)
    };
    let mut order: Vec<usize> = (0..study.table.runs.len()).collect();
    order.sort_by(|&a, &b| ate(a).total_cmp(&ate(b)));
    order
}

fn values(out: &mut impl Write, study: &Study, heads: &[(&str, [&str; 2])]) -> io::Result<()> {
    let columns: Vec<(&Column, [&str; 2])> =
        heads.iter().filter_map(|&(key, head)| Some((study.table.column(key)?, head))).collect();
    let mut sides = vec![Side::Right; columns.len() + 1];
    sides[0] = Side::Left;
    let mut table = Table::new(sides);
    for line in 0..2 {
        table.row(std::iter::once("").chain(columns.iter().map(|(_, head)| head[line])));
    }
    for run in order(study) {
        let value = |(column, _): &(&Column, [&str; 2])| match column.values[run] {
            Some(share) if column.unit.is_empty() => percent(share),
            Some(value) => digits(value),
            None => NONE.to_owned(),
        };
        table.row(std::iter::once(study.table.runs[run].clone()).chain(columns.iter().map(value)));
    }
    table.write(out, "  ")
}

/// A row for each score, a pair of columns for each error.
fn agreement(out: &mut impl Write, study: &Study) -> io::Result<()> {
    let (errors, scores): (Vec<&Column>, Vec<&Column>) =
        study.table.columns.iter().partition(|column| column.knows_truth());
    let mut sides = vec![Side::Right; 2 * errors.len() + 1];
    sides[0] = Side::Left;
    let mut table = Table::new(sides);
    table.row(std::iter::once("").chain(errors.iter().flat_map(|error| [error.title, ""])));
    table.row(std::iter::once("").chain(errors.iter().flat_map(|_| ["τ-b", "ρ"])));
    let show = |value: Option<f64>| value.map_or(NONE.to_owned(), |value| format!("{value:.2}"));
    for score in scores {
        let both = errors.iter().flat_map(|error| {
            let correlation = correlation(score, error);
            [show(correlation.kendall_tau_b), show(correlation.spearman_rho)]
        });
        table.row(std::iter::once(score.title.to_owned()).chain(both));
    }
    table.write(out, "  ")
}
