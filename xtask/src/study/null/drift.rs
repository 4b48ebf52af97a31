//! Whether drift decides between equal runs.

use std::collections::BTreeMap;

use anyhow::Context as _;
use dmp::{Config, DriftPairs, Run, measure_drift};

use super::logs::NullLog;
use super::sets::{Set, SetKind};
use super::tally::better;

/// Answers of drift on pairs of runs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pairs: usize,
    right: usize,
    /// For equal runs, every decision.
    wrong: usize,
}

/// By kind and name of the sets.
pub(super) type OfSets = BTreeMap<(SetKind, String), Counts>;

/// Measures drift of the runs of a set, on all pairs of visits.
pub(super) fn count(log: &NullLog, set: &Set) -> anyhow::Result<Counts> {
    let runs: Vec<Run> = set.runs.iter().map(|(name, run)| Run::new(name, run.clone())).collect();
    let config = Config { drift: DriftPairs::All, ..Config::default() };
    let report = measure_drift(log.log.as_ref(), &runs, &config, ())
        .with_context(|| format!("{} of {}", set.name, log.name))?;
    let index = |name: &str| set.runs.iter().position(|run| run.0 == name).context("a run of the set");
    let mut counts = Counts::default();
    for pair in &report.comparisons {
        let (a, b) = (index(&pair.a)?, index(&pair.b)?);
        let expected = better(set, a, b).map(|run| set.runs[run].0.as_str());
        if set.kind == SetKind::Ladder && expected.is_none() {
            continue;
        }
        counts.pairs += 1;
        match pair.better.as_deref() {
            Some(said) if Some(said) == expected => counts.right += 1,
            Some(_) => counts.wrong += 1,
            None => {}
        }
    }
    println!("{:<14}{:<24}{counts}", log.name, set.name);
    Ok(counts)
}

/// The sums over all logs.
pub(super) fn print(of_sets: &OfSets) {
    println!("\nanswers of drift, all logs");
    for ((_, name), counts) in of_sets {
        println!("{name:<24}{counts}");
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.pairs += other.pairs;
        self.right += other.right;
        self.wrong += other.wrong;
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { pairs, right, wrong } = *self;
        write!(
            f,
            "{pairs:>4} pairs: {right:>3} right {wrong:>3} wrong {:>3} undecided",
            pairs - right - wrong
        )
    }
}
