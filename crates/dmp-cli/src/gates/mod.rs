//! Gates: what must hold of the scores for the command to end well, for scripts and CI.

mod annotate;
mod check;
mod junit;
mod limit;
mod over_logs;
mod scores;

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use dmp::Report;

use crate::exit::Exit;
use crate::host::Hosted;
use crate::parse::{Pair, pair};
use crate::save::save_text;
use crate::terminal::{Terminal, Tone};
use annotate::Annotate;
use check::Asked;
pub(crate) use check::GateReport;
use limit::{Bound, Limit};
pub(crate) use over_logs::{SuiteGateArgs, SuiteGates};

/// What must hold, and how it is told.
#[derive(Debug, Args)]
pub(crate) struct GateArgs {
    #[command(flatten)]
    asked: AskedArgs,
    /// How failed gates are told on standard error: `github` writes `::error` lines, which GitHub Actions shows beside
    /// the change
    #[arg(long, value_name = "KIND", requires = "AskedArgs", help_heading = "Gates")]
    annotate: Option<Annotate>,
    /// Also write the gates as a JUnit file, a test case for each, as CI servers read it
    #[arg(long, value_name = "FILE", requires = "AskedArgs", help_heading = "Gates")]
    junit: Option<PathBuf>,
}

/// The gates themselves.
#[derive(Debug, Args)]
struct AskedArgs {
    /// End with exit code 4 if a score of the run NAME, or without NAME of any run, is above a limit, or is not given.
    /// Scores are `R_cv_10`, `R_cv_2`, `R_cv_0.5`, `R_cv_0.2`, `R_near_5`, `R_near_2` and `R_near_0.5` (roots, as in the
    /// table: 2.5 or 2.5m, 15cm; of a room `R_cv_1`, `R_cv_0.2`, `R_cv_0.05`, `R_cv_0.02`, `R_near_0.5`, `R_near_0.2`
    /// and `R_near_0.05`; `R_cv` is `R_cv_10`, `R_near` is `R_near_5`), `DMP` (the mean, m²), `miss`, `blocked`,
    /// `coverage` and `revisit` (5% or 0.05)
    #[arg(long, value_name = "[NAME:]SCORE=LIMIT", help_heading = "Gates", value_parser = limit::above)]
    fail_above: Vec<Limit>,
    /// The same if it is below: `--fail-below coverage=50%`
    #[arg(long, value_name = "[NAME:]SCORE=LIMIT", help_heading = "Gates", value_parser = limit::below)]
    fail_below: Vec<Limit>,
    /// End with exit code 4 unless the run NAME is decided to be better than each of the others; undecided, mixed
    /// and the same are not enough
    #[arg(long, value_name = "NAME", help_heading = "Gates")]
    expect_best: Option<String>,
    /// End with exit code 4 if any run is decided to be better than the run NAME; undecided, mixed and the same pass
    #[arg(long, value_name = "NAME", help_heading = "Gates")]
    expect_unbeaten: Vec<String>,
    /// End with exit code 4 unless these two runs, or without names all, are the same within --same-within: at no scale
    /// is a difference left possible that matters. Undecided is not enough
    #[arg(long, value_name = "RUN,RUN", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    #[arg(value_parser = pair, help_heading = "Gates")]
    expect_same: Vec<Pair>,
}

impl GateArgs {
    /// The gates, for runs with these names. What is wrong with them is told before anything long begins.
    pub(crate) fn start(&self, runs: &[&str]) -> anyhow::Result<Gates<'_>> {
        let asked = &self.asked;
        let limits = |limits: &[Limit], bound| {
            limits.iter().map(move |limit| Asked::Limit(limit.clone(), bound)).collect::<Vec<_>>()
        };
        let mut gates = limits(&asked.fail_above, Bound::Above);
        gates.extend(limits(&asked.fail_below, Bound::Below));
        gates.extend(asked.expect_best.iter().cloned().map(Asked::Best));
        gates.extend(asked.expect_unbeaten.iter().cloned().map(Asked::Unbeaten));
        gates.extend(asked.expect_same.iter().map(|pair| Asked::Same(pair.0.clone())));
        for gate in &gates {
            gate.refuse_unknown(runs)?;
        }
        junit::check_folder(self.junit.as_deref())?;
        Ok(Gates { arguments: self, asked: gates })
    }
}

/// Gates that were understood.
#[derive(Debug)]
pub(crate) struct Gates<'a> {
    arguments: &'a GateArgs,
    asked: Vec<Asked>,
}

impl Gates<'_> {
    /// Every gate with what became of it: one for each run or pair that it speaks of.
    pub(crate) fn check(&self, report: &Report) -> Vec<GateReport> {
        self.asked.iter().flat_map(|gate| gate.check(report)).collect()
    }

    /// Tells of those that failed, and writes the JUnit file. `done` is how the command would end without gates.
    ///
    /// A failed gate goes before damaged input: who has come to accept the one is still to hear of the other.
    pub(crate) fn end(
        &self,
        host: &Hosted,
        report: &Report,
        gates: &[GateReport],
        done: Exit,
    ) -> anyhow::Result<Exit> {
        annotate::tell_failed(host, self.arguments.annotate, gates);
        if let Some(file) = &self.arguments.junit {
            let name = format!("dmp {}", report.inputs.log);
            save_text(file, &junit::document(&name, report.timing.total_s, gates))?;
        }
        Ok(if gates.iter().all(|gate| gate.passed) { done } else { Exit::GateFailed })
    }
}

/// Writes what became of the gates, below a table of scores.
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
