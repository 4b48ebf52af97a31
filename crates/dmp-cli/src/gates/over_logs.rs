//! Gates of a suite: what must hold of versions over several logs.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use dmp::{Outcome, SuitePairReport, SuiteReport};
use toml::{Table, Value};

use super::annotate::{Annotate, tell_failed};
use super::check::GateReport;
use super::junit;
use crate::exit::{Exit, Usage};
use crate::host::Hosted;
use crate::save::save_text;

/// What must hold, and how it is told.
#[derive(Debug, Args)]
pub(crate) struct SuiteGateArgs {
    /// End with exit code 4 unless the version NAME is decided over all logs to be better than each of the others
    #[arg(long, value_name = "NAME", help_heading = "Gates")]
    expect_best: Option<String>,
    /// End with exit code 4 if any version is decided over all logs to be better than the version NAME
    #[arg(long, value_name = "NAME", help_heading = "Gates")]
    expect_unbeaten: Vec<String>,
    /// End with exit code 4 if the version NAME is worse than another one on more than N logs, or has no run there, or one that
    /// was left out, while the other has
    #[arg(long, value_name = "NAME=N", help_heading = "Gates")]
    fail_worse_on: Vec<WorseOn>,
    /// How failed gates are told on standard error: `github` writes `::error` lines, which GitHub Actions shows beside
    /// the change
    #[arg(long, value_name = "KIND", help_heading = "Gates")]
    annotate: Option<Annotate>,
    /// Also write the gates as a JUnit file, a test case for each, as CI servers read it
    #[arg(long, value_name = "FILE", help_heading = "Gates")]
    junit: Option<PathBuf>,
}

/// A version, and on how many logs it may be worse.
#[derive(Debug, Clone, PartialEq, Eq)]
struct WorseOn {
    version: String,
    logs: u64,
}

impl FromStr for WorseOn {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.rsplit_once('=').filter(|(version, _)| !version.is_empty());
        let parsed = parts.and_then(|(version, logs)| {
            Some(Self { version: version.to_owned(), logs: logs.trim().parse().ok()? })
        });
        parsed.ok_or_else(|| format!("`{text}` is no version with a number of logs: try new=2"))
    }
}

#[derive(Debug, Clone)]
enum Asked {
    Best(String),
    Unbeaten(String),
    WorseOn(WorseOn),
}

impl SuiteGateArgs {
    /// The file of [`Self::junit`], if it is asked for.
    pub(crate) fn junit(&self) -> Option<&Path> {
        self.junit.as_deref()
    }

    /// The gates, those of the suite's file among them.
    pub(crate) fn start(
        &self,
        versions: &[String],
        file: &Path,
        of_file: &Table,
    ) -> anyhow::Result<SuiteGates<'_>> {
        let mut asked: Vec<Asked> = self.expect_best.iter().cloned().map(Asked::Best).collect();
        asked.extend(self.expect_unbeaten.iter().cloned().map(Asked::Unbeaten));
        asked.extend(self.fail_worse_on.iter().cloned().map(Asked::WorseOn));
        for (key, value) in of_file {
            let wrong = |why| Usage(format!("{}: gates.{key} = {value}: {why}", file.display()));
            asked.extend(in_file(key, value).map_err(wrong)?);
        }
        for gate in &asked {
            let (Asked::Best(name) | Asked::Unbeaten(name) | Asked::WorseOn(WorseOn { version: name, .. })) =
                gate;
            if !versions.contains(name) {
                let known = versions.join(", ");
                return Err(Usage(format!(
                    "{}: no version is called `{name}`; the versions are {known}",
                    gate.text()
                ))
                .into());
            }
        }
        junit::check_folder(self.junit.as_deref())?;
        Ok(SuiteGates { arguments: self, asked })
    }
}

