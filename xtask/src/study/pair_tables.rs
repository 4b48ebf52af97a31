//! Tables about pairs of estimates: which is the better one.

use std::fmt::Write as _;

use super::judge::{CONSISTENCY, Spread, Tally, Truth, kinds, tally, truth_of};
use super::result::{DriveResult, RunResult, Said};
use super::rule::{Cascade, GUARDS, Opposing, Rule, smaller};
use super::tables::{Table, share};

/// Rules that decide pairs.
pub(super) fn rules() -> Vec<Rule> {
    let single = |name: &str, scale_m: f64| Rule::Single(name.to_owned(), scale_m);
    vec![
        Rule::Command,
        single("R_cv(10) common", 10.0),
        single("R_cv(2) common", 2.0),
        single("R_cv(0.5) common", 0.5),
        single("R_cv(0.2) common", 0.2),
        single("R_near(5)", 5.0),
        single("R_near(2)", 2.0),
        single("R_near(0.5)", 0.5),
        single("DMP mean", 30.0),
    ]
}

const RULE_HEADER: [&str; 9] = [
    "rule",
    "right",
    "wrong",
    "mixed",
    "sign",
    "agreeing: right",
    "agreeing: wrong",
    "consistency: wrong",
    "consistency of decided",
];

fn rule_row(drives: &[&DriveResult], rule: &Rule, name: String) -> Vec<String> {
    let ate = tally(drives, rule, |_, _, truth| truth.ate);
    let agreeing = tally(drives, rule, |_, _, truth| truth.ate.filter(|_| truth.agree() == Some(true)));
    let consistency = tally(drives, rule, |_, _, truth| truth.consistency);
    vec![
        name,
        share(ate.share(ate.right)),
        share(ate.share(ate.wrong)),
        share(ate.share(ate.mixed)),
        share(ate.share(ate.sign)),
        share(agreeing.share(agreeing.right)),
        share(agreeing.share(agreeing.wrong)),
        share(consistency.share(consistency.wrong)),
        share(consistency.of_decided()),
    ]
}

/// Pairs of runs: what is decided, and whether it is right.
pub(super) fn pair_rules(title: &str, drives: &[&DriveResult]) -> String {
    let mut table = Table::new(title, &RULE_HEADER);
    for rule in rules() {
        table.rows.push(rule_row(drives, &rule, rule.name()));
    }
    table.print()
}

/// The cascade of `dmp score` and others, on the chosen drives and on those held out.
pub(super) fn cascades(chosen: &[&DriveResult], held_out: &[&DriveResult]) -> String {
    let mut table = Table::new(
        "Cascades and guards: chosen drives, then those held out",
        &[
            "rule",
            "right",
            "wrong",
            "mixed",
            "sign",
            "consistency",
            "right",
            "wrong",
            "mixed",
            "sign",
            "consistency",
        ],
    );
    let scales_m = [10.0, 2.0, 0.5, 0.2];
    let rule = |name: &str, guards| Rule::Cascade(Cascade::new(name, &scales_m, guards));
    let mut beyond_doubt = Cascade::new("guard .10 .05, .02 .25, beyond doubt", &scales_m, GUARDS);
    beyond_doubt.opposing = Opposing::Decided;
    let rules = [
        Rule::Command,
        rule("no guard", None),
        rule("guard .05 .05, .02 .25", Some([[0.05, 0.05], [0.02, 0.25]])),
        rule("guard .10 .05, .02 .25", GUARDS),
        Rule::Cascade(beyond_doubt),
        rule("guard .20 .20, .02 .25", Some([[0.2, 0.2], [0.02, 0.25]])),
        rule("guard .20 .40, .02 .25", Some([[0.2, 0.4], [0.02, 0.25]])),
        rule("guard .20 .20, .05 .50", Some([[0.2, 0.2], [0.05, 0.5]])),
        Rule::Cascade(Cascade::new(
            "from 5 m, guard .20 .20, .02 .25",
            &[5.0, 2.0, 0.5, 0.2],
            Some([[0.2, 0.2], [0.02, 0.25]]),
        )),
    ];
    for rule in rules {
        let mut row = vec![rule.name()];
        for drives in [chosen, held_out] {
            let ate = tally(drives, &rule, |_, _, truth| truth.ate);
            let consistency = tally(drives, &rule, |_, _, truth| truth.consistency);
            row.extend([ate.right, ate.wrong, ate.mixed, ate.sign].map(|count| share(ate.share(count))));
            row.push(share(consistency.of_decided()));
        }
        table.rows.push(row);
    }
    table.print()
}

