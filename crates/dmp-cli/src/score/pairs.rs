//! Pairs of runs: which is better, by how much, at which scale.

use std::io::{self, Write};

use dmp::{PairReport, Reach, Report, ScaleReport, Scales};

use super::sampling;
use crate::text::{NONE, Side, Table, count, digits};

/// With more runs than this, only neighbours in the order and pairs with the best are shown.
const ALL_PAIRS_UP_TO: usize = 5;

/// A pair the way it is told: the better run first.
struct Told<'a> {
    pair: &'a PairReport,
    first: &'a str,
    second: &'a str,
}

impl Told<'_> {
    fn verdict(&self) -> &'static str {
        match (self.pair.decided_at_m, &self.pair.better_on_the_whole) {
            (None, _) if self.pair.is_same => "the same as",
            (None, _) => "undecided against",
            (Some(_), Some(_)) => "mixed against",
            (Some(_), None) => "better than",
        }
    }

    /// First minus second, m², with the interval.
    fn difference(&self, scale: &ScaleReport) -> [String; 2] {
        let turned = self.first != self.pair.a;
        let sign = if turned { -1.0 } else { 1.0 };
        let interval = scale.interval_m2.map(|[low, high]| if turned { [-high, -low] } else { [low, high] });
        [
            scale.difference_m2.map_or(NONE.to_owned(), |difference| digits(sign * difference)),
            interval.map_or(NONE.to_owned(), |[low, high]| format!("{} to {}", digits(low), digits(high))),
        ]
    }
}

/// The pairs that matter, in the order of the runs.
fn told(report: &Report) -> Vec<Told<'_>> {
    let order = &report.order;
    let mut told = Vec::new();
    for (i, high) in order.iter().enumerate() {
        for (j, low) in order.iter().enumerate().skip(i + 1) {
            if order.len() > ALL_PAIRS_UP_TO && i > 0 && j > i + 1 {
                continue;
            }
            let is_it =
                |pair: &&PairReport| (&pair.a, &pair.b) == (high, low) || (&pair.a, &pair.b) == (low, high);
            if let Some(pair) = report.pairs.iter().find(is_it) {
                // Around a cycle the better run may stand below.
                let better = pair.better_on_the_whole.as_ref().unwrap_or(&pair.verdict);
                let turned = pair.decided_at_m.is_some() && better == low;
                let (first, second) = if turned { (low, high) } else { (high, low) };
                told.push(Told { pair, first, second });
            }
        }
    }
    told
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
    let (pairs, scales) = (told(report), report.config.scales);
    let mut table = Table::new([Side::Left, Side::Left, Side::Left, Side::Left, Side::Right, Side::Right]);
    table.row(["Pairs", "", "", "decided at", "first minus second, m²", "interval"]);
    for told in &pairs {
        let decided = told.pair.decided_at_m;
        let at = |scale_m: f64| format!("{} {scale_m} m, {}", told.pair.score, reach(scale_m, scales));
        let scale = told.pair.scales.iter().find(|scale| Some(scale.scale_m) == decided);
        let [difference, interval] =
            scale.map_or([NONE; 2].map(str::to_owned), |scale| told.difference(scale));
        let at = decided.map_or(NONE.to_owned(), at);
        table.row([
            told.first.to_owned(),
            told.verdict().into(),
            told.second.into(),
            at,
            difference,
            interval,
        ]);
    }
    table.write(out, "")?;
    for told in pairs.iter().filter(|told| told.verdict() == "better than" && told.pair.is_same) {
        writeln!(
            out,
            "{}, {}: the difference is too small to matter (--same-within)",
            told.first, told.second
        )?;
    }
    for told in pairs.iter().filter(|told| told.verdict() != "better than") {
        let is_undecided = told.verdict() == "undecided against";
        let more = if is_undecided { sampling::more_needed(report, told.pair) } else { String::new() };
        writeln!(out, "{}, {}: {}{more}", told.first, told.second, told.pair.reason)?;
    }
    Ok(())
}

/// Writes every scale of every pair.
pub(super) fn scales(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let mut table = Table::new([Side::Left, Side::Left, Side::Left, Side::Right, Side::Right, Side::Right]);
    table.row(["Scales", "minus", "score", "difference, m²", "interval", "common returns"]);
    for told in told(report) {
        for scale in &told.pair.scales {
            let [difference, interval] = told.difference(scale);
            let score = format!("{} {} m", told.pair.score, scale.scale_m);
            let returns = count(scale.returns);
            table.row([told.first.to_owned(), told.second.into(), score, difference, interval, returns]);
        }
    }
    table.write(out, "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::sample;

    #[test]
    fn differences_are_turned_with_the_pair() {
        let mut report = sample::three_runs();
        let before: Vec<[String; 2]> =
            told(&report).iter().map(|told| told.difference(&told.pair.scales[0])).collect();
        for pair in &mut report.pairs {
            std::mem::swap(&mut pair.a, &mut pair.b);
            for scale in &mut pair.scales {
                scale.difference_m2 = scale.difference_m2.map(|difference| -difference);
                scale.interval_m2 = scale.interval_m2.map(|[low, high]| [-high, -low]);
            }
        }
        let after: Vec<[String; 2]> =
            told(&report).iter().map(|told| told.difference(&told.pair.scales[0])).collect();
        assert_eq!(before, after);
    }

    #[test]
    fn many_runs_show_neighbours_and_the_best() {
        let report = sample::many_runs(7);
        let shown: Vec<(&str, &str)> = told(&report).iter().map(|told| (told.first, told.second)).collect();
        assert_eq!(shown.len(), 6 + 5);
        assert!(shown.contains(&("run 0", "run 6")) && shown.contains(&("run 5", "run 6")));
        assert!(!shown.contains(&("run 1", "run 3")));
        assert_eq!(told(&sample::many_runs(5)).len(), 10);
    }
}
