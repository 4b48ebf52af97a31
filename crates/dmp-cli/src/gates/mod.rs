//! Gates: what must hold of the scores for the command to end well, for scripts and CI.

mod check;
mod expect;
mod junit;
mod over_logs;
mod scores;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use dmp::Report;

use crate::console::{Exit, Hosted, Terminal, Tone, say};
use crate::files::save_text;
pub(crate) use check::GateReport;
use expect::Expect;
pub(crate) use over_logs::{SuiteGateArgs, SuiteGates};

// No doc comment: it would become the description of the command.
#[derive(Debug, Args)]
pub(crate) struct GateArgs {
    /// Exit with code 4 unless WHAT holds: `best:NAME`, `unbeaten:NAME`, `same[:A,B]`, `[NAME:]SCORE<LIMIT`, `[NAME:]SCORE>LIMIT`
    ///
    /// `best:NAME`: the run NAME is decided to be better than every other; undecided, mixed and the same fail.
    /// `unbeaten:NAME`: no run is decided to be better. `same` or `same:A,B`: all runs, or these two, are the same within
    /// --same-within; undecided fails. `[NAME:]SCORE<LIMIT` and `>`: the score of this run, or of every run, is on that side
    /// of the limit, or on it. SCORE is a column with its truncation: `R_cv_0.5<15cm`, `new:R_near_5<2.5`, `DMP<1.5`,
    /// `coverage>50%`; `R_cv` is `R_cv_10` and `R_near` is `R_near_5`. Where `GITHUB_ACTIONS=true`, failed gates are printed
    /// as annotations of GitHub.
    #[arg(long, value_name = "WHAT", help_heading = "Gates", value_parser = expect::parse)]
    expect: Vec<Expect>,
    /// Also write the gates as a JUnit file, a test case for each
    #[arg(long, value_name = "FILE", requires = "expect", help_heading = "Gates")]
    junit: Option<PathBuf>,
}

impl GateArgs {
    /// The gates, for runs with these names. An error in them is reported before anything long begins.
    pub(crate) fn start(&self, runs: &[&str]) -> anyhow::Result<Gates<'_>> {
        self.expect.iter().try_for_each(|gate| gate.check_names(runs))?;
        junit::check_folder(self.junit.as_deref())?;
        Ok(Gates { expect: &self.expect, junit: self.junit.as_deref() })
    }
}

/// Gates for runs that are there.
#[derive(Debug)]
pub(crate) struct Gates<'a> {
    expect: &'a [Expect],
    junit: Option<&'a Path>,
}

impl Gates<'_> {
    /// Every gate with its result: one for each run or pair that it is about.
    pub(crate) fn check(&self, report: &Report) -> Vec<GateReport> {
        self.expect.iter().flat_map(|gate| gate.check(report)).collect()
    }

    /// Reports those that failed, and writes the JUnit file. `done` is how the command would end without gates.
    pub(crate) fn end(
        &self,
        host: &Hosted,
        report: &Report,
        gates: &[GateReport],
        done: Exit,
    ) -> anyhow::Result<Exit> {
        end(host, gates, (self.junit, &format!("dmp {}", report.inputs.log), report.timing.total_s), done)
    }
}

/// Reports the gates that failed, and writes a JUnit file of a suite with this name that took so many seconds.
///
/// A failed gate goes before damaged input: a job that accepts damage must still fail on a gate.
fn end(
    host: &Hosted,
    gates: &[GateReport],
    (junit, name, total_s): (Option<&Path>, &str, f64),
    done: Exit,
) -> anyhow::Result<Exit> {
    let is_github =
        host.program().is_none() && std::env::var_os("GITHUB_ACTIONS").is_some_and(|is| is == "true");
    for failed in gates.iter().filter(|gate| !gate.passed) {
        if is_github {
            host.command(&annotation(failed));
        } else {
            say!(host, "gate failed: {failed}");
        }
    }
    if let Some(file) = junit {
        save_text(file, &junit::document(name, total_s, gates))?;
    }
    Ok(if gates.iter().all(|gate| gate.passed) { done } else { Exit::GateFailed })
}

/// A workflow command of GitHub Actions, in which `%` and line ends of the message are written as `%25` and the like
/// (docs.github.com, "Workflow commands for GitHub Actions").
fn annotation(failed: &GateReport) -> String {
    let message = failed.to_string().replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    format!("::error title=dmp gate failed::{message}")
}

/// Writes the results of the gates, below a table of scores.
pub(crate) fn table(out: &mut impl Write, gates: &[GateReport], terminal: Terminal) -> io::Result<()> {
    if !gates.is_empty() {
        writeln!(out, "\nGates")?;
    }
    for gate in gates {
        let word = if gate.passed { (Tone::Good, "passed") } else { (Tone::Bad, "FAILED") };
        terminal.tell_item(out, word, &gate.to_string())?;
    }
    Ok(())
}

/// A sentence for every gate that failed.
pub(crate) fn failures(gates: &[GateReport]) -> Vec<String> {
    gates.iter().filter(|gate| !gate.passed).map(|gate| format!("Gate failed: {gate}")).collect()
}
