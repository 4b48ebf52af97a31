//! Counts of verdicts on equal runs, and on runs of known order.

use std::collections::BTreeMap;

use dmp::{Confidence, Report};
use dmp_reduce::{Comparison, Reducer, Verdict};

use super::sets::{Set, SetKind};

/// Confidences of the verdicts: the promised one, and lower ones, so that there is something to count.
pub(super) const LEVELS: [f64; 3] = [0.99, 0.9, 0.5];

/// The verdicts of one command at one confidence.
#[derive(Debug, Clone, Copy, Default)]
struct AtLevel {
    right: usize,
    /// For equal runs, every decision.
    wrong: usize,
    mixed: usize,
    same: usize,
    undecided: usize,
}

/// The verdicts of one command.
#[derive(Debug, Clone)]
pub(super) struct Counts {
    pairs: usize,
    levels: [AtLevel; LEVELS.len()],
    /// Pairs decided at 99 %, mixed included, by the scale that decided.
    by_scale: BTreeMap<String, usize>,
    /// Largest relative difference of a score between two runs.
    apart: f64,
}

/// Which of a pair is the better one; `None` where they are equal or nobody knows.
pub(super) fn better(set: &Set, a: usize, b: usize) -> Option<usize> {
    let step = |run: usize| {
        let (kind, size) = set.runs[run].0.split_once(' ')?;
        Some((kind.to_owned(), size.parse::<f64>().ok()?))
    };
    match (set.kind, step(a), step(b)) {
        (SetKind::Ladder, None, Some(_)) => Some(a),
        (SetKind::Ladder, Some((kind, size)), Some((other, larger))) if kind == other => {
            Some(if size < larger { a } else { b })
        }
        _ => None,
    }
}

impl Counts {
    pub(super) fn of(set: &Set, reducer: &Reducer, report: &Report) -> Self {
        let mut counts = Self {
            pairs: 0,
            levels: [AtLevel::default(); LEVELS.len()],
            by_scale: BTreeMap::new(),
            apart: 0.0,
        };
        for (number, (level, at_level)) in LEVELS.iter().zip(&mut counts.levels).enumerate() {
            let confidence = Confidence::new(*level).unwrap_or(Confidence::P99);
            // What is the same follows from the poses, at any confidence.
            let name = |run: usize| set.runs[run].0.as_str();
            let is_same = |pair: &Comparison| {
                report.verdict_between(name(pair.a), name(pair.b)) == Some(&dmp::Verdict::Same)
            };
            let pairs = reducer.comparisons(confidence).pairs.into_iter();
            let pairs: Vec<Comparison> =
                pairs.map(|pair| if is_same(&pair) { pair.of_same() } else { pair }).collect();
            let judged =
                |pair: &&Comparison| set.kind != SetKind::Ladder || better(set, pair.a, pair.b).is_some();
            let judged: Vec<&Comparison> = pairs.iter().filter(judged).collect();
            if number == 0 {
                counts.pairs = judged.len();
            }
            for pair in judged {
                at_level.add(pair, better(set, pair.a, pair.b));
                if let (0, Verdict::Better { decided_at_m, .. } | Verdict::Mixed { decided_at_m, .. }) =
                    (number, &pair.verdict)
                {
                    *counts.by_scale.entry(format!("{decided_at_m} m")).or_default() += 1;
                }
            }
        }
        let mut scores: BTreeMap<String, [f64; 2]> = BTreeMap::new();
        for (scale_m, score) in report.runs.iter().flat_map(|run| run.r_cv_m2.iter()) {
            let Some(score) = score else { continue };
            let range = scores.entry(scale_m.to_string()).or_insert([score; 2]);
            *range = [range[0].min(score), range[1].max(score)];
        }
        counts.apart = scores.values().map(|[low, high]| high / low - 1.0).fold(0.0, f64::max);
        counts
    }

    fn decided(&self, level: usize) -> usize {
        self.levels[level].right + self.levels[level].wrong + self.levels[level].mixed
    }

