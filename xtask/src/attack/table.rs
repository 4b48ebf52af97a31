//! Counts what became of the tries, and prints it.

use std::collections::BTreeMap;

use super::verdict::{Failure, Verdict};

#[derive(Debug, Default)]
struct Counts {
    accepted: u64,
    refused: u64,
    /// By kind of failure.
    failed: BTreeMap<String, u64>,
}

/// A row for each kind of input and command.
#[derive(Debug, Default)]
pub(super) struct Table {
    rows: BTreeMap<(String, String), Counts>,
}

impl Table {
    pub(super) fn count(&mut self, kind: &str, command: &str, verdict: &Verdict) {
        let counts = self.rows.entry((kind.to_owned(), command.to_owned())).or_default();
        match verdict {
            Verdict::Accepted => counts.accepted += 1,
            Verdict::Refused => counts.refused += 1,
            Verdict::Failed(failure) => *counts.failed.entry(Failure::kind(failure)).or_default() += 1,
        }
    }

    /// All tries, and how many of them failed.
    pub(super) fn totals(&self) -> (u64, u64) {
        let failed: u64 = self.rows.values().map(Counts::failures).sum();
        (failed + self.rows.values().map(|counts| counts.accepted + counts.refused).sum::<u64>(), failed)
    }

    /// As Markdown.
    pub(super) fn markdown(&self) -> String {
        let mut text = "| input | command | tries | accepted | refused | failures |\n".to_owned();
        text += "|---|---|---:|---:|---:|---|\n";
        let mut all = Counts::default();
        for ((kind, command), counts) in &self.rows {
            text += &row(kind, &format!("`dmp {command}`"), counts);
            all.accepted += counts.accepted;
            all.refused += counts.refused;
            for (kind, n) in &counts.failed {
                *all.failed.entry(kind.clone()).or_default() += n;
            }
        }
        text + &row("together", "", &all)
    }
}

impl Counts {
    fn failures(&self) -> u64 {
        self.failed.values().sum()
    }
}

fn row(kind: &str, command: &str, counts: &Counts) -> String {
    let Counts { accepted, refused, failed } = counts;
    let failures: Vec<String> = failed.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
    let failures = if failures.is_empty() { "0".to_owned() } else { failures.join(", ") };
    let tries = accepted + refused + counts.failures();
    format!("| {kind} | {command} | {tries} | {accepted} | {refused} | {failures} |\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_try_is_in_the_table() {
        let mut table = Table::default();
        table.count("mcap", "info", &Verdict::Accepted);
        table.count("mcap", "info", &Verdict::Refused);
        table.count("mcap", "info", &Verdict::Failed(Failure::Hang));
        assert_eq!(table.totals(), (3, 1));
        let text = table.markdown();
        assert!(text.contains("| mcap | `dmp info` | 3 | 1 | 1 | 1 hang |"), "{text}");
        assert!(text.contains("| together |  | 3 | 1 | 1 | 1 hang |"), "{text}");
    }
}
