//! Tells the failures that are new, and keeps their files.

use super::attempt::Outcome;
use super::verdict::{Failure, Verdict};
use crate::trials::{Found, write};

/// Adds what failed.
pub(super) fn add(found: &mut Found, outcome: &Outcome) -> anyhow::Result<()> {
    let Verdict::Failed(failure) = &outcome.verdict else { return Ok(()) };
    let Outcome { kind, seed, number, call, .. } = outcome;
    let again = format!("cargo xtask attack --only '{kind}' --seed {seed} --first {number} --tries 1");
    let name = format!("{kind}-{seed}-{number}");
    let Some(folder) = found.add(sign(outcome, failure), &again, &name) else { return Ok(()) };
    write(&outcome.files, &folder.join("in"))?;
    let line = format!("dmp {}", call.words.join(" "));
    let taken = outcome.ended.taken.as_secs_f64();
    let text = format!("cd in && {line}\n{again}\n{failure}\n{:?} after {taken:.2} s\n", outcome.ended.end);
    std::fs::write(folder.join("command.txt"), text)?;
    std::fs::write(folder.join("stdout.txt"), &outcome.ended.printed)?;
    std::fs::write(folder.join("stderr.txt"), &outcome.ended.said)?;
    eprintln!("\r{kind}: {failure}: cd {} && {line}", folder.join("in").display());
    Ok(())
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
