//! Counts what became of the tries, and prints it.

use std::collections::BTreeMap;

use super::one::Told;
use super::verdict::Outcome;

#[derive(Debug, Default, Clone)]
struct Counts {
    /// On a disk that works.
    operations: u64,
    /// Tries in which something was made to fail.
    faults: u64,
    kills: u64,
    same: u64,
    refused: u64,
    failed: BTreeMap<String, u64>,
}

/// A row for each command.
#[derive(Debug)]
pub(super) struct Table {
    rows: Vec<(&'static str, Counts)>,
}

impl Table {
    pub(super) fn new(commands: impl Iterator<Item = (&'static str, u64)>) -> Self {
        let row = |(name, operations)| (name, Counts { operations, ..Counts::default() });
        Self { rows: commands.map(row).collect() }
    }

    pub(super) fn count(&mut self, command: usize, told: &Told) {
        let (_, counts) = &mut self.rows[command];
        counts.faults += u64::from(told.injected > 0);
        counts.kills += told.kills;
        match (&told.failure, told.outcome) {
            (Some(failure), _) => *counts.failed.entry(failure.kind()).or_default() += 1,
            (None, Some(Outcome::Same)) => counts.same += 1,
            (None, _) => counts.refused += 1,
        }
    }

    /// All faults, kills and failures.
    pub(super) fn totals(&self) -> (u64, u64, u64) {
        let all = self.all();
        (all.faults, all.kills, all.failed.values().sum())
    }

    fn all(&self) -> Counts {
        let mut all = Counts::default();
        for (_, counts) in &self.rows {
            all.operations += counts.operations;
            all.faults += counts.faults;
            all.kills += counts.kills;
            all.same += counts.same;
            all.refused += counts.refused;
            for (kind, n) in &counts.failed {
                *all.failed.entry(kind.clone()).or_default() += n;
            }
        }
        all
    }

    /// As Markdown.
    pub(super) fn markdown(&self) -> String {
        let mut text =
            "| command | operations | faults | kills | same bits | refused | failures |\n".to_owned();
        text += "|---|---:|---:|---:|---:|---:|---|\n";
        for (name, counts) in &self.rows {
            text += &row(&format!("`dmp {name}`"), counts);
        }
        text + &row("together", &self.all())
    }
}

/// What stands behind a comma says more of the command.
fn row(name: &str, counts: &Counts) -> String {
    let name = name
        .split_once(", ")
        .map_or(name.to_owned(), |(command, more)| format!("{command}`, {}", more.trim_end_matches('`')));
    let Counts { operations, faults, kills, same, refused, failed } = counts;
    let failures: Vec<String> = failed.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
    let failures = if failures.is_empty() { "0".to_owned() } else { failures.join(", ") };
    format!("| {name} | {operations} | {faults} | {kills} | {same} | {refused} | {failures} |\n")
}

#[cfg(test)]
mod tests {
    use super::super::verdict::Failure;
    use super::*;

    #[test]
    fn every_try_is_in_the_table() {
        let mut table = Table::new([("map verify", 7), ("score, rosbag2", 9)].into_iter());
        table.count(0, &Told { injected: 2, outcome: Some(Outcome::Same), ..Told::default() });
        table.count(1, &Told { kills: 3, failure: Some(Failure::OtherBits), ..Told::default() });
        assert_eq!(table.totals(), (1, 3, 1));
        let text = table.markdown();
        assert!(text.contains("| `dmp map verify` | 7 | 1 | 0 | 1 | 0 | 0 |"), "{text}");
        assert!(text.contains("| `dmp score`, rosbag2 | 9 | 0 | 3 | 0 | 0 | 1 other bits |"), "{text}");
        assert!(text.contains("| together | 16 | 1 | 3 | 1 | 0 | 1 other bits |"), "{text}");
    }
}
