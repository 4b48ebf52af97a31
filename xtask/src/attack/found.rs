//! The failures that were found: told once each, with their files kept.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::attempt::{Outcome, write};
use super::verdict::{Failure, Verdict};

/// Of failures that look alike, so many are kept.
const KEPT: u64 = 2;

#[derive(Debug)]
pub(super) struct Found {
    keep: PathBuf,
    /// What tells them apart, how often each was found, and how it is repeated.
    by_sign: BTreeMap<String, (u64, String)>,
}

impl Found {
    pub(super) fn new(keep: &Path) -> Self {
        Self { keep: keep.to_owned(), by_sign: BTreeMap::new() }
    }

    /// How many there are that differ.
    pub(super) fn len(&self) -> usize {
        self.by_sign.len()
    }

    /// Tells a failure that is new, and keeps its files.
    pub(super) fn add(&mut self, outcome: &Outcome) -> anyhow::Result<()> {
        let Verdict::Failed(failure) = &outcome.verdict else { return Ok(()) };
        let Outcome { kind, seed, number, call, .. } = outcome;
        let again = format!("cargo xtask attack --only '{kind}' --seed {seed} --first {number} --tries 1");
        let (times, _) = self.by_sign.entry(sign(outcome, failure)).or_insert_with(|| (0, again.clone()));
        *times += 1;
        if *times > KEPT {
            return Ok(());
        }
        let name: String = kind.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let folder = self.keep.join(format!("{name}-{seed}-{number}"));
        write(&outcome.files, &folder.join("in"))?;
        let line = format!("dmp {}", call.words.join(" "));
        let taken = outcome.ended.taken.as_secs_f64();
        let text =
            format!("cd in && {line}\n{again}\n{failure}\n{:?} after {taken:.2} s\n", outcome.ended.end);
        std::fs::write(folder.join("command.txt"), text)?;
        std::fs::write(folder.join("stdout.txt"), &outcome.ended.printed)?;
        std::fs::write(folder.join("stderr.txt"), &outcome.ended.said)?;
        eprintln!("\r{kind}: {failure}: cd {} && {line}", folder.join("in").display());
        Ok(())
    }

    /// All of them, a line each.
    pub(super) fn told(&self) -> String {
        let mut text = String::new();
        for (sign, (times, again)) in &self.by_sign {
            let _ = writeln!(text, "{times} x {sign}\n    {again}");
        }
        text
    }
}

/// What failures of one cause have in common: the kind, the command, where it panicked or what it said, without numbers.
fn sign(outcome: &Outcome, failure: &Failure) -> String {
    let said = String::from_utf8_lossy(&outcome.ended.said);
    let panicked = said.lines().find(|line| line.contains("panicked at"));
    let line = panicked.or_else(|| said.lines().last()).unwrap_or_default();
    let told: String = match (panicked, failure) {
        (Some(line), _) => line.split("panicked at").nth(1).unwrap_or_default().trim().to_owned(),
        (
            None,
            Failure::Signal(_)
            | Failure::Memory
            | Failure::Disk
            | Failure::Hang
            | Failure::NotJson
            | Failure::Code(_),
        ) => line.into(),
        (None, failure) => failure.to_string(),
    };
    let told: String = if panicked.is_some() {
        told
    } else {
        told.chars().filter(|c| !c.is_ascii_digit()).take(80).collect()
    };
    format!("{}, {}: {}: {told}", outcome.kind, outcome.command, failure.kind())
}
