//! Pairs of runs: why some are not decided, and all of them at every truncation.

use std::io::{self, Write};

use dmp::{Reach, Report, ScaleReport, Scales, Verdict};
use dmp_draw::text::{self, NONE, Side, Table, count, digits};
use dmp_draw::{OrderedPair, every_pair, worse_between, worse_by};

use crate::console::Terminal;

/// Writes remarks on the pairs with the first run that are not simply decided; equal ones together.
pub(super) fn remarks(out: &mut impl Write, report: &Report, terminal: Terminal) -> io::Result<()> {
    let mut all: Vec<(&str, Vec<&str>, String)> = Vec::new();
    for shown in of_first(report) {
        let Some(remark) = remark(report, &shown) else { continue };
        match all.iter_mut().find(|(first, _, other)| *first == shown.first && *other == remark) {
            Some((_, seconds, _)) => seconds.push(shown.second),
            None => all.push((shown.first, vec![shown.second], remark)),
        }
    }
    for (first, seconds, remark) in all {
        terminal.tell(out, "", &format!("{first} against {}: {remark}", seconds.join(", ")))?;
    }
    Ok(())
}

/// How many pairs are not among those with the first run.
pub(super) fn others(report: &Report) -> usize {
    report.pairs.len() - of_first(report).count()
}

fn of_first(report: &Report) -> impl Iterator<Item = OrderedPair<'_>> {
    let first = report.order.first();
    let others = report.order.iter().skip(1);
    others.filter_map(move |other| OrderedPair::of(report, first?, other))
}

fn remark(report: &Report, shown: &OrderedPair<'_>) -> Option<String> {
    let pair = shown.pair;
    match pair.verdict {
        Verdict::Better { decided_at_m: Some(_), .. } | Verdict::Same => None,
        Verdict::Undecided => {
            // A quick score ends with its last look.
            let more = report
                .sampling
                .quick
                .map_or("", |_| "; if anything decides, it is all scans, without --quick");
            Some(format!("{}{}{more}", pair.reason, by_how_much(shown)))
        }
        Verdict::Mixed { .. } | Verdict::Better { .. } => Some(pair.reason.clone()),
    }
}

/// How much worse the second run is, by its residuals at the smallest truncation, and where that may lie.
fn by_how_much(shown: &OrderedPair<'_>) -> String {
    let behind = |scale| Some((scale, shown.rms_behind_m(scale)?));
    let Some((scale, (by_m, Some(interval_m)))) = shown.pair.scales.iter().rev().find_map(behind) else {
        return String::new();
    };
    format!(
        " (at {} m {} is {}, and may be {})",
        scale.scale_m,
        shown.second,
        worse_by(by_m),
        worse_between(interval_m)
    )
}

/// Writes every pair, with every truncation.
pub(super) fn all(out: &mut impl Write, report: &Report, terminal: Terminal) -> io::Result<()> {
    let (pairs, scales) = (every_pair(report), report.config.scales);
    let mut sides = vec![Side::Left];
    sides.resize(6, Side::Right);
    let mut table = Table::new(sides);
    table.row(["", "1st, m", "2nd, m", "1st² − 2nd²", "interval, m²", "returns"]);
    for shown in &pairs {
        for scale in &shown.pair.scales {
            let roots = shown.means_m2(scale).map(|mean_m2| or_none(mean_m2.map(f64::sqrt), digits));
            let interval = or_none(shown.interval_m2(scale), |[low, high]| {
                format!("{} to {}", digits(low), digits(high))
            });
            let difference = or_none(shown.difference_m2(scale), digits);
            let at = format!("  {} {} m", shown.pair.basis, scale.scale_m);
            table.row([[at].as_slice(), &roots, &[difference, interval, count(scale.returns)]].concat());
        }
    }
    let sure = text::confidence(report.promise.interval_confidence);
    let heading = format!(
        "Pairs: RMS residuals over the returns that both maps predict, the difference of their squares and where it lies \
         ({sure} sure), by truncation"
    );
    terminal.tell(out, "", &heading)?;
    let mut lines = table.lines().into_iter();
    lines.by_ref().take(1).try_for_each(|head| writeln!(out, "{head}"))?;
    for shown in &pairs {
        let verdict = match (&shown.pair.verdict, shown.pair.decided_at()) {
            (Verdict::Better { .. }, Some(ScaleReport { scale_m, .. })) => {
                let remark = remark(report, shown).map_or(String::new(), |remark| format!("; {remark}"));
                let (basis, reach) = (shown.pair.basis, reach(*scale_m, scales));
                format!("better, decided at {basis} {scale_m} m: {reach}{remark}")
            }
            _ => remark(report, shown).unwrap_or_else(|| shown.pair.reason.clone()),
        };
        terminal.tell(out, "", &format!("{} against {}: {verdict}", shown.first, shown.second))?;
        lines.by_ref().take(shown.pair.scales.len()).try_for_each(|line| writeln!(out, "{line}"))?;
    }
    Ok(())
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

fn or_none<T>(value: Option<T>, shown: impl Fn(T) -> String) -> String {
    value.map_or_else(|| NONE.to_owned(), shown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;

    #[test]
    fn pairs_look_alike_whichever_way_they_are_kept() {
        let mut report = example_reports::three_runs();
        let shown = |report: &Report| {
            let mut text = Vec::new();
            all(&mut text, report, Terminal::default()).unwrap();
            String::from_utf8(text).unwrap()
        };
        let before = shown(&report);
        for pair in &mut report.pairs {
            std::mem::swap(&mut pair.a, &mut pair.b);
            for scale in &mut pair.scales {
                std::mem::swap(&mut scale.mean_a_m2, &mut scale.mean_b_m2);
                scale.difference_m2 = scale.difference_m2.map(|difference| -difference);
                scale.interval_m2 = scale.interval_m2.map(|[low, high]| [-high, -low]);
            }
        }
        assert_eq!(shown(&report), before);
    }
}
