//! Gates of a suite: what must hold of versions over several logs.

use std::path::{Path, PathBuf};

use clap::Args;
use dmp_suite::{Outcome, SuitePairReport, SuiteReport};
use toml::{Table, Value};

use super::check::{GateReport, check_name};
use super::expect::{Bound, sides};
use super::junit;
use crate::console::{Exit, Hosted, Usage};

// No doc comment: it would become the description of the command.
#[derive(Debug, Args)]
pub(crate) struct SuiteGateArgs {
    /// Exit with code 4 unless WHAT holds: `best:NAME`, `unbeaten:NAME`, `NAME:lost_logs<N`
    ///
    /// `best:NAME`: over all logs, the version NAME is decided to be better than every other. `unbeaten:NAME`: no version is
    /// decided to be better over all logs. `NAME:lost_logs<N`: against each other version, NAME is worse on at most N logs;
    /// a log counts too where NAME has no run, or an excluded one, and the other has a run. Where `GITHUB_ACTIONS=true`, failed
    /// gates are printed as annotations of GitHub.
    #[arg(long, value_name = "WHAT", help_heading = "Gates", value_parser = parse)]
    expect: Vec<Expect>,
    /// Also write the gates as a JUnit file, a test case for each
    #[arg(long, value_name = "FILE", help_heading = "Gates")]
    junit: Option<PathBuf>,
}

/// What must hold of a version.
#[derive(Debug, Clone)]
struct Expect {
    /// As it was typed.
    text: String,
    version: String,
    what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Best,
    Unbeaten,
    /// Worse than another version on no more logs.
    LostLogs(u64),
}

fn parse(text: &str) -> Result<Expect, String> {
    let of = |version: &str, what| Expect { text: text.to_owned(), version: version.to_owned(), what };
    let lost = sides(text).and_then(|(name, bound, logs)| {
        let version = name.strip_suffix(":lost_logs").filter(|name| !name.is_empty())?;
        let logs = logs.parse().ok().filter(|_| bound == Bound::Most)?;
        Some(of(version, What::LostLogs(logs)))
    });
    let gate = lost.or_else(|| match text.split_once(':')? {
        (_, "") => None,
        ("best", version) => Some(of(version, What::Best)),
        ("unbeaten", version) => Some(of(version, What::Unbeaten)),
        _ => None,
    });
    gate.ok_or_else(|| {
        format!("`{text}` is no gate of a suite: try best:NAME, unbeaten:NAME or NAME:lost_logs<2")
    })
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
        let mut expect = self.expect.clone();
        for (key, value) in of_file {
            let wrong = |why| Usage(format!("{}: gates.{key} = {value}: {why}", file.display()));
            expect.extend(in_file(key, value).map_err(wrong)?);
        }
        let versions: Vec<&str> = versions.iter().map(String::as_str).collect();
        expect.iter().try_for_each(|gate| check_name(&gate.text, "version", &gate.version, &versions))?;
        junit::check_folder(self.junit.as_deref())?;
        Ok(SuiteGates { expect, junit: self.junit.as_deref() })
    }
}

/// The gates of the suite's file: `expect`, one of them or a list.
fn in_file(key: &str, value: &Value) -> Result<Vec<Expect>, String> {
    if key != "expect" {
        return Err(
            "the only key of gates is expect, as expect = [\"best:new\", \"new:lost_logs<2\"]".to_owned()
        );
    }
    let list = match value {
        Value::Array(gates) => gates.as_slice(),
        gate => std::slice::from_ref(gate),
    };
    list.iter().map(|gate| parse(gate.as_str().ok_or("a gate is expected, as \"best:new\"")?)).collect()
}

