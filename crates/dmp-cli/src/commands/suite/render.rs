//! The report of a suite for a person.

use std::io::{self, Write};

use dmp::Verdict;
use dmp_draw::text::{NONE, Side, Table, counted, width_of};
use dmp_draw::{OrderedVersions, log_word, ordered_versions, p_value, suite_answer, suite_promise};
use dmp_suite::SuiteReport;

use crate::console::{Terminal, Tone, tell};

/// Writes the report: the answer, the pairs over all logs, every log.
pub(super) fn report(out: &mut impl Write, report: &SuiteReport, terminal: Terminal) -> io::Result<()> {
    let pairs = ordered_versions(report);
    terminal.tell_in(out, Tone::Strong, &suite_answer(report))?;
    writeln!(out)?;
    for pair in &pairs {
        terminal.tell(out, "", &pair.verdict())?;
        terminal.tell(out, "    ", &pair.pair.reason)?;
    }
    writeln!(out)?;
    counts(out, &pairs)?;
    writeln!(out)?;
    effects(out, report, &pairs)?;
    writeln!(out)?;
    logs(out, report, terminal.width)?;
    if !report.warnings.is_empty() {
        writeln!(out, "\n{}", terminal.painted(Tone::Open, "Warnings"))?;
        report.warnings.iter().try_for_each(|warning| terminal.tell(out, "  ", warning))?;
    }
    writeln!(out)?;
    terminal.tell(out, "", &suite_promise(report))
}

fn counts(out: &mut impl Write, pairs: &[OrderedVersions<'_>]) -> io::Result<()> {
    let mut sides = vec![Side::Left; 2];
    sides.resize(8, Side::Right);
    let mut table = Table::new(sides);
    table.row(["Logs", "", "1st", "2nd", "", "", "", ""]);
    table.row(["first", "second", "better", "better", "mixed", "same", "undecided", "p"]);
    for versions in pairs {
        let [first, second] = versions.wins();
        let pair = versions.pair;
        let numbers = [first, second, pair.mixed, pair.same, pair.undecided].map(|number| number.to_string());
        let names = [versions.first, versions.second].map(str::to_owned);
        table.row(names.into_iter().chain(numbers).chain([p_value(pair)]));
    }
    table.write(out, "")
}

fn effects(out: &mut impl Write, report: &SuiteReport, pairs: &[OrderedVersions<'_>]) -> io::Result<()> {
    let scale =
        report.pairs.iter().find_map(|pair| pair.scale_m).map_or(String::new(), |m| format!(" {m} m"));
    writeln!(out, "First minus second in cm, median over logs; negative: first is better")?;
    let mut table = Table::new([Side::Left, Side::Left, Side::Right, Side::Right, Side::Right, Side::Right]);
    table.row(["first", "second", &format!("residual{scale}"), "interval", "drift", "interval"]);
    for versions in pairs {
        let names = [versions.first, versions.second].map(str::to_owned);
        let effects = [&versions.pair.rms_difference, &versions.pair.drift_difference];
        let effects = effects.map(|effect| versions.effect_cm(effect));
        table.row(names.into_iter().chain(effects.into_iter().flatten()));
    }
    table.write(out, "")
}

/// Every log with every pair: the better version, or a word; where that is too wide, a sign.
fn logs(out: &mut impl Write, report: &SuiteReport, width: usize) -> io::Result<()> {
    let words: Vec<(&str, Vec<String>)> = report
        .worst_first
        .iter()
        .map(|log| (log.as_str(), report.pairs.iter().map(|pair| log_word(pair, log)).collect()))
        .collect();
    let widest = |k: usize| {
        let heads = report.pairs.get(k).map_or(0, |pair| width_of(&pair.a).max(width_of(&pair.b) + 2));
        words.iter().filter_map(|(_, words)| words.get(k)).map(|word| width_of(word)).fold(heads, usize::max)
    };
    let first = words.iter().map(|(log, _)| width_of(log)).fold("worst first".len(), usize::max);
    let all = first + (0..report.pairs.len()).map(|k| widest(k) + 2).sum::<usize>();
    let is_wide = all > width;
    let mut table = Table::new(vec![Side::Left; 1 + report.pairs.len()]);
    let head = |title: &str, name: &dyn Fn(usize) -> String| {
        std::iter::once(title.to_owned()).chain((0..report.pairs.len()).map(name)).collect::<Vec<_>>()
    };
    if is_wide {
        let numbers = report.pairs.iter().enumerate();
        for (k, pair) in numbers {
            tell!(out, "{}: {} (<) or {} (>)", k + 1, pair.a, pair.b)?;
        }
        writeln!(out, "m mixed, = same, ? undecided, {NONE} not compared")?;
        table.row(head("Better, worst first", &|k| (k + 1).to_string()));
    } else {
        table.row(head("Better on", &|k| report.pairs[k].a.clone()));
        table.row(head("worst first", &|k| format!("/ {}", report.pairs[k].b)));
    }
    for (log, words) in words {
        let cells =
            report.pairs.iter().zip(words).map(|(pair, word)| match (pair.on(log), pair.failing_on(log)) {
                (Some(on), _) if is_wide => sign(&on.verdict, &pair.a).to_owned(),
                (_, Some(failing)) if is_wide => (if failing == pair.a { ">" } else { "<" }).to_owned(),
                _ => word,
            });
        table.row(std::iter::once(log.to_owned()).chain(cells));
    }
    table.write(out, "")?;
    let unscored = report.logs.len() - report.worst_first.len();
    if unscored > 0 {
        tell!(out, "{} not scored", counted(unscored as u64, "log"))?;
    }
    Ok(())
}

fn sign(verdict: &Verdict, a: &str) -> &'static str {
    match verdict {
        Verdict::Better { run, .. } if run == a => "<",
        Verdict::Better { .. } => ">",
        Verdict::Mixed { .. } => "m",
        Verdict::Same => "=",
        Verdict::Undecided => "?",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp::Confidence;
    use dmp_suite::{Failures, SuiteLog, suite_report};

    use crate::example_reports;

    fn rendered(versions: &[&str], logs: usize) -> String {
        let log = |k| SuiteLog {
            name: format!("log {k}"),
            report: Ok(example_reports::many_runs(versions.len())),
            missing: Vec::new(),
        };
        let logs: Vec<SuiteLog> = (0..logs).map(log).collect();
        let versions: Vec<String> = versions.iter().map(|&name| name.to_owned()).collect();
        let mut out = Vec::new();
        let found = suite_report(&versions, &logs, Confidence::P99, Failures::Worse);
        report(&mut out, &found, Terminal::default()).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn the_answer_stands_first_and_lines_fit_a_terminal() {
        let two = rendered(&["run 0", "run 1"], 9);
        assert!(two.starts_with("run 0 is better than run 1, over 9 logs.\n"), "{two}");
        assert!(two.contains("\nrun 0  run 1        9       0      0     0          0  0.0039\n"), "{two}");
        let few = rendered(&["run 0", "run 1"], 3);
        assert!(few.starts_with("Too few logs to decide anything: 3 logs.\n"), "{few}");
        let names: Vec<String> = (0..6).map(|k| format!("run {k}")).collect();
        let many = rendered(&names.iter().map(String::as_str).collect::<Vec<_>>(), 14);
        assert!(many.contains("\nlog 3                <  <  <"), "{many}");
        for text in [two, few, many] {
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        }
    }
}
