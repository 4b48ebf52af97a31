//! The tables of docs/accuracy.md.

use std::fmt::Write as _;

use dmp_truth::rank::kendall_tau_b;

use super::judge::{Tally, Truth, column, consistent_pairs, errors, kinds, ladder, tally, truth_is_first};
use super::result::{DriveResult, RunResult, Said};
use super::rule::Rule;

/// A table in Markdown.
struct Table {
    title: String,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(title: &str, header: &[&str]) -> Self {
        Self { title: title.to_owned(), rows: vec![header.iter().map(|&cell| cell.to_owned()).collect()] }
    }

    fn row(&mut self, name: &str, cells: impl IntoIterator<Item = String>) {
        self.rows.push(std::iter::once(name.to_owned()).chain(cells).collect());
    }

    fn print(&self) -> String {
        let mut text = format!("### {}\n\n", self.title);
        for (k, row) in self.rows.iter().enumerate() {
            let _ = writeln!(text, "| {} |", row.join(" | "));
            if k == 0 {
                let _ = writeln!(text, "|---|{}", "---:|".repeat(row.len() - 1));
            }
        }
        text + "\n"
    }
}

fn share(value: f64) -> String {
    format!("{value:.3}")
}

fn optional(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), share)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
    sum / f64::from(count.max(1))
}

/// All tables.
pub(super) fn all(drives: &[&DriveResult]) -> String {
    let half = |held_out: bool| -> Vec<&DriveResult> {
        drives.iter().copied().filter(|result| result.held_out == held_out).collect()
    };
    [
        grounds(drives),
        single_scores(drives),
        pair_rules("Pairs, all drives", drives),
        pair_rules("Pairs, chosen drives", &half(false)),
        pair_rules("Pairs, drives held out", &half(true)),
        agreement(drives),
        by_drive(drives),
        by_kind(drives),
        contradictions(drives),
    ]
    .concat()
}

/// What each drive offers to a score.
fn grounds(drives: &[&DriveResult]) -> String {
    let header =
        ["drive", "pairs of known order", "R_cv(10) not shown", "coverage of the truth", "revisit coverage"];
    let mut table = Table::new("The drives", &header);
    for drive in drives {
        let is_known = |(a, b): (usize, usize)| Truth::of(&drive.runs[a], &drive.runs[b]).all.is_some();
        let known = drive.pairs.iter().filter(|pair| is_known((pair.a, pair.b))).count();
        let hidden =
            column(drive, "R_cv(10), where it is shown").iter().filter(|score| score.is_none()).count();
        let truth = &drive.runs[0];
        let coverage = [truth.coverage, truth.coverage_revisit].map(optional);
        table.row(&drive.drive, [known.to_string(), hidden.to_string()].into_iter().chain(coverage));
    }
    table.print()
}