/// Trajectory error and map consistency: where they agree the wrong verdicts are the score's errors, where they
/// differ no verdict can suit both.
pub(super) fn errors_and_messages(drives: &[&DriveResult]) -> String {
    let mut table = Table::new(
        "Where ATE and map consistency agree, and where they differ",
        &[
            "pairs of which they",
            "pairs",
            "with ATE",
            "with consistency",
            "against both",
            "mixed, leaning with ATE",
            "mixed, against",
            "undecided",
        ],
    );
    for (name, agree) in [("agree", true), ("differ", false)] {
        let of = |truth: fn(&Truth) -> Option<bool>| {
            tally(drives, &Rule::Command, |_, _, t| truth(t).filter(|_| t.agree() == Some(agree)))
        };
        let (ate, consistency) = (of(|t| t.ate), of(|t| t.consistency));
        let decided = ate.right + ate.wrong;
        table.rows.push(vec![
            name.to_owned(),
            ate.pairs.to_string(),
            ate.right.to_string(),
            consistency.right.to_string(),
            if agree { ate.wrong.to_string() } else { "–".to_owned() },
            ate.mixed_right.to_string(),
            (ate.mixed - ate.mixed_right).to_string(),
            (ate.pairs - decided - ate.mixed).to_string(),
        ]);
    }
    table.print()
}

/// How many verdicts against ATE that map consistency confirms have white noise on one side.
pub(super) fn messages(drives: &[&DriveResult]) -> String {
    let count = |wanted: fn(&RunResult) -> bool| {
        tally(drives, &Rule::Command, |a, b, truth| {
            truth.consistency.filter(|_| truth.agree() == Some(false) && (wanted(a) || wanted(b)))
        })
        .right
    };
    let noisy = |run: &RunResult| run.kind == "Noise" || run.kind == "Mixed";
    format!("{} of these {} verdicts have noise on one side.\n\n", count(noisy), count(|_| true))
}

/// What a score has to go by on each drive.
pub(super) fn grounds(drives: &[&DriveResult]) -> String {
    let mut table = Table::new(
        "The drives",
        &["drive", "pairs of known order", "R_cv(10) not shown", "coverage of the truth", "revisit coverage"],
    );
    for drive in drives {
        let known = drive
            .pairs
            .iter()
            .filter(|pair| truth_of(&drive.runs[pair.a], &drive.runs[pair.b], 10.0).all.is_some());
        let hidden = drive.runs.iter().filter(|run| run.scores.get("R_cv(10) as shown") == Some(&None));
        let of_truth =
            |name: &str| drive.runs[0].shares.get(name).copied().flatten().map_or("–".to_owned(), share);
        table.rows.push(vec![
            drive.drive.clone(),
            known.count().to_string(),
            hidden.count().to_string(),
            of_truth("coverage"),
            of_truth("revisit coverage"),
        ]);
    }
    table.print()
}

/// The decided verdicts against every way to sum up the true inconsistency.
pub(super) fn definitions(chosen: &[&DriveResult], held_out: &[&DriveResult]) -> String {
    let mut table = Table::new(
        "Decided verdicts that agree with map consistency, by how that is summed up",
        &["sightings", "measure", "chosen", "held out"],
    );
    for pairs in ["any, by pairs", "any, by returns", "apart, by pairs", "apart, by returns"] {
        for (measure, spread) in [
            ("mean distance", Spread::Distance(pairs)),
            ("root mean square at the scale", Spread::Root(pairs)),
        ] {
            let agreeing = |drives: &[&DriveResult]| share(tally_by(drives, spread).of_decided());
            table.rows.push(vec![pairs.to_owned(), measure.to_owned(), agreeing(chosen), agreeing(held_out)]);
        }
    }
    table.print()
}