impl Expect {
    fn check(&self, report: &SuiteReport) -> Vec<GateReport> {
        let name = &self.version;
        let pairs = report.pairs.iter().filter(|pair| pair.a == *name || pair.b == *name);
        let check = |pair: &SuitePairReport| {
            let other = if pair.a == *name { &pair.b } else { &pair.a };
            let better = pair.better.as_deref();
            let result = match self.what {
                What::Best => GateReport { passed: better == Some(name), ..GateReport::default() },
                What::Unbeaten => GateReport { passed: better != Some(other), ..GateReport::default() },
                What::LostLogs(limit) => {
                    let (count, reason) = worse_on(report, pair, name, other, limit);
                    let (value, limit) = (Some(count as f64), Some(limit as f64));
                    let passed = value <= limit;
                    GateReport { value, limit, unit: Some("logs"), passed, reason, ..GateReport::default() }
                }
            };
            let reason = if result.value.is_some() { result.reason } else { over_logs(pair, name, other) };
            GateReport {
                gate: format!("--expect {}", self.text),
                run: name.clone(),
                against: Some(other.clone()),
                reason,
                ..result
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
    let is_lost = |log: &&dmp_suite::SuiteLogReport| {
        let misses = |version: &str| log.missing.iter().any(|run| run.version == version);
        misses(name) && !misses(other) && pair.failing_on(&log.name).is_none()
    };
    let lost = report.logs.iter().filter(is_lost).count() as u64;
    let without = if lost > 0 { format!(", without a run on {lost}") } else { String::new() };
    let not = if worse + lost > limit { "" } else { "no " };
    let reason =
        format!("worse than {other} on {worse} of {} logs{without}: {not}more than {limit}", pair.compared);
    (worse + lost, reason)
}

/// Gates for versions that are there.
#[derive(Debug)]
pub(crate) struct SuiteGates<'a> {
    expect: Vec<Expect>,
    junit: Option<&'a Path>,
}

impl SuiteGates<'_> {
    /// Every gate with its result: one for each pair that it is about.
    pub(crate) fn check(&self, report: &SuiteReport) -> Vec<GateReport> {
        self.expect.iter().flat_map(|gate| gate.check(report)).collect()
    }

    /// Reports those that failed, and writes the JUnit file. `done` is how the command would end without gates.
    pub(crate) fn end(&self, host: &Hosted, gates: &[GateReport], done: Exit) -> anyhow::Result<Exit> {
        super::end(host, gates, (self.junit, "dmp suite", 0.0), done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp::{Confidence, Verdict};
    use dmp_suite::{Failures, MissingReport, SuiteLog, suite_report};

    use crate::example_reports;

    /// Truth is better than drift on so many logs, and worse on so many; on the last drift has no run.
    fn report(better: usize, worse: usize) -> SuiteReport {
        let log = |k: usize| {
            let mut report = example_reports::three_runs();
            let run = if k < better { "truth" } else { "drift" };
            for pair in report.pairs.iter_mut().filter(|pair| pair.is_of("truth", "drift")) {
                pair.verdict = Verdict::Better { run: run.into(), decided_at_m: Some(2.0) };
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
        suite_report(&["truth".into(), "drift".into()], &logs, Confidence::P99, Failures::Skip)
    }

    #[test]
    fn gates_over_all_logs_pass_and_fail() {
        let few = "FAILED truth: against drift: too few logs: 8 needed, even if all of them agree, and 3 compare both";
        for (what, (better, worse), expected) in [
            ("best:truth", (9, 0), "passed truth: better than drift over all logs"),
            ("unbeaten:truth", (9, 0), "passed truth: better than drift over all logs"),
            ("unbeaten:drift", (9, 0), "FAILED drift: worse than truth over all logs"),
            ("best:truth", (3, 0), few),
            ("best:truth", (8, 2), "FAILED truth: undecided against drift over all logs"),
            ("truth:lost_logs<2", (8, 2), "passed truth: worse than drift on 2 of 10 logs: no more than 2"),
            // A log without a run counts.
            (
                "drift:lost_logs<=2",
                (2, 8),
                "FAILED drift: worse than truth on 2 of 10 logs, without a run on 1: more than 2",
            ),
        ] {
            let gates = parse(what).unwrap().check(&report(better, worse));
            let word = if gates[0].passed { "passed" } else { "FAILED" };
            assert_eq!(format!("{word} {}", gates[0]), format!("{expected} (--expect {what})"));
            assert_eq!(gates.len(), 1);
        }
    }

    #[test]
    fn gates_that_are_none_are_rejected() {
        let gate = parse("a:b<c:lost_logs<3").unwrap();
        assert_eq!((gate.version.as_str(), gate.what), ("a:b<c", What::LostLogs(3)));
        for text in ["new", "best:", ":lost_logs<1", "new:lost_logs<", "new:lost_logs<-1", "new:lost_logs>1"]
        {
            assert!(parse(text).unwrap_err().contains("try best:NAME"), "{text}");
        }
        for (file, error) in [
            ("expect_best = \"new\"", "the only key of gates is expect"),
            ("expect = 3", "a gate is expected"),
            ("expect = [\"better:new\"]", "`better:new` is no gate of a suite"),
        ] {
            let table = toml::from_str::<Table>(file).unwrap();
            let found = table.iter().find_map(|(key, value)| in_file(key, value).err()).unwrap();
            assert!(found.starts_with(error), "{found}");
        }
        let table = toml::from_str::<Table>("expect = [\"best:new\", \"old:lost_logs<2\"]").unwrap();
        let gates: Vec<Expect> = table.iter().flat_map(|(k, v)| in_file(k, v).unwrap()).collect();
        assert_eq!(gates.len(), 2);
    }
}