    pub(super) fn print(&self, log: &str, set: &str) {
        let AtLevel { right, wrong, mixed, same, undecided } = self.levels[0];
        let scales: Vec<String> = self.by_scale.iter().map(|(m, count)| format!("{count} at {m}")).collect();
        println!(
            "{log:<14}{set:<24}{:>4} pairs: {right:>3} right {wrong:>3} wrong {mixed:>3} mixed {same:>3} same {undecided:>3} \
             undecided; scores apart by {:.1e}  {}",
            self.pairs,
            self.apart,
            scales.join(", ")
        );
    }
}

impl AtLevel {
    fn add(&mut self, pair: &Comparison, better: Option<usize>) {
        match pair.verdict {
            Verdict::Better { which, .. } if better == Some(which) => self.right += 1,
            Verdict::Better { .. } => self.wrong += 1,
            Verdict::Mixed { .. } => self.mixed += 1,
            Verdict::Same => self.same += 1,
            Verdict::Undecided { .. } => self.undecided += 1,
        }
    }
}

/// All commands.
#[derive(Default)]
pub(super) struct Verdicts {
    commands: Vec<(SetKind, String, Counts)>,
}

impl Verdicts {
    pub(super) fn add(&mut self, set: &Set, counts: Counts) {
        // A tenth of the noise in a room is the same kind.
        let name = set.name.split([' ', ',']).next().unwrap_or_default().to_owned();
        self.commands.push((set.kind, name, counts));
    }

    pub(super) fn print(&self) {
        println!(
            "\nequal runs: commands and pairs, and those with a decision (better or mixed) by confidence"
        );
        println!(
            "{:<10}{:>10}{:>8}{:>18}{:>18}{:>18}{:>8}",
            "runs", "commands", "pairs", "99 %", "90 %", "50 %", "same"
        );
        let mut names: Vec<(SetKind, &str)> =
            self.commands.iter().map(|(kind, name, _)| (*kind, name.as_str())).collect();
        names.sort_unstable();
        names.dedup();
        for (kind, name) in names.iter().filter(|(kind, _)| *kind != SetKind::Ladder) {
            self.print_equal(name, |of, word| of == *kind && word == *name);
        }
        self.print_equal("all", |kind, _| kind != SetKind::Ladder);

        println!("\nruns of known order: pairs, and verdicts at 99 %");
        println!(
            "{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}{:>11}",
            "", "pairs", "right", "wrong", "mixed", "same", "undecided"
        );
        for (kind, name) in names.iter().filter(|(kind, _)| *kind == SetKind::Ladder) {
            let mut sum = AtLevel::default();
            let mut pairs = 0;
            for (_, _, counts) in self.commands.iter().filter(|(of, word, _)| of == kind && word == name) {
                let one = counts.levels[0];
                pairs += counts.pairs;
                sum.right += one.right;
                sum.wrong += one.wrong;
                sum.mixed += one.mixed;
                sum.same += one.same;
                sum.undecided += one.undecided;
            }
            let AtLevel { right, wrong, mixed, same, undecided } = sum;
            println!("{name:<24}{pairs:>8}{right:>8}{wrong:>8}{mixed:>8}{same:>8}{undecided:>11}");
        }
    }

    fn print_equal(&self, title: &str, wanted: impl Fn(SetKind, &str) -> bool) {
        let of: Vec<&Counts> = self
            .commands
            .iter()
            .filter(|(kind, name, _)| wanted(*kind, name))
            .map(|(_, _, counts)| counts)
            .collect();
        let pairs: usize = of.iter().map(|counts| counts.pairs).sum();
        let at = |level: usize| {
            let commands = of.iter().filter(|counts| counts.decided(level) > 0).count();
            let pairs: usize = of.iter().map(|counts| counts.decided(level)).sum();
            format!("{commands} with {pairs}")
        };
        let same: usize = of.iter().map(|counts| counts.levels[0].same).sum();
        println!("{title:<10}{:>10}{pairs:>8}{:>18}{:>18}{:>18}{same:>8}", of.len(), at(0), at(1), at(2));
    }
}