fn tally_by(drives: &[&DriveResult], spread: Spread) -> Tally {
    let mut tally = Tally::default();
    for drive in drives {
        for pair in &drive.pairs {
            let (a, b) = (&drive.runs[pair.a], &drive.runs[pair.b]);
            let saying = Rule::Command.say(pair, Rule::Command.confidence(drive));
            let of = |run: &RunResult| spread.of(run, saying.scale_m);
            tally.add(saying, smaller(of(a), of(b)));
        }
    }
    tally
}

/// The verdicts of the command, drive by drive.
pub(super) fn by_drive(drives: &[&DriveResult]) -> String {
    let mut header = RULE_HEADER.to_vec();
    header[0] = "drive";
    header.push("apart");
    let mut table = Table::new("Verdicts of `dmp score` by drive", &header);
    for drive in drives {
        let name = format!("{}{}", drive.drive, if drive.held_out { " (held out)" } else { "" });
        let mut row = rule_row(&[drive], &Rule::Command, name);
        row.push(share(tally_by(&[drive], Spread::Distance("apart, by pairs")).of_decided()));
        table.rows.push(row);
    }
    table.print()
}

/// The verdicts of the command by what is wrong with one of the two.
pub(super) fn by_kind(drives: &[&DriveResult]) -> String {
    let mut table = Table::new(
        "Verdicts of `dmp score` on the pairs with an estimate of this kind",
        &["kind", "pairs", "right", "wrong", "mixed", "sign", "truth against it: right", "wrong"],
    );
    for kind in kinds(drives) {
        let all = tally(drives, &Rule::Command, |a, b, truth| {
            truth.ate.filter(|_| a.kind == kind || b.kind == kind)
        });
        let against = tally(drives, &Rule::Command, |a, b, truth| {
            truth.ate.filter(|_| a.kind == "Truth" && b.kind == kind)
        });
        table.rows.push(vec![
            kind,
            all.pairs.to_string(),
            share(all.share(all.right)),
            share(all.share(all.wrong)),
            share(all.share(all.mixed)),
            share(all.share(all.sign)),
            if against.pairs == 0 { "–".to_owned() } else { share(against.share(against.right)) },
            if against.pairs == 0 { "–".to_owned() } else { share(against.share(against.wrong)) },
        ]);
    }
    table.print()
}

/// Decided pairs whose verdict the truth about consistency contradicts, one a line.
pub(super) fn contradictions(drives: &[&DriveResult]) -> String {
    let mut text = String::from("### Verdicts that the truth contradicts\n\n");
    for drive in drives {
        for pair in &drive.pairs {
            let (a, b) = (&drive.runs[pair.a], &drive.runs[pair.b]);
            let saying = Rule::Command.say(pair, Rule::Command.confidence(drive));
            let truth = truth_of(a, b, saying.scale_m);
            let said = match saying.said {
                Said::A => true,
                Said::B => false,
                _ => continue,
            };
            let contradicted = |truth: Option<bool>| truth.is_some_and(|truth| truth != said);
            let by: Vec<&str> = [("ATE", truth.ate), ("consistency", truth.consistency)]
                .iter()
                .filter(|(_, truth)| contradicted(*truth))
                .map(|(name, _)| *name)
                .collect();
            if by.is_empty() {
                continue;
            }
            let (better, worse) = if said { (a, b) } else { (b, a) };
            let ate = |run: &RunResult| run.truth.get("ATE").copied().unwrap_or(f64::NAN);
            let off = |run: &RunResult| CONSISTENCY.of(run, saying.scale_m).unwrap_or(f64::NAN);
            let _ = writeln!(
                text,
                "- {}: {} over {} at {} m, against {}: ATE {:.3} and {:.3} m, sightings {:.3} and {:.3} m apart",
                drive.drive,
                better.name,
                worse.name,
                saying.scale_m,
                by.join(" and "),
                ate(better),
                ate(worse),
                off(better),
                off(worse),
            );
        }
    }
    text.push('\n');
    text
}
