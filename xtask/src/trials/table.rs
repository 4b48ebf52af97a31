//! Counts the outcomes of tries, prints them as a table, and keeps the failures that differ.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::fs;
use std::path::{Path, PathBuf};

use super::{End, Ended};

/// Of failures that look alike, so many are kept.
const KEPT: u64 = 2;

/// What no try may lead to: its kind, for the table, and its details.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure(pub(crate) &'static str, pub(crate) String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(kind, details) = self;
        if details.is_empty() { f.write_str(kind) } else { write!(f, "{kind}: {details}") }
    }
}

impl Failure {
    pub(crate) fn new(kind: &'static str) -> Self {
        Self(kind, String::new())
    }

    /// A command that did not end by itself, or panicked, also where the panic was caught.
    pub(crate) fn of_process(ended: &Ended) -> Option<Self> {
        let stderr = String::from_utf8_lossy(&ended.stderr);
        let panic = stderr.lines().find(|line| line.contains("panicked at"));
        match ended.end {
            End::Signal(signal) => Some(Self("signal", signal.to_string())),
            End::TooLong => Some(Self::new("hang")),
            End::TooLarge => Some(Self::new("memory")),
            End::Exit(code) => {
                (code == 101 || panic.is_some()).then(|| Self("panic", panic.unwrap_or_default().to_owned()))
            }
        }
    }
}

/// What became of a try.
#[derive(Debug, Default)]
pub(crate) struct Outcome {
    /// Its row in the table, `a | b` where the table has two columns of names.
    pub(crate) row: String,
    /// What is added to each column of counts.
    pub(crate) counts: Vec<u64>,
    pub(crate) failure: Option<Failure>,
    /// What tells apart failures of one kind beside their details.
    pub(crate) hint: String,
    /// The command that repeats it, and a name for what is kept.
    pub(crate) again: String,
    pub(crate) name: String,
    /// What is kept of a failure: paths and contents.
    pub(crate) files: Vec<(String, Vec<u8>)>,
}

/// A row for each name; the last column counts failures by kind.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// The names of its columns, with ` | ` between them, and how many of them are counts.
    head: &'static str,
    rows: BTreeMap<String, (Vec<u64>, BTreeMap<&'static str, u64>)>,
    keep: PathBuf,
    tries: u64,
    /// By what tells them apart: how often each was found, and how it is repeated.
    found: BTreeMap<String, (u64, String)>,
}

impl Table {
    pub(crate) fn new(head: &'static str) -> Self {
        Self { head, ..Self::default() }
    }

    pub(super) fn keep_failures(&mut self, folder: &Path) {
        folder.clone_into(&mut self.keep);
    }

    /// Counts without a try.
    pub(crate) fn count(&mut self, row: &str, counts: &[u64], failure: Option<&'static str>) {
        let (sums, failures) = self.rows.entry(row.to_owned()).or_default();
        sums.resize(counts.len(), 0);
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        failure.into_iter().for_each(|kind| *failures.entry(kind).or_default() += 1);
    }

    /// Counts a try. Failures that are new are printed and kept.
    pub(crate) fn add(&mut self, outcome: &Outcome) -> anyhow::Result<()> {
        self.tries += 1;
        self.count(&outcome.row, &outcome.counts, outcome.failure.as_ref().map(|failure| failure.0));
        let Some(failure) = &outcome.failure else { return Ok(()) };
        let sign = sign(&format!("{}: {failure}, {}", outcome.row, outcome.hint));
        let (times, _) = self.found.entry(sign.clone()).or_insert_with(|| (0, outcome.again.clone()));
        *times += 1;
        if *times > KEPT {
            return Ok(());
        }
        let name = outcome.name.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let folder = self.keep.join(name);
        let again = ("again.txt".to_owned(), format!("{}\n{failure}\n", outcome.again).into_bytes());
        for (path, bytes) in outcome.files.iter().chain([&again]) {
            let path = folder.join(path);
            fs::create_dir_all(path.parent().unwrap_or(&folder))?;
            fs::write(path, bytes)?;
        }
        eprintln!("\r{sign}\n    {}\n    in {}", outcome.again, folder.display());
        Ok(())
    }

