//! Pairs of runs: which is better, by how much, at which scale.

use std::io::{self, Write};

use dmp::{Reach, Report, ScaleReport, Scales, Verdict};
use dmp_draw::text::{NONE, Side, Table, count, digits};
use dmp_draw::{ToldPair, told_pairs};

use super::sampling;
use crate::say::tell;

/// How the first run of a pair stands to the second.
fn standing(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Better { .. } => "better than",
        Verdict::Mixed { .. } => "mixed against",
        Verdict::Same => "the same as",
        Verdict::Undecided => "undecided against",
    }
}

/// First minus second, m², with the interval.
fn difference(told: &ToldPair<'_>, scale: &ScaleReport) -> [String; 2] {
    let interval = told.interval_m2(scale).map(|[low, high]| format!("{} to {}", digits(low), digits(high)));
    [told.difference_m2(scale).map(digits), interval].map(|text| text.unwrap_or_else(|| NONE.to_owned()))
}

/// What a scale says about the maps.
fn reach(scale_m: f64, scales: Scales) -> String {
    match scales.lengths().reach(scale_m) {
        Reach::Global => "globally".to_owned(),
        Reach::Middle(unit) => format!("at the {unit} scale"),
        Reach::Local(_) => "locally".to_owned(),
        Reach::Fine(unit) => format!("in {unit}s"),
    }
}

/// Writes a line for each pair, then the reasons of those that are not simply decided.
pub(super) fn verdicts(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let (pairs, scales) = (told_pairs(report), report.config.scales);
    let mut table = Table::new([Side::Left, Side::Left, Side::Left, Side::Left, Side::Right, Side::Right]);
    table.row(["Pairs", "", "", "decided at", "first minus second, m²", "interval"]);
    for told in &pairs {
        let ToldPair { pair, first, second } = told;
        let at = |scale_m: f64| format!("{} {scale_m} m, {}", pair.basis, reach(scale_m, scales));
        let at = pair.verdict.decided_at_m().map_or(NONE.to_owned(), at);
        let none = || [NONE; 2].map(str::to_owned);
        let [difference, interval] = pair.decided_at().map_or_else(none, |scale| difference(told, scale));
        let standing = standing(&pair.verdict).to_owned();
        table.row([(*first).to_owned(), standing, (*second).to_owned(), at, difference, interval]);
    }
    table.write(out, "")?;
    let is_better = |told: &ToldPair<'_>| told.pair.verdict.better().is_some();
    for told in pairs.iter().filter(|told| is_better(told) && told.pair.verdict.is_same()) {
        tell!(out, "{}, {}: the difference is too small to matter (--same-within)", told.first, told.second)?;
    }
    for told in pairs.iter().filter(|told| !is_better(told)) {
        let more = match told.pair.verdict {
            Verdict::Undecided => sampling::more_needed(report, told.pair),
            _ => String::new(),
        };
        tell!(out, "{}, {}: {}{more}", told.first, told.second, told.pair.reason)?;
    }
    Ok(())
}

/// Writes every scale of every pair.
pub(super) fn scales(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let mut table = Table::new([Side::Left, Side::Left, Side::Left, Side::Right, Side::Right, Side::Right]);
    table.row(["Scales", "minus", "score", "difference, m²", "interval", "common returns"]);
    for told in told_pairs(report) {
        for scale in &told.pair.scales {
            let [difference, interval] = difference(&told, scale);
            let score = format!("{} {} m", told.pair.basis, scale.scale_m);
            let returns = count(scale.returns);
            table.row([told.first.to_owned(), told.second.into(), score, difference, interval, returns]);
        }
    }
    table.write(out, "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;

    #[test]
    fn differences_are_turned_with_the_pair() {
        let mut report = example_reports::three_runs();
        let before: Vec<[String; 2]> =
            told_pairs(&report).iter().map(|told| difference(told, &told.pair.scales[0])).collect();
        for pair in &mut report.pairs {
            std::mem::swap(&mut pair.a, &mut pair.b);
            for scale in &mut pair.scales {
                scale.difference_m2 = scale.difference_m2.map(|difference| -difference);
                scale.interval_m2 = scale.interval_m2.map(|[low, high]| [-high, -low]);
            }
        }
        let after: Vec<[String; 2]> =
            told_pairs(&report).iter().map(|told| difference(told, &told.pair.scales[0])).collect();
        assert_eq!(before, after);
    }

    #[test]
    fn many_runs_show_neighbours_and_the_best() {
        let report = example_reports::many_runs(7);
        let shown: Vec<(&str, &str)> =
            told_pairs(&report).iter().map(|told| (told.first, told.second)).collect();
        assert_eq!(shown.len(), 6 + 5);
        assert!(shown.contains(&("run 0", "run 6")) && shown.contains(&("run 5", "run 6")));
        assert!(!shown.contains(&("run 1", "run 3")));
        assert_eq!(told_pairs(&example_reports::many_runs(5)).len(), 10);
    }
}
