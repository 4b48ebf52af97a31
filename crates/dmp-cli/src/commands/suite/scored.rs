//! The results of all logs: those in the cache, and those that are scored for it.

use dmp::Report;
use dmp_suite::SuiteLog;

use super::kept::{Found, Kept};
use super::options;
use super::plan::{Plan, PlannedLog};
use crate::commands::score;
use crate::console::{Common, FailureKind, Printed, Unreadable, one_line, say};
use crate::options::{Asked, Out, scoring};

/// What becomes of logs whose results are not in the cache.
#[derive(Debug, Clone, Copy)]
pub(super) enum Unkept<'a> {
    /// They are scored, with the memory, threads and folder that were given.
    Scored(&'a Asked),
    /// They are skipped; a message says so.
    Skipped,
}

/// How results are got.
pub(super) struct Scoring<'a> {
    pub(super) unkept: Unkept<'a>,
    pub(super) common: &'a Common,
}

impl Scoring<'_> {
    /// Every log in its order, from the cache or scored, and the files of the results.
    pub(super) fn all(
        &self,
        plan: &Plan,
        kept: &mut Kept,
    ) -> anyhow::Result<(Vec<SuiteLog>, Vec<Option<String>>)> {
        let (mut logs, mut files, mut found) = (Vec::new(), Vec::new(), 0);
        for (k, log) in plan.logs.iter().enumerate() {
            self.common.host.go_on()?;
            let place = format!("{} ({} of {})", log.name, k + 1, plan.logs.len());
            let (report, file) = match self.one((log, plan.least_runs), kept, &place, &mut found) {
                Ok((report, file)) => (Ok(report), Some(file)),
                Err(error) if FailureKind::of(&error) == FailureKind::Interrupted => return Err(error),
                Err(error) if error.is::<NotKept>() => return Err(error),
                Err(error) => {
                    // Results do not name folders.
                    let problem = one_line(&error).replace(&format!("{}/", plan.folder.display()), "");
                    say!(self.common.host, "{place}: not scored: {problem}");
                    (Err(problem), None)
                }
            };
            logs.push(SuiteLog { name: log.name.clone(), report, missing: log.missing.clone() });
            files.push(file);
        }
        if !self.common.quiet {
            say!(
                self.common.host,
                "{found} of {} logs were in the cache {}",
                logs.len(),
                kept.folder().display()
            );
        }
        kept.save_index()?;
        Ok((logs, files))
    }

    fn one(
        &self,
        (log, least_runs): (&PlannedLog, usize),
        kept: &mut Kept,
        place: &str,
        found: &mut usize,
    ) -> anyhow::Result<(Report, String)> {
        for run in log.missing.iter().filter(|_| !self.common.quiet) {
            say!(self.common.host, "{place}: no run of {}: {}", run.version, run.reason);
        }
        if log.runs.len() < least_runs {
            let names: Vec<&str> = log.runs.iter().map(|(version, _)| version.as_str()).collect();
            let has =
                if names.is_empty() { "no version".to_owned() } else { format!("only {}", names.join(", ")) };
            anyhow::bail!("{has} has a run on it");
        }
        let file = kept.file_of(log, self.common)?;
        let shown = file.display().to_string();
        match kept.find(&file, log) {
            Found::Whole(report) => {
                *found += 1;
                return Ok((*report, shown));
            }
            Found::Damaged(why) if matches!(self.unkept, Unkept::Skipped) => {
                anyhow::bail!("{shown} is damaged: {why}")
            }
            Found::Damaged(why) => {
                say!(self.common.host, "{place}: scored again, as {shown} is damaged: {why}");
            }
            Found::Failed(problem) if matches!(self.unkept, Unkept::Skipped) => anyhow::bail!(problem),
            Found::Failed(_) | Found::Missing => {}
        }
        let Unkept::Scored(asked) = self.unkept else { anyhow::bail!("its result is not in the cache") };
        if !self.common.quiet {
            say!(self.common.host, "{place}: scoring {} versions", log.runs.len());
        }
        let text = self.score(log, asked)?;
        kept.keep(&file, &text).map_err(|error| error.context(NotKept))?;
        match kept.find(&file, log) {
            Found::Whole(report) => Ok((*report, shown)),
            Found::Damaged(why) | Found::Failed(why) => {
                Err(Unreadable(anyhow::anyhow!("{shown}: {why}")).into())
            }
            Found::Missing => Err(Unreadable(anyhow::anyhow!("{shown}: it is gone")).into()),
        }
    }

    /// What `dmp score` prints.
    fn score(&self, log: &PlannedLog, asked: &Asked) -> anyhow::Result<String> {
        let means = scoring::MEANS.iter().flat_map(|means| asked.as_arguments(*means));
        let arguments: Vec<String> = means.chain(log.arguments()).collect();
        let parsed = options::parsed(&arguments).map_err(crate::console::Usage)?;
        let mut bytes = Vec::new();
        let mut out: Out<'_> = Printed::new(&mut bytes as &mut dyn std::io::Write);
        score::run(&parsed, self.common, &mut out)?;
        std::io::Write::flush(&mut out)?;
        drop(out);
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// A result that was found cannot be written: whatever else is scored could not be either.
#[derive(Debug)]
struct NotKept;

impl std::fmt::Display for NotKept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a result cannot be kept")
    }
}

impl std::error::Error for NotKept {}