/// The gates that a key of the suite's file asks for.
fn in_file(key: &str, value: &Value) -> Result<Vec<Asked>, String> {
    let names = || -> Result<Vec<String>, String> {
        let list = match value {
            Value::Array(names) => names.as_slice(),
            name => std::slice::from_ref(name),
        };
        let text = |name: &Value| name.as_str().map(str::to_owned).ok_or("the name of a version is expected");
        Ok(list.iter().map(text).collect::<Result<_, _>>()?)
    };
    match key {
        "expect_best" => Ok(names()?.into_iter().map(Asked::Best).collect()),
        "expect_unbeaten" => Ok(names()?.into_iter().map(Asked::Unbeaten).collect()),
        "fail_worse_on" => {
            let wrong = "numbers of logs by version are expected, as { new = 2 }";
            let table = value.as_table().ok_or(wrong)?;
            let gate = |(version, logs): (&String, &Value)| {
                let logs = logs.as_integer().and_then(|logs| u64::try_from(logs).ok()).ok_or(wrong)?;
                Ok(Asked::WorseOn(WorseOn { version: version.clone(), logs }))
            };
            table.iter().map(gate).collect()
        }
        _ => Err("the gates of a suite are expect_best, expect_unbeaten and fail_worse_on".to_owned()),
    }
}

impl Asked {
    fn text(&self) -> String {
        match self {
            Self::Best(name) => format!("--expect-best {name}"),
            Self::Unbeaten(name) => format!("--expect-unbeaten {name}"),
            Self::WorseOn(WorseOn { version, logs }) => format!("--fail-worse-on {version}={logs}"),
        }
    }

    fn check(&self, report: &SuiteReport) -> Vec<GateReport> {
        let (Self::Best(name) | Self::Unbeaten(name) | Self::WorseOn(WorseOn { version: name, .. })) = self;
        let pairs = report.pairs.iter().filter(|pair| pair.a == *name || pair.b == *name);
        let check = |pair: &SuitePairReport| {
            let other = if pair.a == *name { &pair.b } else { &pair.a };
            let (passed, reason, value, limit) = match self {
                Self::Best(_) => {
                    (pair.better.as_deref() == Some(name), over_logs(pair, name, other), None, None)
                }
                Self::Unbeaten(_) => {
                    (pair.better.as_deref() != Some(other), over_logs(pair, name, other), None, None)
                }
                Self::WorseOn(WorseOn { logs: limit, .. }) => {
                    let (count, reason) = worse_on(report, pair, name, other, *limit);
                    (count <= *limit, reason, Some(count as f64), Some(*limit as f64))
                }
            };
            GateReport {
                gate: self.text(),
                run: name.clone(),
                against: Some(other.clone()),
                score: None,
                value,
                limit,
                unit: value.map(|_| "logs"),
                passed,
                reason,
            }
        };
        pairs.map(check).collect()
    }
}

fn over_logs(pair: &SuitePairReport, name: &str, other: &str) -> String {
    match (pair.outcome, pair.better.as_deref() == Some(name)) {
        (Outcome::Better, true) => format!("better than {other} over all logs"),
        (Outcome::Better, false) => format!("worse than {other} over all logs"),
        (Outcome::Undecided, _) => format!("undecided against {other} over all logs"),
        (Outcome::TooFewLogs, _) => format!("against {other}: {}", pair.reason),
    }
}

/// On how many logs a version fails against another one, in words too.
fn worse_on(
    report: &SuiteReport,
    pair: &SuitePairReport,
    name: &str,
    other: &str,
    limit: u64,
) -> (u64, String) {
    let worse = pair.worse(name);
    let is_lost = |log: &&dmp::SuiteLogReport| {
        let misses = |version: &str| log.missing.iter().any(|run| run.version == version);
        misses(name) && !misses(other)
    };
    let lost = report.logs.iter().filter(is_lost).count() as u64;
    let without = if lost > 0 { format!(", without a run on {lost}") } else { String::new() };
    let not = if worse + lost > limit { "" } else { "no " };
    let reason =
        format!("worse than {other} on {worse} of {} logs{without}: {not}more than {limit}", pair.compared);
    (worse + lost, reason)
}

/// Gates that were understood.
#[derive(Debug)]
pub(crate) struct SuiteGates<'a> {
    arguments: &'a SuiteGateArgs,
    asked: Vec<Asked>,
}