/// Scores of single runs against the truth.
fn single_scores(drives: &[&DriveResult]) -> String {
    let header = [
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
    let mut table = Table::new("Scores of single runs", &header);
    let names = drives.first().map(|drive| drive.runs[0].scores.keys());
    for key in names.into_iter().flatten() {
        let right: Vec<f64> = drives.iter().map(|drive| consistent_pairs(drive, key)).collect();
        let of_half = |held_out: bool| {
            mean(drives.iter().zip(&right).filter(|(d, _)| d.held_out == held_out).map(|(_, right)| *right))
        };
        let tau = |truth: &dyn Fn(&DriveResult) -> Vec<Option<f64>>| {
            mean(drives.iter().filter_map(|drive| kendall_tau_b(&column(drive, key), &truth(drive))))
        };
        let (steps, all) =
            drives.iter().map(|d| ladder(d, key)).fold((0, 0), |(a, b), (right, all)| (a + right, b + all));
        let first = drives.iter().filter(|drive| truth_is_first(drive, key)).count();
        let shares = [
            mean(right.iter().copied()),
            right.iter().copied().fold(f64::INFINITY, f64::min),
            of_half(false),
            of_half(true),
            tau(&|drive| errors(drive, "ATE")),
            tau(&|drive| errors(drive, "SMD")),
            tau(&|drive| drive.runs.iter().map(|run| run.inconsistency_m[0]).collect()),
        ];
        let last = [format!("{first} of {}", drives.len()), share(f64::from(steps) / f64::from(all.max(1)))];
        table.row(key, shares.map(share).into_iter().chain(last));
    }
    table.print()
}

const RULE_HEADER: [&str; 8] = [
    "right",
    "wrong",
    "mixed",
    "sign",
    "agreeing: right",
    "agreeing: wrong",
    "consistency: wrong",
    "consistency of decided",
];

fn rule_cells(drives: &[&DriveResult], rule: &Rule) -> [String; 8] {
    let ate = tally(drives, rule, |_, _, truth| truth.ate);
    let agreeing = tally(drives, rule, |_, _, truth| truth.ate.filter(|_| truth.agree() == Some(true)));
    let consistency = tally(drives, rule, |_, _, truth| truth.consistency);
    let of = |tally: &Tally, count: u32| tally.share(count);
    [
        of(&ate, ate.right),
        of(&ate, ate.wrong),
        of(&ate, ate.mixed),
        of(&ate, ate.sign),
        of(&agreeing, agreeing.right),
        of(&agreeing, agreeing.wrong),
        of(&consistency, consistency.wrong),
        consistency.of_decided(),
    ]
    .map(share)
}

/// Pairs of runs: how many are decided, and how many of these rightly.
fn pair_rules(title: &str, drives: &[&DriveResult]) -> String {
    let mut table = Table::new(title, &[&["rule"][..], &RULE_HEADER].concat());
    Rule::all().iter().for_each(|rule| table.row(rule.name(), rule_cells(drives, rule)));
    table.print()
}

/// Where trajectory error and map consistency agree, wrong verdicts are the score's errors. Where they differ, no verdict
/// suits both.
fn agreement(drives: &[&DriveResult]) -> String {
    let header = [
        "pairs of which they",
        "pairs",
        "with ATE",
        "with consistency",
        "mixed, leaning with ATE",
        "mixed, against",
        "undecided",
        "with consistency, noise on one side",
    ];
    let mut table = Table::new("Where ATE and map consistency agree, and where they differ", &header);
    let noisy = |run: &RunResult| run.kind == "Noise" || run.kind == "Mixed";
    for (name, agree) in [("agree", true), ("differ", false)] {
        let of = |wanted: &dyn Fn(&RunResult, &RunResult, &Truth) -> Option<bool>| {
            tally(drives, &Rule::Command, |a, b, t| wanted(a, b, t).filter(|_| t.agree() == Some(agree)))
        };
        let ate = of(&|_, _, truth| truth.ate);
        let consistency = of(&|_, _, truth| truth.consistency);
        let with_noise = of(&|a, b, truth| truth.consistency.filter(|_| noisy(a) || noisy(b)));
        let counts = [
            ate.pairs,
            ate.right,
            consistency.right,
            ate.mixed_right,
            ate.mixed - ate.mixed_right,
            ate.pairs - ate.right - ate.wrong - ate.mixed,
            with_noise.right,
        ];
        table.row(name, counts.map(|count| count.to_string()));
    }
    table.print()
}

/// The verdicts of the command, drive by drive.
fn by_drive(drives: &[&DriveResult]) -> String {
    let header = [&["drive"][..], &RULE_HEADER, &["apart"]].concat();
    let mut table = Table::new("Verdicts of `dmp score` by drive", &header);
    for drive in drives {
        let name = format!("{}{}", drive.drive, if drive.held_out { " (held out)" } else { "" });
        let apart = tally(&[drive], &Rule::Command, |_, _, truth| truth.apart).of_decided();
        table.row(&name, rule_cells(&[drive], &Rule::Command).into_iter().chain([share(apart)]));
    }
    table.print()
}

/// The verdicts of the command by the error of one of the two.
fn by_kind(drives: &[&DriveResult]) -> String {
    let title = "Verdicts of `dmp score` on the pairs with an estimate of this kind";
    let header = ["kind", "pairs", "right", "wrong", "mixed", "sign", "truth against it: right", "wrong"];
    let mut table = Table::new(title, &header);
    for kind in kinds(drives) {
        let all = tally(drives, &Rule::Command, |a, b, truth| {
            truth.ate.filter(|_| a.kind == kind || b.kind == kind)
        });
        let against = tally(drives, &Rule::Command, |a, b, truth| {
            truth.ate.filter(|_| a.kind == "Truth" && b.kind == kind)
        });
        let shares = [all.right, all.wrong, all.mixed, all.sign].map(|count| share(all.share(count)));
        let against = [against.right, against.wrong]
            .map(|count| optional((against.pairs > 0).then(|| against.share(count))));
        table.row(&kind, [all.pairs.to_string()].into_iter().chain(shares).chain(against));
    }
    table.print()
}

/// Decided pairs whose verdict a true error contradicts, one a line.
fn contradictions(drives: &[&DriveResult]) -> String {
    let mut text = String::from("### Verdicts that the truth contradicts\n\n");
    for drive in drives {
        for pair in &drive.pairs {
            let (a, b) = (&drive.runs[pair.a], &drive.runs[pair.b]);
            let truth = Truth::of(a, b);
            let (better, worse, a_better) = match pair.verdict {
                Said::A => (a, b, true),
                Said::B => (b, a, false),
                _ => continue,
            };
            let errors = [("ATE", truth.ate), ("consistency", truth.consistency)];
            let by: Vec<&str> = errors
                .iter()
                .filter(|(_, truth)| truth.is_some_and(|truth| truth != a_better))
                .map(|(name, _)| *name)
                .collect();
            if by.is_empty() {
                continue;
            }
            let ate = |run: &RunResult| run.truth.get("ATE").copied().unwrap_or(f64::NAN);
            let apart = |run: &RunResult| run.inconsistency_m[0].unwrap_or(f64::NAN);
            let _ = writeln!(
                text,
                "- {}: {} over {} {}, against {}: ATE {:.3} and {:.3} m, sightings {:.3} and {:.3} m apart",
                drive.drive,
                better.name,
                worse.name,
                pair.decided_at_m.map_or("by drift".to_owned(), |m| format!("at {m} m")),
                by.join(" and "),
                ate(better),
                ate(worse),
                apart(better),
                apart(worse),
            );
        }
    }
    text + "\n"
}