    pub(crate) fn tries(&self) -> u64 {
        self.tries
    }

    pub(crate) fn failures(&self) -> u64 {
        self.rows.values().flat_map(|(_, failures)| failures.values()).sum()
    }

    /// The failures that differ.
    pub(crate) fn found(&self) -> String {
        let mut text = String::new();
        for (sign, (times, again)) in &self.found {
            let _ = writeln!(text, "{times} x {sign}\n    {again}");
        }
        text
    }

    /// As Markdown.
    pub(crate) fn markdown(&self) -> String {
        let columns: Vec<&str> = self.head.split(" | ").collect();
        let counts = self.rows.values().next().map_or(0, |(sums, _)| sums.len());
        let names = columns.len().saturating_sub(counts);
        let rules: Vec<&str> = (0..columns.len()).map(|at| if at < names { "---" } else { "---:" }).collect();
        let mut all = Self::new(self.head);
        let together = format!("together{}", " | ".repeat(names.saturating_sub(1)));
        let mut text = format!("| {} | failures |\n|{}|---|\n", self.head, rules.join("|"));
        for (row, (sums, failures)) in &self.rows {
            text += &line(row, sums, failures);
            all.count(&together, sums, None);
            let (_, of_all) = all.rows.entry(together.clone()).or_default();
            failures.iter().for_each(|(kind, times)| *of_all.entry(kind).or_default() += times);
        }
        text + &all.rows.iter().map(|(row, (sums, failures))| line(row, sums, failures)).collect::<String>()
    }
}

fn line(row: &str, sums: &[u64], failures: &BTreeMap<&str, u64>) -> String {
    let sums: Vec<String> = sums.iter().map(|sum| format!(" {sum} |")).collect();
    let sums = sums.concat();
    let failures: Vec<String> = failures.iter().map(|(kind, times)| format!("{times} {kind}")).collect();
    let failures = if failures.is_empty() { "0".to_owned() } else { failures.join(", ") };
    format!("| {row} |{sums} {failures} |\n")
}

/// What failures of one cause have in common: the text without digits and without random names.
fn sign(text: &str) -> String {
    let is_random = |word: &&str| ["dmp-tmp", "dmp-work", "#"].iter().any(|part| word.contains(part));
    let words: Vec<&str> = text.split(' ').map(|word| if is_random(&word) { "…" } else { word }).collect();
    words.join(" ").chars().filter(|c| !c.is_ascii_digit()).take(160).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_try_is_in_the_table_and_failures_alike_are_kept_twice() {
        let folder = tempfile::tempdir().unwrap();
        let mut table = Table::new("input | command | tries | accepted");
        table.keep_failures(folder.path());
        let ok = Outcome { row: "mcap | `dmp info`".into(), counts: vec![1, 1], ..Outcome::default() };
        table.add(&ok).unwrap();
        for number in 0..3 {
            let failure = Some(Failure("file left", format!(".x{number}")));
            let (row, counts) = (ok.row.clone(), vec![1, 0]);
            let name = format!("mcap-{number}");
            table.add(&Outcome { row, counts, failure, name, ..Outcome::default() }).unwrap();
        }
        assert_eq!((table.tries(), table.failures(), table.found.len()), (4, 3, 1));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        let text = table.markdown();
        assert!(
            text.starts_with("| input | command | tries | accepted | failures |\n|---|---|---:|---:|---|\n")
        );
        assert!(text.contains("| mcap | `dmp info` | 4 | 1 | 3 file left |"), "{text}");
        assert!(text.ends_with("| together |  | 4 | 1 | 3 file left |\n"), "{text}");
    }
}
