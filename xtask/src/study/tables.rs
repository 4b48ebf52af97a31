//! The tables of docs/accuracy.md.

use std::fmt::Write as _;

use dmp_truth::rank::kendall_tau_b;

use super::beside::Beside;
use super::evaluate::KAPPAS;
use super::judge::{CONSISTENCY, Truth, column, consistent_pairs, errors, ladder, tally, truth_is_first};
use super::observe::CV_M;
use super::result::DriveResult;
use super::rule::Rule;

/// A table in Markdown.
pub(super) struct Table {
    title: String,
    header: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(title: &str, header: &[&str]) -> Self {
        let header = header.iter().map(|&h| h.to_owned()).collect();
        Self { title: title.to_owned(), header, rows: Vec::new() }
    }

    pub(super) fn print(&self) -> String {
        let mut text = format!("### {}\n\n", self.title);
        let width = |k: usize| {
            self.rows.iter().chain([&self.header]).map(|row| row[k].chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let mut line = |row: &[String]| {
            for (k, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let blank = " ".repeat(width - cell.chars().count());
                let _ =
                    if k == 0 { write!(text, "| {cell}{blank} ") } else { write!(text, "| {blank}{cell} ") };
            }
            text.push_str("|\n");
        };
        line(&self.header);
        let rule: Vec<String> = widths
            .iter()
            .enumerate()
            .map(|(k, &width)| if k == 0 { "-".repeat(width) } else { format!("{}:", "-".repeat(width - 1)) })
            .collect();
        line(&rule);
        self.rows.iter().for_each(|row| line(row));
        text.push('\n');
        text
    }
}

pub(super) fn share(value: f64) -> String {
    format!("{value:.3}")
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
    sum / f64::from(count.max(1))
}

/// Scores that are looked at, and how they are called.
fn scores() -> Vec<(String, &'static str)> {
    let named = [
        ("R_cv(10) κ=0.15", "R_cv(10)"),
        ("R_cv(10) as shown", "R_cv(10), where it is shown"),
        ("R_cv(10) κ=0.25", "R_cv(10), κ 0.25"),
        ("R_cv(2) hits", "R_cv(2)"),
        ("R_cv(0.5) hits", "R_cv(0.5)"),
        ("R_cv(0.2) hits", "R_cv(0.2)"),
        ("R_near(5)", "R_near(5)"),
        ("R_near(2)", "R_near(2)"),
        ("R_near(0.5)", "R_near(0.5)"),
        ("DMP mean", "DMP, mean over hits"),
        ("DMP sum", "DMP, sum over hits"),
        ("miss", "miss rate"),
        ("blocked", "blocked"),
        ("MOM", "MOM"),
        ("MPV", "MPV"),
        ("MME", "MME"),
    ];
    named.map(|(key, name)| (key.to_owned(), name)).to_vec()
}

fn has(drives: &[&DriveResult], score: &str) -> bool {
    drives.iter().all(|drive| drive.runs.iter().all(|run| run.scores.contains_key(score)))
}

fn score_row(drives: &[&DriveResult], key: &str, name: &str) -> Vec<String> {
    let cons: Vec<f64> = drives.iter().map(|drive| consistent_pairs(drive, key)).collect();
    let of_half = |held_out: bool| {
        mean(drives.iter().zip(&cons).filter(|(d, _)| d.held_out == held_out).map(|(_, c)| *c))
    };
    let tau =
        |truth: &str| mean(drives.iter().filter_map(|d| kendall_tau_b(&column(d, key), &errors(d, truth))));
    let inconsistency = |d: &DriveResult| -> Vec<Option<f64>> {
        d.runs.iter().map(|run| CONSISTENCY.of(run, 10.0)).collect()
    };
    let tau_inconsistency =
        mean(drives.iter().filter_map(|d| kendall_tau_b(&column(d, key), &inconsistency(d))));
    let (right, all) =
        drives.iter().map(|d| ladder(d, key)).fold((0, 0), |(a, b), (right, all)| (a + right, b + all));
    let first = drives.iter().filter(|drive| truth_is_first(drive, key)).count();
    vec![
        name.to_owned(),
        share(mean(cons.iter().copied())),
        share(cons.iter().copied().fold(f64::INFINITY, f64::min)),
        share(of_half(false)),
        share(of_half(true)),
        share(tau("ATE")),
        share(tau("SMD")),
        share(tau_inconsistency),
        format!("{first} of {}", drives.len()),
        share(f64::from(right) / f64::from(all.max(1))),
    ]
}

const SCORE_HEADER: [&str; 10] = [
    "score",
    "right order",
    "worst drive",
    "chosen",
    "held out",
    "tau ATE",
    "tau SMD",
    "tau consistency",
    "truth first",
    "drift ladder",
];

/// Scores of single runs against the truth.
pub(super) fn single_scores(drives: &[&DriveResult]) -> String {
    let mut table = Table::new("Scores of single runs", &SCORE_HEADER);
    for (key, name) in scores() {
        if has(drives, &key) {
            table.rows.push(score_row(drives, &key, name));
        }
    }
    table.print()
}

/// R_cv by truncation and by the price of a miss.
pub(super) fn truncations(drives: &[&DriveResult]) -> String {
    let mut table = Table::new("R_cv by truncation τ and price of a miss κ", &SCORE_HEADER);
    for t in CV_M {
        let key = format!("R_cv({t}) hits");
        table.rows.push(score_row(drives, &key, &format!("τ {t} m, hits only")));
    }
    for t in [30.0, 10.0, 5.0, 2.0] {
        for kappa in KAPPAS {
            let key = format!("R_cv({t}) κ={kappa}");
            table.rows.push(score_row(drives, &key, &format!("τ {t} m, κ {kappa}")));
        }
    }
    table.print()
}

/// The settings side by side.
pub(super) fn by_setting(settings: &[(&str, Vec<&DriveResult>)]) -> String {
    let mut table = Table::new(
        "By setting, chosen drives, every other scan, eleven estimates",
        &[
            "setting",
            "drives",
            "right",
            "wrong",
            "mixed",
            "sign",
            "order by ATE and RPE",
            "tau ATE",
            "coverage",
        ],
    );
    let base = settings.first().map_or(&[] as &[_], |(_, drives)| drives.as_slice());
    for (name, drives) in settings {
        // On too short a drive every scan becomes a segment, whatever length was asked for.
        let took_effect = |drive: &&&DriveResult| !name.starts_with("segments") || drive.segment_m.is_some();
        let drives: Vec<&DriveResult> = drives.iter().filter(took_effect).copied().collect();
        table.rows.push(setting_row((*name).to_owned(), &drives));
        if drives.len() < base.len() {
            let is_there = |of: &&&DriveResult| drives.iter().any(|drive| drive.drive == of.drive);
            let same: Vec<&DriveResult> = base.iter().filter(is_there).copied().collect();
            table.rows.push(setting_row(format!("{} on these", settings[0].0), &same));
        }
    }
    table.print()
}

fn setting_row(name: String, drives: &[&DriveResult]) -> Vec<String> {
    let ate = tally(drives, &Rule::documented(), |_, _, truth| truth.ate);
    let key = "R_cv(10) κ=0.15";
    let coverage = |drive: &&DriveResult| drive.runs[0].shares.get("coverage").copied().flatten();
    vec![
        name,
        drives.len().to_string(),
        share(ate.share(ate.right)),
        share(ate.share(ate.wrong)),
        share(ate.share(ate.mixed)),
        share(ate.share(ate.sign)),
        share(mean(drives.iter().map(|drive| consistent_pairs(drive, key)))),
        share(mean(drives.iter().filter_map(|d| kendall_tau_b(&column(d, key), &errors(d, "ATE"))))),
        share(mean(drives.iter().filter_map(coverage))),
    ]
}

/// The verdicts of scores and of drift beside each other, and rules made of both: of all pairs those that are right and wrong by
/// each true error.
pub(super) fn beside_drift(title: &str, drives: &[&DriveResult]) -> String {
    let header = ["rule", "ATE: right", "wrong", "RPE: right", "wrong", "consistency: right", "wrong"];
    let mut table = Table::new(title, &header);
    let besides = Beside::ALL.map(Rule::Beside);
    for rule in std::iter::once(&Rule::Command).chain(&besides) {
        let truths: [fn(&Truth) -> Option<bool>; 3] =
            [|truth| truth.ate, |truth| truth.rpe, |truth| truth.consistency];
        let tallies = truths.map(|wanted| tally(drives, rule, |_, _, truth| wanted(truth)));
        let shares =
            tallies.iter().flat_map(|tally| [tally.right, tally.wrong].map(|n| share(tally.share(n))));
        table.rows.push(std::iter::once(rule.name()).chain(shares).collect());
    }
    table.print()
}