impl SuiteGates<'_> {
    /// Every gate with what became of it: one for each pair that it speaks of.
    pub(crate) fn check(&self, report: &SuiteReport) -> Vec<GateReport> {
        self.asked.iter().flat_map(|gate| gate.check(report)).collect()
    }

    /// Tells of those that failed, and writes the JUnit file. `done` is how the command would end without gates.
    pub(crate) fn end(&self, host: &Hosted, gates: &[GateReport], done: Exit) -> anyhow::Result<Exit> {
        tell_failed(host, self.arguments.annotate, gates);
        if let Some(file) = &self.arguments.junit {
            save_text(file, &junit::document("dmp suite", 0.0, gates))?;
        }
        Ok(if gates.iter().all(|gate| gate.passed) { done } else { Exit::GateFailed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp::{Confidence, MissingReport, SuiteLog, Verdict, suite_report};

    use crate::example_reports;

    /// Truth is better than drift on so many logs, and worse on so many; on the last drift has no run.
    fn report(better: usize, worse: usize) -> SuiteReport {
        let log = |k: usize| {
            let mut report = example_reports::three_runs();
            let run = if k < better { "truth" } else { "drift" };
            for pair in report.pairs.iter_mut().filter(|pair| pair.is_of("truth", "drift")) {
                pair.verdict = Verdict::Better { run: run.into(), decided_at_m: 2.0, is_same: false };
            }
            SuiteLog { name: format!("log {k}"), report: Ok(report), missing: Vec::new() }
        };
        let mut logs: Vec<SuiteLog> = (0..better + worse).map(log).collect();
        let missing = MissingReport { version: "drift".into(), reason: "no such file".into() };
        logs.push(SuiteLog {
            name: "last".into(),
            report: Ok(example_reports::one_run()),
            missing: vec![missing],
        });
        suite_report(&["truth".into(), "drift".into()], &logs, Confidence::P99)
    }

    fn told(file: &str, report: &SuiteReport) -> Vec<String> {
        let asked = toml::from_str::<Table>(file).unwrap();
        let gates = asked.iter().flat_map(|(key, value)| in_file(key, value).unwrap());
        let gates: Vec<GateReport> = gates.flat_map(|gate| gate.check(report)).collect();
        gates.iter().map(|gate| format!("{} {gate}", if gate.passed { "passed" } else { "FAILED" })).collect()
    }

    #[test]
    fn verdicts_over_all_logs_pass_and_fail() {
        let all = "expect_best = \"truth\"\nexpect_unbeaten = [\"truth\", \"drift\"]";
        let expected = [
            "passed truth: better than drift over all logs (--expect-best truth)",
            "passed truth: better than drift over all logs (--expect-unbeaten truth)",
            "FAILED drift: worse than truth over all logs (--expect-unbeaten drift)",
        ];
        assert_eq!(told(all, &report(9, 0)), expected);
        let few = "FAILED truth: against drift: too few logs: 8 needed, even if all of them agree, and 3 compare both \
                   (--expect-best truth)";
        assert_eq!(told("expect_best = \"truth\"", &report(3, 0)), [few]);
        assert_eq!(
            told("expect_best = \"truth\"", &report(8, 2)),
            ["FAILED truth: undecided against drift over all logs (--expect-best truth)"]
        );
    }

    #[test]
    fn logs_without_a_run_count_as_lost() {
        let expected =
            ["passed truth: worse than drift on 2 of 10 logs: no more than 2 (--fail-worse-on truth=2)"];
        assert_eq!(told("fail_worse_on = { truth = 2 }", &report(8, 2)), expected);
        let expected = [
            "FAILED drift: worse than truth on 2 of 10 logs, without a run on 1: more than 2 (--fail-worse-on drift=2)",
        ];
        assert_eq!(told("fail_worse_on = { drift = 2 }", &report(2, 8)), expected);
    }

    #[test]
    fn gates_that_are_none_are_refused() {
        assert_eq!("a=b=3".parse(), Ok(WorseOn { version: "a=b".into(), logs: 3 }));
        assert!(["new", "=3", "new=", "new=-1"].iter().all(|text| text.parse::<WorseOn>().is_err()));
        let refused = |text: &str| {
            let table = toml::from_str::<Table>(text).unwrap();
            table.iter().find_map(|(key, value)| in_file(key, value).err()).unwrap()
        };
        assert!(refused("fail_above = 3").starts_with("the gates of a suite are "));
        assert!(refused("fail_worse_on = 3").contains("as { new = 2 }"));
        assert!(refused("fail_worse_on = { new = -1 }").contains("as { new = 2 }"));
        assert!(refused("expect_best = 3").contains("name of a version"));
    }
}
